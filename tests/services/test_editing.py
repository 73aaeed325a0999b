"""Changing a scene by hand: lanes, snapping, what is refused; corrections on their whole way."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from django.contrib.auth.models import User
from django.core.files.storage import default_storage
from django.db import connection
from django.test.utils import CaptureQueriesContext

from arena.scenarios import services as guarded
from augment.errors import Conflict, InvalidDocument, InvalidModification
from augment.models import Augmentation, Contestant, Event, Scenario
from augment.render.bev import draw
from augment.render.camera import AROUND_THE_EGO
from augment.scene.codec import intent_to_document, modification_to_document
from augment.scene.entities import Modification, Scene, TrafficAgent
from augment.scene.intent import Intent
from augment.scene.planned_motion import LanePath, PlannedMotion
from augment.services.judging.displacement import of_rows
from augment.services.judging.findings import check_augmentation, check_edit
from augment.services.running import follow_ups, runner
from augment.services.scenarios.editing import editor_document
from augment.services.scenarios.pictures import (
    SceneView,
    draw_scenario,
    is_drawn,
    reference_picture,
    scene_picture,
)
from augment.services.scenarios.scenes import LoadedScenario, ScenarioContent
from tests.jobs.rows import add_scenario, launch
from tests.render.pictures import at_camera_size
from tests.scenes import EGO, curve, pedestrian, scene, vehicle

pytestmark = pytest.mark.django_db
CAR = vehicle("Added1", 20.0, 0.4, 0.1)
PARKED = vehicle("Added1", 30.0, -3.0)


def document(*added: TrafficAgent, **parts: tuple[object, ...]) -> dict[str, object]:
    return modification_to_document(Modification(added=added, **parts))  # type: ignore[arg-type]


def set_reference(
    here: Scenario, given: object, actor: User | None = None, **more: Any
) -> Scenario:
    names = ("instruction", "type", "keep_traffic", "goal")
    same = {name: getattr(here, name) for name in names} | {"density": here.traffic_density}
    return guarded.change_scenario(
        here, ScenarioContent(**same | more, reference=given), actor=actor
    )


def test_what_is_placed_lies_in_the_picture_where_the_page_says() -> None:
    """The page's transform (metres to pixels) finds the box that the renderer drew, to a pixel."""
    here = add_scenario("street", reference=None)
    camera = editor_document(here)["camera"]
    placed = replace(vehicle("Added1", 30.0, -10.0), length_m=10.0, width_m=4.0)
    drawn = at_camera_size(
        draw(scene(), Modification(added=(placed,)), AROUND_THE_EGO), AROUND_THE_EGO
    )
    empty = at_camera_size(draw(scene(), Modification(), AROUND_THE_EGO), AROUND_THE_EGO)
    assert drawn.shape[:2] == (camera["height_px"], camera["width_px"])
    rows, columns = np.nonzero((drawn != empty).any(axis=2))
    left = (25.0 - camera["x_min_m"]) * camera["px_per_m"]
    top = (camera["y_max_m"] - -8.0) * camera["px_per_m"]
    found = (columns.min(), columns.max() + 1, rows.min(), rows.max() + 1)
    assert found == pytest.approx((left, left + 100.0, top, top + 40.0), abs=2.0)


@pytest.mark.parametrize(
    ("here", "pose"),
    [
        (scene(), (20.0, 0.0, 0.0)),
        # 10 m round a circle with a radius of 40 m: 0.25 rad, in steps of one degree.
        (curve(), (19.9, 1.24, 0.25)),
        (scene(lanes=(), ego=replace(EGO, lane_id=None)), (20.0, 0.0, 0.0)),
    ],
)
def test_what_is_added_ahead_is_on_its_lane(here: Scene, pose: tuple[float, float, float]) -> None:
    shown = editor_document(add_scenario("road", scene=here, reference=None))
    assert shown["ahead"] == pytest.approx(pose, abs=0.02)


