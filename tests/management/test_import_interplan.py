import json
import zipfile
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import yaml
from django.core.management import call_command
from django.core.management.base import CommandError

from augment.baselines.rule_placer import place
from augment.checks.ground import Ground
from augment.checks.registry import check_against_intent
from augment.errors import CannotPlace
from augment.formats.interplan.file import InterplanSource
from augment.formats.interplan.writer import write
from augment.formats.writing import Cell
from augment.geometry.frames import wrap
from augment.models import Augmentation, BaseScene, GenerationJob, Scenario
from augment.prompts.vectors import scene_text
from augment.scene.codec import recording_from_document
from augment.scene.entities import (
    AgentType,
    InterplanRules,
    Modification,
    ScenarioType,
    Scene,
    TrafficAgent,
    apply,
)
from augment.scene.recording import Recording
from augment.services.scenarios.scenes import LoadedScenario, change_surroundings
from augment.simulation.drive import STEPS, find_expert
from augment.simulation.drive import run as drive_setting
from augment.simulation.planners import planner_named
from augment.simulation.road import Road
from augment.simulation.score import ScoreKind, score_drive
from augment.simulation.states import EgoBody
from augment.simulation.traffic import DriveSetting, Walkers
from tests.formats.interplan_files import ELSEWHERE, HERE, fifty_entries, write_folder
from tests.jobs import rows
from tests.simulation.places import assert_everybody_is_at_one_place

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
    base = BaseScene.objects.get(slug=f"interplan-{HERE}")
    assert base.source_item == HERE
    assert base.recording is not None
    nudge = Scenario.objects.get(slug=f"interplan-{HERE}-s0")
    assert nudge.type == "nudge_around_parked_vehicle"
    assert LoadedScenario(nudge).scene.agents == (), "interPlan clears the recorded traffic"
    reference = LoadedScenario(nudge).reference
    assert reference is not None
    (car,) = reference.added
    assert (car.x_m, car.y_m) == pytest.approx((17.5, -0.8), abs=1e-3)
    assert car.heading_rad == pytest.approx(0.05)
    assert car.lane_id == LoadedScenario(nudge).scene.ego.lane_id
    assert nudge.instruction == (
        "Have the ego nudge around what stands at the side of its lane: a parked vehicle "
        "17.5 m ahead of the ego along its lane, in the ego's lane, 0.8 m right of its centre, "
        "in the lane's direction."
    )
    assert nudge.instruction_is_generated
    zone = LoadedScenario(Scenario.objects.get(slug=f"interplan-{HERE}-s1")).reference
    assert zone is not None
    assert [one.type for one in zone.added] == [
        *[AgentType.TRAFFIC_CONE] * 3,
        AgentType.PEDESTRIAN,
    ]


@pytest.mark.slow
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
    lost = [line for line in said.getvalue().splitlines() if "Lost" in line]
    assert all("turned at random there, which may change the outcome" in line for line in lost)
    assert len({line.split(":")[0] for line in lost}) <= 10, "of those with cones alone"


@pytest.mark.slow
def test_what_was_imported_before_keeps_its_rules_and_its_export_says_so(folder: Path) -> None:
    run(folder)
    row = Scenario.objects.get(slug=f"interplan-{HERE}-s0")
    new = LoadedScenario(row).scene
    assert row.interplan is not None
    del row.interplan["built"]
    row.save()
    loaded = LoadedScenario(row)
    assert loaded.scene.options.interplan is None
    source = InterplanSource(token=HERE, **row.interplan)
    reference = loaded.reference
    assert reference is not None
    given = Cell(name="r", scene=loaded.scene, type=None, modification=reference, source=source)
    cell = replace(given, type=ScenarioType(row.type))
    texts = [loss.text for loss in write([cell]).losses]
    assert [text.partition(", ")[0] for text in texts] == [
        "lasts 30 s by interPlan's rules",
        f"{reference.added[0].id} has a box of 4.6 x 1.9 m",
    ]
    assert all("may change the outcome" in text for text in texts)
    assert write([replace(cell, scene=new)]).losses == ()
    BaseScene.objects.filter(pk=row.base_scene_id).update(content_hash="less of the map")
    assert run(folder)[-1].startswith("3 scenarios imported, 0 were there already")
    assert Scenario.objects.filter(slug=f"interplan-{HERE}-2-s0").exists()
    assert run(folder)[-1].startswith("0 scenarios imported, 3 were there already")


