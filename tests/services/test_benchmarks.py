"""Benchmarks as rows: made, found, handed out, and what stays while they are."""

from collections.abc import Iterable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from django.apps import apps
from django.core.management import CommandError, call_command
from django.urls import reverse

from arena.scenarios import services
from augment.benchmark.folder import checksum, read_folder
from augment.benchmark.values import Split
from augment.errors import Conflict, InvalidDocument, UnknownName
from augment.models import BaseScene, Benchmark, BenchmarkItem, Event, Scenario
from augment.scene.codec import intent_to_document, modification_to_document
from augment.scene.entities import Modification
from augment.scene.intent import Shape
from augment.services.benchmarks.benchmarks import (
    BenchmarkRequest,
    benchmark_set,
    find_benchmark,
    list_remarks,
    make_benchmark,
    plan_benchmark,
    refuse_handed_out,
)
from augment.services.events import retire
from augment.services.scenarios.scenes import NewScenario, ScenarioContent, add_variant
from augment.services.scenarios.scenes import add_scenario as add_scenario_row
from tests.intents import cones
from tests.jobs.rows import add_scenario
from tests.scenes import cone, vehicle
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def add_street(number: int, **columns: Any) -> Scenario:
    """A scenario that asks for something else than the others do."""
    reference = Modification(added=(cone("Agent9", 10.0625 + number, 0.5),))
    given: dict[str, Any] = {
        "intent": intent_to_document(cones(10.0 + number, 1, Shape.LINE)),
        "reference": modification_to_document(reference),
    }
    return add_scenario(f"street-{number}", **given | columns)


@pytest.fixture
def streets() -> list[Scenario]:
    return [add_street(number) for number in range(1, 6)]


def asked(*scenarios: str, **changes: Any) -> BenchmarkRequest:
    given: dict[str, Any] = {"slug": "streets", "title": "Streets", "practice": 40.0}
    return BenchmarkRequest(scenarios=scenarios or ("street-*",), **given | changes)


def test_a_benchmark_is_made_again_as_its_next_version(streets: list[Scenario]) -> None:
    first = make_benchmark(asked())
    kept = [(item.position, item.scenario.slug) for item in first.items.all()]
    assert kept == [(number, f"street-{number}") for number in range(1, 6)]
    assert first.items.filter(split="practice").count() == 2
    found = benchmark_set(first)
    assert [task.reference is None for task in found.tasks] == [False] * 5
    second = make_benchmark(asked("street-1"))
    assert second.items.get().split == first.items.get(position=1).split
    assert [str(first), str(second)] == ["streets@1", "streets@2"]
    assert first.checksum != second.checksum
    assert Event.objects.filter(verb="make", object_kind="benchmark").count() == 2
    assert [find_benchmark(name) for name in ("streets", "streets@1", str(first.code))] == [
        second,
        first,
        first,
    ]
    retire(second)
    assert find_benchmark("streets") == first
    for name in ("street", "streets@3", "streets@x"):
        with pytest.raises(UnknownName, match="Known: streets@2, streets@1"):
            find_benchmark(name)


def test_wordings_and_alike_wishes_are_in_one_split(streets: list[Scenario]) -> None:
    for original in streets[:3]:
        add_scenario(f"{original.slug}-p1", paraphrase_of=original, intent=original.intent)
    twin = add_scenario("twin", intent=streets[4].intent)
    assert twin.base_scene != streets[4].base_scene
    both = set()
    for seed in range(12):
        planned = plan_benchmark(asked("all", seed=seed))
        split = {one.scenario.slug: one.split for one in planned}
        for slug in ("street-1", "street-2", "street-3"):
            assert split[slug] is split[f"{slug}-p1"]
        assert split["twin"] is split["street-5"]
        both |= {split["street-1"]}
    assert both == set(Split)
    tasks = benchmark_set(make_benchmark(asked("street-1", "street-1-p1", "street-2-p1"))).tasks
    assert [task.paraphrase_of for task in tasks] == ["", "street-1", ""]


