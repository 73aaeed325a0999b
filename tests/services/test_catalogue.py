import json
import shutil
from collections import Counter
from collections.abc import Callable
from datetime import date
from functools import partial
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from django.contrib.auth.models import User
from django.core.management import call_command
from django.utils import timezone

from augment.errors import Conflict, InvalidDocument, UnknownName
from augment.models import (
    Augmentation,
    BaseScene,
    Benchmark,
    Contestant,
    Event,
    GenerationJob,
    Scenario,
)
from augment.scene.codec import intent_to_document, modification_to_document, scene_to_document
from augment.scene.entities import Modification, ScenarioType
from augment.services.benchmarks.benchmarks import load_standard
from augment.services.scenarios.catalogue import CatalogueReport, CatalogueStep, load_catalogue
from augment.services.scenarios.choosing import resolve_scenarios
from augment.services.scenarios.scene_imports import import_scene
from augment.services.scenarios.scenes import LoadedScenario, NewScenario, add_scenario
from tests.fixtures.shelf import FOLDER, HARD, MOVING, OPEN
from tests.intents import parked
from tests.scenes import scene, vehicle

pytestmark = pytest.mark.django_db

REFERENCE = Modification(added=(vehicle("Agent2", 20.0, -0.8),))
PARKED = {
    "format": "scenario-arena/scenario",
    "version": 1,
    "slug": "parked-car",
    "scene": "street",
    "type": ScenarioType.NUDGE,
    "instruction": "Add a parked car 20 m ahead.",
    "keep_traffic": False,
    "provenance": "made for a test",
    "reference": modification_to_document(REFERENCE),
    "intent": intent_to_document(parked(20.0)),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "shelf"
    for name in ("scenes", "scenarios"):
        (folder / name).mkdir(parents=True)
    (folder / "scenes/street.json").write_text(json.dumps(scene_to_document(scene())))
    (folder / "scenarios/parked-car.json").write_text(json.dumps(PARKED))
    return folder


def bring(folder: Path, file: Path) -> None:
    """Copy a file of the project's catalogue to its place in the folder."""
    place = folder / file.relative_to(FOLDER)
    place.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(file, place)


def edit(file: Path, change: Callable[[dict[str, Any]], object]) -> None:
    document = json.loads(file.read_text())
    change(document)
    file.write_text(json.dumps(document))


def add_copy(folder: Path, slug: str, **changes: object) -> None:
    """Add the scenario of the folder once more, with other fields."""
    file = folder / f"scenarios/{slug}.json"
    shutil.copy(folder / "scenarios/parked-car.json", file)
    edit(file, lambda it: it.update(slug=slug, **changes))


def add_avenue(folder: Path) -> None:
    """Add the scene of the folder once more."""
    shutil.copy(folder / "scenes/street.json", folder / "scenes/avenue.json")
    edit(folder / "scenes/avenue.json", lambda it: it.update(name="avenue"))


def augment(scenario: Scenario) -> None:
    job = GenerationJob.objects.create(name="first")
    contestant, _ = Contestant.objects.get_or_create(slug="ada", name="Ada", kind="human")
    Augmentation.objects.create(job=job, scenario=scenario, contestant=contestant)


def report(*, scenes: tuple[int, int, int], scenarios: tuple[int, int, int]) -> CatalogueReport:
    steps = (CatalogueStep.ADDED, CatalogueStep.CHANGED, CatalogueStep.UNCHANGED)
    return CatalogueReport(
        scenes=Counter(dict(zip(steps, scenes, strict=True))),
        scenarios=Counter(dict(zip(steps, scenarios, strict=True))),
    )


def test_a_folder_becomes_rows_and_lines_in_the_log(folder: Path) -> None:
    ada = User.objects.create_user("ada")
    assert load_catalogue(folder=folder, actor=ada) == report(
        scenes=(1, 0, 0), scenarios=(1, 0, 0)
    )
    scenario = Scenario.objects.get()
    assert (scenario.slug, scenario.type) == ("parked-car", "nudge_around_parked_vehicle")
    assert scenario.in_catalogue
    assert scenario.base_scene.source == "authored"
    assert LoadedScenario(scenario).reference == REFERENCE
    assert set(Event.objects.values_list("actor", "object_kind")) == {
        (ada.pk, "scene"),
        (ada.pk, "scenario"),
    }


def test_loading_again_changes_nothing(folder: Path) -> None:
    load_catalogue(folder=folder)
    events = Event.objects.count()
    assert load_catalogue(folder=folder) == report(scenes=(0, 0, 1), scenarios=(0, 0, 1))
    assert Event.objects.count() == events


def test_the_hard_set_comes_when_it_is_asked_for_with_its_paraphrases_beside(folder: Path) -> None:
    for name in ("scenes/hairpin-hill.json", "scenarios/hairpin-hill-van.json"):
        bring(folder, HARD / name)
    out = StringIO()
    call_command("load_catalogue", "--folder", str(folder), stdout=out)
    assert resolve_scenarios(["catalogue"]) == ["parked-car"]
    call_command("load_catalogue", "--folder", str(folder), "--set", "all", stdout=out)
    assert resolve_scenarios(["catalogue"]) == ["hairpin-hill-van", "parked-car"]
    call_command(
        "load_catalogue", "--folder", str(folder), "--set", "hard", "--paraphrases", stdout=out
    )
    assert "scenarios: 3 added, 0 changed, 1 unchanged" in out.getvalue()
    assert resolve_scenarios(["paper"]) == ["parked-car"]
    assert resolve_scenarios(["hard", "hairpin-hill-van"]) == ["hairpin-hill-van"]
    assert len(resolve_scenarios(["hard", "paraphrases"])) == 4
    assert resolve_scenarios(["set:hard"]) == resolve_scenarios(["hard"])
    assert resolve_scenarios(["hairpin-hill-van-p?", "parked-*"]) == [
        "hairpin-hill-van-p1",
        "hairpin-hill-van-p2",
        "hairpin-hill-van-p3",
        "parked-car",
    ]
    for word in ("set:soft", "interplan-*", "parked"):
        with pytest.raises(UnknownName, match=r"set 'soft'|scenario"):
            resolve_scenarios([word])
    german = Scenario.objects.get(slug="hairpin-hill-van-p2")
    original = Scenario.objects.get(slug="hairpin-hill-van")
    assert (german.language, german.paraphrase_of) == ("de", original)
    assert (german.reference, german.intent) == (original.reference, original.intent)
    assert german.instruction.startswith("In der Kehre")


def test_the_moving_set_brings_those_scenes_of_the_others_that_it_is_on(folder: Path) -> None:
    bring(folder, FOLDER / "scenes/mill-junction.json")
    bring(folder, MOVING / "scenarios/hard-braking-mill-junction.json")
    loaded = load_catalogue(folder=folder, sets=["moving"])
    assert loaded == report(scenes=(1, 0, 0), scenarios=(1, 0, 0))
    scenario = Scenario.objects.get()
    assert (scenario.base_scene.slug, scenario.get_type_display()) == (
        "mill-junction",
        "Hard braking",
    )
    assert resolve_scenarios(["set:moving"]) == ["hard-braking-mill-junction"]
    again = load_catalogue(folder=folder, sets=["moving"])
    assert again == report(scenes=(0, 0, 1), scenarios=(0, 0, 1))


def test_an_open_wish_has_an_example_that_nobody_is_measured_by(folder: Path) -> None:
    bring(folder, FOLDER / "scenes/ferry-road.json")
    bring(folder, OPEN / "scenarios/way-ferry-road.json")
    load_catalogue(folder=folder, sets=["open"])
    scenario = Scenario.objects.get()
    assert (scenario.is_open, scenario.get_type_display()) == (True, "Leave one narrow way past")
    assert LoadedScenario(scenario).reference is not None
    assert load_standard(scenario) is None


def test_a_scene_that_was_augmented_stays_as_stored_and_is_named(folder: Path) -> None:
    load_catalogue(folder=folder)
    augment(Scenario.objects.get())
    edit(folder / "scenes/street.json", lambda it: it.update(provenance="other"))
    assert load_catalogue(folder=folder).kept == ("parked-car",)
    assert BaseScene.objects.get().provenance != "other"


def _move_to(at_m: object, entry: dict[str, Any]) -> None:
    entry["reference"]["add"][0]["x_m"] = at_m


def hand_out(scenario: Scenario, split: str = "test") -> None:
    benchmark = Benchmark.objects.create(slug="b", version=1, made_on=date(2026, 1, 1))
    benchmark.items.create(scenario=scenario, position=1, split=split, stratum="easy")


@pytest.mark.parametrize(
    ("split", "step"), [("test", CatalogueStep.CHANGED), ("practice", CatalogueStep.RENEWED)]
)
def test_an_intent_where_there_was_none_is_new_to_who_practises(
    split: str, step: CatalogueStep, folder: Path
) -> None:
    load_catalogue(folder=folder)
    assert Scenario.objects.exclude(intent=None).update(intent=None, intent_origin="") == 1
    hand_out(Scenario.objects.get(), split)
    assert load_catalogue(folder=folder).scenarios == {step: 1}


@pytest.mark.parametrize("use", [augment, hand_out])
def test_what_is_in_use_stays_and_its_file_becomes_a_new_version(
    folder: Path, use: Callable[[Scenario], None]
) -> None:
    add_copy(folder, "then", follows="parked-car")
    load_catalogue(folder=folder)
    first = Scenario.objects.get(slug="parked-car")
    before = Scenario.objects.values().get(pk=first.pk)
    use(first)
    for at_m, version in ((21.0, "-v2"), (22.0, "-v3")):
        file = folder / "scenarios/parked-car.json"
        edit(file, partial(_move_to, at_m))
        loaded = load_catalogue(folder=folder)
        assert loaded.scenarios == {CatalogueStep.RENEWED: 2}
        assert load_catalogue(folder=folder).scenarios == {CatalogueStep.UNCHANGED: 2}
        newest = Scenario.objects.get(slug=f"parked-car{version}")
        assert (newest.origin, newest.catalogue_set) == (first.origin, "paper")
        reference = LoadedScenario(newest).reference
        assert reference.added[0].x_m == at_m
        assert Scenario.objects.get(slug=f"then{version}").follows == newest
        assert resolve_scenarios(["catalogue"]) == [newest.slug, f"then{version}"]
        augment(newest)
    first.refresh_from_db()
    assert first.retired_at is not None
    after = Scenario.objects.values().get(pk=first.pk)
    assert after | {"retired_at": None} == before
    file = folder / "scenarios/parked-car.json"
    Scenario.objects.filter(slug="parked-car-v3").update(retired_at=timezone.now())
    edit(file, partial(_move_to, 23.0))
    load_catalogue(folder=folder)
    assert resolve_scenarios(["catalogue"]) == ["then-v4"]  # what a person retired stays so


def test_an_older_installation_is_upgraded_but_for_what_was_augmented(folder: Path) -> None:
    add_avenue(folder)
    for slug, place in (("beside", "street"), ("far", "avenue")):
        add_copy(folder, slug, scene=place, instruction=slug)
    load_catalogue(folder=folder)
    augment(Scenario.objects.get(slug="parked-car"))
    for name in ("street", "avenue"):
        edit(folder / f"scenes/{name}.json", lambda it: it.update(provenance="newer"))
    add_copy(folder, "new", instruction="anew")
    out = StringIO()
    call_command("load_catalogue", "--folder", str(folder), stdout=out)
    assert "scenes: 0 added, 1 changed, 0 unchanged" in out.getvalue()
    assert "newer version: beside, new, parked-car" in out.getvalue()
    assert [*BaseScene.objects.filter(provenance="newer")] == [
        BaseScene.objects.get(slug="avenue")
    ]
    assert Augmentation.objects.get().scenario.instruction == PARKED["instruction"]


def test_a_changed_file_follows_neither_itself_nor_nothing(folder: Path) -> None:
    add_copy(folder, "then", follows="parked-car")
    load_catalogue(folder=folder)
    for followed in ("no-such", "then"):
        add_copy(folder, "then", follows=followed)
        with pytest.raises((Conflict, UnknownName), match=followed):
            load_catalogue(folder=folder)


def test_rows_from_elsewhere_are_never_replaced(folder: Path) -> None:
    import_scene(source="json", path=folder / "scenes/street.json", frame=0, slug="street")
    with pytest.raises(Conflict, match="from the source 'json'"):
        load_catalogue(folder=folder)
    BaseScene.objects.update(source="authored")
    add_scenario(NewScenario(scene="street", type="cut_in", instruction="x", slug="parked-car"))
    with pytest.raises(Conflict, match="not the catalogue's"):
        load_catalogue(folder=folder)


def test_every_problem_names_its_file_and_path_and_nothing_is_kept(folder: Path) -> None:
    shutil.copy(folder / "scenes/street.json", folder / "scenes/other.json")
    add_copy(folder, "broken")
    edit(folder / "scenarios/broken.json", partial(_move_to, "far"))
    add_copy(folder, "lost", scene="nowhere")
    with pytest.raises(InvalidDocument) as caught:
        load_catalogue(folder=folder)
    assert [path for path, _ in caught.value.problems] == [
        "scenes/other.json: name",
        "scenarios/broken.json: add[0].x_m",
        "scenarios/lost.json: scene",
    ]
    assert not BaseScene.objects.exists()


def test_a_conflict_late_in_the_folder_undoes_everything(folder: Path) -> None:
    load_catalogue(folder=folder)
    Scenario.objects.update(catalogue_set="")
    add_avenue(folder)
    with pytest.raises(Conflict):
        load_catalogue(folder=folder)
    assert [row.slug for row in BaseScene.objects.all()] == ["street"]