def test_an_agent_is_put_on_the_centreline() -> None:
    here = add_scenario("street", reference=None)
    for agent, x_m, y_m, heading_rad in (
        (CAR, 20.0, 0.0, 0.0),
        (vehicle("Added1", 20.0, 0.4, 3.0), 20.0, 0.0, math.pi),  # against its lane
        (vehicle("Added1", 20.0, 3.0, 3.0), 20.0, 3.5, math.pi),  # along the other one
        (vehicle("Added1", 20.0, 12.0, 0.2), 20.0, 3.5, 0.0),  # beside the road
        (vehicle("Added1", 20.0, 30.0, 0.2), 20.0, 30.0, 0.2),  # too far from every lane
        (pedestrian("Added1", 20.0, -1.0, (20.0, 6.0)), 20.0, 0.0, math.pi / 2),  # walks across
        (pedestrian("Added1", 20.0, -1.0, (26.0, 6.0)), 20.0, 0.0, math.pi / 4),
        (pedestrian("Added1", 20.0, -1.0, (20.0, 0.0)), 20.0, 0.0, math.pi / 2),  # is there
    ):
        found = check_edit(here, document(agent), snapped="Added1").modification
        [snapped] = found["add"]
        assert (snapped["x_m"], snapped["y_m"]) == pytest.approx((x_m, y_m))
        turn = math.remainder(snapped["heading_rad"] - heading_rad, 2.0 * math.pi)
        assert turn == pytest.approx(0.0, abs=1e-6)


def test_an_agent_is_given_a_motion_by_name_and_loses_it_again() -> None:
    here = add_scenario("street", reference=None)
    change: Any = document(PARKED)
    wish = {"agent_id": "Added1", "preset": "pull_out", "within_m": 12.0, "number": 6.0}
    found = check_edit(here, change, preset=wish)
    assert found.presets == {"Added1": {"preset": "pull_out", "within_m": 12.0, "number": 6.0}}
    (agent,) = found.modification["add"]
    assert agent["motion"]["path"]["lane_ids"] == ["Lane1"]
    # 12 m away: 30 - sqrt(144 - 9) = 18.4 m at 8 m/s, so it stands at 2 s and is off at 3 s.
    way = found.ways["Added1"]
    assert way[2] == [30.0, -3.0]
    assert way[3][0] > 30.0
    kept = check_edit(here, found.modification)
    assert kept.modification == found.modification
    off = check_edit(here, found.modification, preset={"agent_id": "Added1"})
    assert off.modification == document(PARKED)


def test_a_door_comes_as_an_object_of_its_own_and_once() -> None:
    here = add_scenario("street", reference=None)
    wish = {"agent_id": "Added1", "preset": "door_opening"}
    once = check_edit(here, document(PARKED), preset=wish)
    again = check_edit(here, once.modification, preset=wish | {"within_m": 9.0})
    assert [one["id"] for one in again.modification["add"]] == ["Added1", "Added1-door"]
    assert again.presets["Added1-door"]["within_m"] == 9.0


def test_a_motion_that_can_t_be_is_refused_in_words() -> None:
    here = add_scenario("street", reference=None)
    for wish, problem in (
        ({"agent_id": "Added1", "preset": "cut_in"}, "Cut-in: it has to drive."),
        ({"agent_id": "Added1", "preset": "leap"}, "Input should be 'cut_in'"),
        ({"agent_id": "Added7", "preset": "cut_in"}, "Unknown agent 'Added7'. Known: Added1."),
        ({"agent_id": "Added1", "preset": "cut_in", "number": 0.0}, "greater than 0"),
    ):
        found = check_edit(here, document(PARKED), preset=wish)
        assert problem in found.problem
        assert found.modification is None


def test_a_drawn_reference_is_kept_drawn_and_told() -> None:
    ada = User.objects.create_user("ada")
    here = add_scenario("street", reference=None)
    set_reference(here, document(CAR), actor=ada)
    here.refresh_from_db()
    kept = LoadedScenario(here).reference
    assert kept.added == (replace(CAR, lane_id="Lane1"),)
    event = Event.objects.get()
    assert (event.actor, event.verb, event.before["reference"]) == (ada, "change", None)
    draw_scenario(here.pk)
    here.refresh_from_db()
    assert is_drawn(reference_picture(here))
    assert is_drawn(here.original_image)
    assert is_drawn(scene_picture(here.base_scene, SceneView.BACKDROP))