def add_relatives(first: Scenario) -> list[Scenario]:
    """Add a family, a copy and its variant, and one that says nothing but has a pose of it."""

    def placed(*xs: float) -> Modification:
        return Modification(added=tuple(cone(f"Agent{x:g}", x, 0.5) for x in xs))

    family = [
        add_variant(first, difference=f"{n} m", reference=placed(20.0 + n % 3, 40.0), intent=None)
        for n in range(12)
    ]
    asks: dict[str, Any] = {"scene": first.base_scene.slug, "type": first.type}
    asks |= {"instruction": "Place them nearer.", "keep_traffic": True}
    copy = add_scenario_row(NewScenario(**asks, variant_of=first.slug, reference=first.reference))
    second = add_variant(copy, difference="7 m", reference=placed(7.0), intent=None)
    lone = modification_to_document(placed(21.0, 60.0))
    return [*family, copy, second, add_scenario_row(NewScenario(**asks, reference=lone))]


def poses_of(items: Iterable[BenchmarkItem]) -> set[tuple[object, ...]]:
    references = [(item.scenario.base_scene_id, item.scenario.reference or {}) for item in items]
    return {
        (scene, agent["x_m"], agent["y_m"], agent["heading_rad"])
        for scene, reference in references
        for agent in reference["add"]
    }


def test_what_goes_back_to_one_scenario_is_in_one_split(streets: list[Scenario]) -> None:
    relatives = {row.slug for row in add_relatives(streets[0])} | {"street-1"}
    both = set()
    for seed in range(12):
        planned = plan_benchmark(asked("all", practice=40.0 + seed % 2 * 50.0, seed=seed))
        practice, test = (
            [item for item in planned if item.split is split]
            for split in (Split.PRACTICE, Split.TEST)
        )
        assert not poses_of(practice) & poses_of(test)
        splits = {item.split for item in planned if item.scenario.slug in relatives}
        assert len(splits) == 1
        both |= splits
    assert both == set(Split)
    make_benchmark(asked("street-1", "street-2", practice=0.0))
    for seed in range(12):
        planned = plan_benchmark(asked("all", practice=90.0, seed=seed))
        later = {item.scenario.slug: item.split for item in planned}
        assert {later[slug] for slug in (*relatives, "street-2")} == {Split.TEST}


def test_the_upgrade_finds_what_scenarios_were_made_from(streets: list[Scenario]) -> None:
    *_, lone = add_relatives(streets[0])
    add_scenario("street-2-p1", paraphrase_of=streets[1], reference=None)
    add_street(6, follows=streets[2])
    # Nobody said what it was made from, but its pose does.
    Scenario.objects.filter(pk=lone.pk).update(origin=streets[0].origin)
    before = dict(Scenario.objects.values_list("slug", "origin"))
    assert len(set(before.values())) == 5
    Scenario.objects.update(origin=None)
    import_module("augment.migrations.0039_origins").find_origins(apps, None)
    assert dict(Scenario.objects.values_list("slug", "origin")) == before


