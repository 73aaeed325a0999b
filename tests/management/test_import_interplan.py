import zipfile
from io import StringIO
from pathlib import Path

import pytest
import yaml
from django.core.management import call_command
from django.core.management.base import CommandError

from augment.baselines.rule_placer import place
from augment.checks.ground import Ground
from augment.checks.registry import check_against_intent
from augment.errors import CannotPlace
from augment.models import Augmentation, BaseScene, GenerationJob, Scenario
from augment.scene.entities import AgentType
from augment.services.scenarios.scenes import intent_of, reference_of, scene_of
from tests.formats.interplan_files import ELSEWHERE, HERE, fifty_entries, write_folder
from tests.jobs import rows

pytestmark = pytest.mark.django_db


def run(*arguments: object) -> list[str]:
    out = StringIO()
    call_command("import_interplan", *(str(one) for one in arguments), stdout=out)
    return out.getvalue().splitlines()


def refused(*arguments: object) -> str:
    with pytest.raises(CommandError) as caught:
        run(*arguments)
    return str(caught.value)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_folder(tmp_path)


def test_one_command_makes_scenarios_with_their_human_references(folder: Path) -> None:
    lines = run(folder)
    assert lines[0] == "Log 1 of 1, made.db: 1 base tokens"
    assert (
        f"{HERE}-s2: interplan-{HERE}-s2; left out: pedestrian 0 starts at iteration 12" in lines
    )
    assert any(
        line.startswith(f"{HERE}-s3: skipped.") and "5000 m from the ego" in line for line in lines
    )
    assert f"{ELSEWHERE}-s0: skipped. none of the logs has a frame of its base token" in lines
    assert lines[-1] == "3 scenarios imported, 0 were there already, 2 skipped."
    nudge = Scenario.objects.get(slug=f"interplan-{HERE}-s0")
    assert nudge.type == "nudge_around_parked_vehicle"
    assert scene_of(nudge).agents == (), "interPlan clears the recorded traffic"
    reference = reference_of(nudge)
    assert reference is not None
    (car,) = reference.added
    assert (car.x_m, car.y_m) == pytest.approx((17.5, -0.8), abs=1e-3)
    assert car.heading_rad == pytest.approx(0.05)
    assert car.lane_id == scene_of(nudge).ego.lane_id
    assert nudge.instruction == (
        "Have the ego nudge around what stands at the side of its lane: a parked vehicle "
        "17.5 m ahead of the ego along its lane, in the ego's lane, 0.8 m right of its centre, "
        "in the lane's direction."
    )
    assert nudge.instruction_is_generated
    zone = reference_of(Scenario.objects.get(slug=f"interplan-{HERE}-s1"))
    assert zone is not None
    assert [one.type for one in zone.added] == [
        *[AgentType.TRAFFIC_CONE] * 3,
        AgentType.PEDESTRIAN,
    ]


def test_what_is_not_used_stands_in_the_lines_and_the_token_with_the_scene(folder: Path) -> None:
    lines = run(folder)
    row = BaseScene.objects.get(slug=f"interplan-{HERE}")
    assert row.source_item == HERE
    assert row.recording is not None
    assert any(f"{HERE}-s2" in line and "starts at iteration 12" in line for line in lines)


def test_an_unchanged_reference_goes_out_as_it_came_in(tmp_path: Path) -> None:
    root = write_folder(tmp_path / "given")
    (given,) = root.rglob("interPlan_modifications.yaml")
    wanted = fifty_entries()
    given.write_text(yaml.safe_dump(wanted))
    assert run(root)[-1] == "50 scenarios imported, 0 were there already, 0 skipped."
    job = GenerationJob.objects.create(name="Round 1")
    reference = rows.add_kind("reference")
    Augmentation.objects.bulk_create(
        Augmentation(
            job=job,
            scenario=scenario,
            contestant=reference,
            state="done",
            modification=scenario.reference,
            image="x.png",
        )
        for scenario in Scenario.objects.all()
    )
    file, said = tmp_path / "out.zip", StringIO()
    arguments = ("scenarios", "Round 1", "--format", "interplan", "--out", file)
    call_command("export", *map(str, arguments), stdout=StringIO(), stderr=said)
    with zipfile.ZipFile(file) as archive:
        assert yaml.safe_load(archive.read("interplan.yaml")) == wanted
        chosen = yaml.safe_load(archive.read("scenario_filter/arena-reference.yaml"))
    assert sorted(chosen["scenario_tokens"]) == sorted(
        f"{token}-s{index}"
        for token, one in wanted["modification_details_dictionary"].items()
        for index in one["special_scenario"]
    )
    assert "Lost" not in said.getvalue()


def test_the_derived_intents_are_met_by_their_references(tmp_path: Path) -> None:
    root = write_folder(tmp_path / "given")
    (given,) = root.rglob("interPlan_modifications.yaml")
    given.write_text(yaml.safe_dump(fifty_entries()))
    run(root)
    faults: dict[str, list[str]] = {}
    refused: dict[str, str] = {}
    for row in Scenario.objects.order_by("slug")[::5]:
        intent, reference = intent_of(row), reference_of(row)
        assert intent is not None
        assert reference is not None
        assert row.intent_origin == "derived"
        found = check_against_intent(Ground.of(scene_of(row)), reference, intent)
        asked = [str(one.kind) for one in found if one.is_fault and one.kind.startswith("asked")]
        faults |= {row.slug: asked} if asked else {}
        try:
            place(scene_of(row), intent)
        except CannotPlace as fault:
            refused[row.slug] = str(fault)
    assert faults == {}
    assert refused == {}