def test_other_traffic_takes_other_boxes(folder: Path) -> None:
    run(folder)
    row = Scenario.objects.get(slug=f"interplan-{HERE}-s0")
    assert "New agents of type VEHICLE are in their order" in scene_text(LoadedScenario(row).scene)
    assert "follows it at the speed limit" in scene_text(LoadedScenario(row).scene)
    change_surroundings(row, keep_traffic=False, density="high", goal="")
    assert LoadedScenario(row).scene.options.interplan == InterplanRules()
    assert "New agents of type VEHICLE" not in scene_text(LoadedScenario(row).scene)


class World(NamedTuple):
    """A scenario in the frame of interPlan's own numbers."""

    scene: Scene
    reference: Modification
    recording: Recording

    def objects(self) -> list[tuple[float, ...]]:
        """Kind, place, heading, box and speed of all that stands there, as interPlan lists it."""
        origin = self.scene.origin.pose
        listed = []
        for one in apply(self.scene, self.reference).agents:
            if one.walk_to_m is None and one.type is not AgentType.PEDESTRIAN:
                is_cone = one.type is AgentType.TRAFFIC_CONE
                place = origin.to_parent(np.array([[one.x_m, one.y_m]]))[0]
                # interPlan turns cones at random.
                heading_rad = 0.0 if is_cone else wrap(one.heading_rad + origin.heading_rad)
                listed.append((is_cone, *place, heading_rad, *one.size_m, one.speed_mps))
        return sorted(listed)

    def walk(self, ego: list[list[float]]) -> list[list[tuple[float, ...]]]:
        """Who walks where at each step, for an ego whose rear axle is at these poses."""
        origin, body = self.scene.origin.pose, EgoBody.of(self.scene.ego)
        poses = np.array(ego)
        poses[:, :2] = origin.to_local(poses[:, :2])
        poses[:, 2] -= origin.heading_rad
        boxes, road = body.boxes(poses), Road(self.scene, self.recording)
        people = [one for one in self.reference.added if one.type is AgentType.PEDESTRIAN]
        people = [one if one.walk_to_m else replace(one, walk_to_m=step_of(one)) for one in people]
        walkers = Walkers(people, road, boxes[0])
        seen: list[list[tuple[float, ...]]] = []
        for box in boxes:
            if seen:
                walkers.step(box, walkers.objects())
            seen.append(sorted(map(tuple, origin.to_parent(walkers.objects().boxes[:, :2]))))
        return seen


def step_of(worker: TrafficAgent) -> tuple[float, float]:
    return worker.x_m + np.cos(worker.heading_rad), worker.y_m + np.sin(worker.heading_rad)


@pytest.fixture
def worlds(realdata: Path) -> dict[str, World]:
    root = realdata / "nuplan_synthetic"
    run(root / "interPlan_modifications.yaml", "--nuplan", root)
    return {
        row.slug.removeprefix("interplan-"): World(
            LoadedScenario(row).scene,
            LoadedScenario(row).reference or Modification(),
            recording_from_document(row.base_scene.recording),
        )
        for row in Scenario.objects.select_related("base_scene")
    }


DRIVEN = {
    "71f182558ee95100-s8": (99.9, None),
    "6dd2064204c654b7-s0": (99.9, None),
    "81f400b414215325-s0": (0.0, 0.097),
    "6dd2064204c654b7-s1": (0.0, 0.101),
}
"""Score (%) and progress of PDM-Closed in nuPlan's own closed loop, by interPlan's score."""