def test_a_reference_that_can_not_be_is_refused_and_the_old_one_stays() -> None:
    here = add_scenario("street")
    before = here.reference
    motion = PlannedMotion(path=LanePath(lane_ids=("Lane77",)))
    with pytest.raises(InvalidModification, match="Added1: Lane77 is no lane of the scene"):
        set_reference(here, document(replace(CAR, motion=motion)))
    with pytest.raises(InvalidModification, match="Agent7"):
        set_reference(here, document(moved=(vehicle("Agent7", 1.0, 1.0),)))
    with pytest.raises(InvalidDocument, match="modification"):
        set_reference(here, {"add": 3})
    here.refresh_from_db()
    assert here.reference == before
    Scenario.objects.filter(pk=here.pk).update(
        intent=intent_to_document(Intent(unmet="there is no bridge"))
    )
    set_reference(here, document())
    here.refresh_from_db()
    assert here.reference == document()
    Scenario.objects.filter(pk=here.pk).update(catalogue_set="paper")
    with pytest.raises(Conflict, match="catalogue's own"):
        set_reference(here, document(CAR))


def test_what_is_drawn_says_what_is_asked_for() -> None:
    here = add_scenario("street", reference=None)
    made = set_reference(here, document(CAR), instruction="", derives=True)
    assert "a parked vehicle 20.0 m ahead of the ego" in made.instruction
    assert (made.instruction_is_generated, made.intent_origin) == (True, "derived")
    assert made.intent["requests"][0]["spot"]["distance"] == {"low_m": 20.0}
    bare = set_reference(made, document(), derives=True)
    assert (bare.reference, bare.intent) == (None, None)


def original() -> Augmentation:
    row = launch().augmentations.get()
    runner.AUGMENTATIONS.perform(row.pk)
    row.refresh_from_db()
    return row


def test_a_correction_goes_the_whole_way_and_leaves_the_original() -> None:
    ada, first = User.objects.create_user("ada"), original()
    before = Augmentation.objects.filter(pk=first.pk).values().get()
    walker = pedestrian("Added1", 24.0, -3.0, (24.0, 3.0))
    start = follow_ups.starting_document(first)
    wanted = {**start, "add": [start["add"][0], document(walker)["add"][0]]}  # type: ignore[index]
    made = follow_ups.keep_correction(first, wanted, notes="the second cone is wrong", actor=ada)
    assert made.state == Augmentation.State.QUEUED
    assert runner.AUGMENTATIONS.perform(made.pk, worker="here")
    made.refresh_from_db()
    made = Augmentation.objects.select_related(
        "scenario__base_scene", "contestant", "corrects", "job"
    ).get(pk=made.pk)
    assert (made.state, made.contestant.kind) == ("done", Contestant.Kind.HUMAN)
    assert (made.corrects, made.made_by, made.job.launched_by) == (first, ada, ada)
    assert made.job.state == "finished"
    assert default_storage.exists(made.image)
    assert made.image != first.image
    checked, measured = check_augmentation(made), of_rows([made.pk])[0]
    assert checked.findings
    assert len(measured.displacement.matches) == 1
    assert Augmentation.objects.filter(pk=first.pk).values().get() == before
    event = Event.objects.get(verb="correct")
    assert (event.actor, event.object_code) == (ada, str(first.code))
    assert event.after["contestant"] == "by-hand"


def test_a_scenario_is_held_before_somebody_looks_who_shows_it() -> None:
    """Else a study could open between the look and the change."""
    here = add_scenario("street", reference=None)
    with CaptureQueriesContext(connection) as seen:
        set_reference(here, document(CAR))
    asked = [one["sql"] for one in seen if one["sql"].startswith("SELECT")]
    assert "augment_scenario" in asked[0]
    assert any("arena_study" in sql for sql in asked[1:])