def test_a_benchmark_whose_test_references_can_be_known_says_so(
    streets: list[Scenario], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    row, variant = make_benchmark(asked(practice=0.0)), add_relatives(streets[0])[0]
    assert list_remarks(row) == list_remarks(None) == ()
    other = make_benchmark(asked(variant.slug, slug="other"))
    other.items.update(split=Split.PRACTICE)  # as before a variant had an origin
    alike = "Variants of 1 of 5 test tasks are handed out with their references."
    assert list_remarks(row) == (alike,)
    Scenario.objects.filter(pk=streets[0].pk).update(catalogue_set="hard")
    public = "Test references are public: 1 of 5 come with the project or vary such."
    assert list_remarks(row) == (public, alike)
    call_command("export", "benchmark", "streets", "--out", str(tmp_path / "folder"))
    assert public in capsys.readouterr().err
    assert (tmp_path / "folder" / "WARNING.txt").read_text().startswith(f"{public}\n{alike}\n")
    assert read_folder(tmp_path / "folder").name == "streets"
    admin = signed_in(people()["admin"])
    page = admin.get(reverse("benchmark", args=[row.code]))
    assert public in page.content.decode()
    listed = admin.get(reverse("benchmarks")).content.decode()
    assert listed.count("Test references are public: 1 of its tasks.") == 1


def test_a_follow_up_is_left_out_and_refused_where_it_is_named(streets: list[Scenario]) -> None:
    add_street(6, follows=streets[0])
    assert len(plan_benchmark(asked("street-*"))) == 5
    with pytest.raises(Conflict, match="“street-6” says how to change an answer to “street-1”"):
        plan_benchmark(asked("street-*", "street-6"))


def test_what_has_no_reference_is_for_the_test() -> None:
    add_street(1, reference=None)
    add_street(2, reference=None, intent=None, intent_origin="")
    row = make_benchmark(asked(practice=90.0))
    assert set(row.items.values_list("split", flat=True)) == {"test"}


def test_what_is_asked_for_is_checked(streets: list[Scenario]) -> None:
    for changes, fault, reason in (
        ({"slug": "No slug"}, InvalidDocument, "slug"),
        ({"title": " "}, InvalidDocument, "title"),
        ({"practice": 95.0}, InvalidDocument, "practice: goes from 0 to 90, not 95"),
    ):
        with pytest.raises(fault, match=reason):
            make_benchmark(asked(**changes))
    with pytest.raises(Conflict, match="1 to 2000 scenarios; these are 0"):
        make_benchmark(asked("paper"))
    assert not Benchmark.objects.exists()


# What stays


def change(row: Scenario, reference: object) -> None:
    content = ScenarioContent(
        instruction=row.instruction,
        type=row.type,
        keep_traffic=row.keep_traffic,
        reference=reference,
    )
    services.change_scenario(row, content)


def test_what_is_handed_out_stays_until_the_benchmark_is_retired(streets: list[Scenario]) -> None:
    row, other = make_benchmark(asked("street-1")), Modification(added=(vehicle("C1", 9.0, 0.0),))
    reason = "“street-1” is handed out in the benchmark streets@1 and stays as it is"
    with pytest.raises(Conflict, match=reason):
        change(streets[0], modification_to_document(other))
    assert reason in services.why_not_editable(streets[0])
    with pytest.raises(
        Conflict, match="can’t be deleted; it is needed by the benchmark streets@1"
    ):
        services.delete(streets[0])
    change(streets[1], modification_to_document(other))
    retire(row)
    change(streets[0], modification_to_document(other))
    with pytest.raises(Conflict, match="can’t be deleted"):
        services.delete(streets[0])


def test_intents_of_practice_tasks_are_handed_out_as_they_count(streets: list[Scenario]) -> None:
    row = make_benchmark(asked())
    found = benchmark_set(row)
    assert all(task.intent for task in found.tasks)
    with pytest.raises(Conflict, match="is handed out in the benchmark streets@1"):
        refuse_handed_out(row.items.filter(split="practice")[0].scenario.slug, [Split.PRACTICE])
    refuse_handed_out(row.items.filter(split="test")[0].scenario.slug, [Split.PRACTICE])
    bare = replace(found, tasks=tuple(replace(task, intent=None) for task in found.tasks))
    row.checksum = checksum(bare)  # as benchmarks had it before
    assert benchmark_set(row) == bare


@pytest.mark.parametrize("split", Split)
def test_rows_that_changed_nevertheless_do_not_fit(split: Split, streets: list[Scenario]) -> None:
    row = make_benchmark(asked())
    slug = row.items.filter(split=split).values_list("scenario__slug", flat=True)[0]
    chosen = Scenario.objects.filter(slug=slug)
    chosen.update(reference=modification_to_document(Modification()))
    if split is Split.TEST:
        assert benchmark_set(row), "a reference of the test is not handed out"
        BaseScene.objects.filter(scenarios__slug=slug).update(recording=None, source="elsewhere")
        assert benchmark_set(row), "nor is what a scene's row says beside it"
        chosen.update(instruction="Something else.")
    with pytest.raises(Conflict, match="Scenarios of the benchmark streets@1 have changed"):
        benchmark_set(row)


# Commands


def test_commands_make_one_and_write_its_folder(
    streets: list[Scenario], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    call_command(
        "make_benchmark", "streets", "--title", "S", "--scenarios", "street-1", "street-2"
    )
    row = find_benchmark("streets")
    assert f"streets@1: 2 tasks, 0 for practice. SHA-256 {row.checksum}" in capsys.readouterr().out
    out = tmp_path / "new" / "folder"
    call_command("export", "benchmark", "streets", "--out", str(out))
    assert "Warning: The licence of these sources is not known" in capsys.readouterr().err
    assert read_folder(out).name == "streets"
    with pytest.raises(CommandError, match="is there already; an export overwrites nothing"):
        call_command("export", "benchmark", "streets", "--out", str(out))
    with pytest.raises(CommandError, match="Unknown benchmark 'nothing'"):
        call_command("export", "benchmark", "nothing", "--out", str(tmp_path / "no"))
    assert sorted(path.name for path in out.parent.iterdir()) == ["folder"]