@pytest.mark.realdata
@pytest.mark.slow
def test_scenarios_are_what_interplans_own_code_builds_and_score_as_in_nuplan(
    realdata: Path, worlds: dict[str, World]
) -> None:
    told = json.loads((realdata / "nuplan_synthetic" / "built_by_interplan.json").read_text())
    assert set(worlds) == set(told)
    for name, built in told.items():
        world, (*_, heading_rad, speed_mps, x_m, y_m) = worlds[name], built["ego"]
        origin = world.scene.origin
        here = origin.x_m, origin.y_m, origin.heading_rad, world.scene.ego.speed_mps
        assert here == pytest.approx((x_m, y_m, heading_rad, speed_mps), abs=1e-3), name
        there = sorted(
            (kind == "TRAFFIC_CONE", *place, 0.0 if kind == "TRAFFIC_CONE" else turn_rad, *rest)
            for kind, *place, turn_rad, length_m, width_m, mps, _ in built["objects"]
            for rest in [(length_m, width_m, mps)]
        )
        assert np.array(world.objects()) == pytest.approx(np.array(there), abs=2e-3), name
        steps = built["walk"]
        assert len(steps) == built["n"] == STEPS[True] + 1
        wanted = [sorted((x, y) for _, x, y, _ in people) for _, *people in steps]
        got = world.walk([ego for ego, *_ in steps])
        assert [len(people) for people in got] == [len(people) for people in wanted], name
        for mine, theirs in zip(got, wanted, strict=True):
            assert mine == [pytest.approx(place, abs=2e-3) for place in theirs], name
    for name, (score, progress) in DRIVEN.items():
        scene, reference, recording = worlds[name]
        setting = DriveSetting(scene=scene, modification=reference, recording=recording.ego_alone)
        road = Road(scene, recording)
        drive = drive_setting(setting, planner_named("pdm-closed", offsets="original"), road=road)
        scored = score_drive(
            drive,
            find_expert(setting, road),
            kind=ScoreKind.INTERPLAN,
            scenario_type=ScenarioType(told[name]["type"]),
            modification=reference,
        )
        assert 100.0 * scored.value == pytest.approx(score, abs=0.1), name
        ratio = next(one.value for one in scored.metrics if "expert_route" in one.name)
        assert ratio == pytest.approx(progress or 1.0, abs=0.01), name


@pytest.mark.slow
@pytest.mark.realdata
def test_everybody_is_where_interplans_drive_has_them(worlds: dict[str, World]) -> None:
    for world in worlds.values():
        for change in (world.reference, Modification()):
            setting = DriveSetting(
                scene=world.scene, modification=change, recording=world.recording.ego_alone
            )
            assert_everybody_is_at_one_place(setting)


@pytest.mark.slow
def test_the_derived_intents_are_met_by_their_references(tmp_path: Path) -> None:
    root = write_folder(tmp_path / "given")
    (given,) = root.rglob("interPlan_modifications.yaml")
    given.write_text(yaml.safe_dump(fifty_entries()))
    run(root)
    faults: dict[str, list[str]] = {}
    refused: dict[str, str] = {}
    for row in Scenario.objects.order_by("slug")[::5]:
        intent, reference = LoadedScenario(row).intent, LoadedScenario(row).reference
        assert intent is not None
        assert reference is not None
        assert row.intent_origin == "derived"
        found = check_against_intent(Ground.of(LoadedScenario(row).scene), reference, intent)
        asked = [str(one.kind) for one in found if one.is_fault and one.kind.startswith("asked")]
        faults |= {row.slug: asked} if asked else {}
        try:
            place(LoadedScenario(row).scene, intent)
        except CannotPlace as fault:
            refused[row.slug] = str(fault)
    assert faults == {}
    assert refused == {}
