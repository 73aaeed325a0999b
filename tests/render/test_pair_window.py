"""A pair's window holds what belongs to it and no more; a small difference is shown enlarged."""

import statistics
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.checks import Ground
from augment.metrics.displacement import find_shifts
from augment.render.bev import draw
from augment.render.camera import Camera
from augment.render.pair_window import AROUND_M, covered_boxes, film_states, pair_camera
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import AgentType, Modification, TrafficAgent, without_traffic
from augment.scene.intent import Intent, Relation, Spot, VehicleRequest
from augment.scene.intent_parts import Length
from augment.scene.planned_motion import AtTime, PlannedMotion
from augment.services.scenarios.catalogue import read_catalogue
from augment.services.scenarios.pair_pictures import list_distances
from tests import scenes
from tests.properties import examples
from tests.render.pictures import at_camera_size, pixel_at

FIXTURES = Path(__file__).parents[2] / "fixtures"
STREET = Ground.of(scenes.scene())


def added(x_m: float, y_m: float = 0.0) -> Modification:
    return Modification(added=(scenes.vehicle("New1", x_m, y_m),))


def holds(camera: Camera, points_m: np.ndarray, margin_m: float = 0.0) -> bool:
    low, high = points_m.min(axis=0) - margin_m, points_m.max(axis=0) + margin_m
    is_in = (low >= [camera.x_min_m, camera.y_min_m]) & (high <= [camera.x_max_m, camera.y_max_m])
    return bool(is_in.all())


@given(x_m=st.floats(-55.0, 55.0), y_m=st.floats(-20.0, 20.0), other_m=st.floats(-55.0, 55.0))
@examples(30)
def test_ego_and_both_changes_have_10_m_around(x_m: float, y_m: float, other_m: float) -> None:
    sides = added(x_m, y_m), added(other_m)
    camera = pair_camera(STREET, sides)
    boxes = [side.added[0].box.corners_m for side in sides]
    boxes.append(STREET.scene.ego.box.corners_m)
    assert all(holds(camera, box, AROUND_M) for box in boxes)
    low, high = np.vstack(boxes).min(axis=0), np.vstack(boxes).max(axis=0)
    size = np.array([camera.x_max_m - camera.x_min_m, camera.y_max_m - camera.y_min_m])
    assert (size < high - low + 2.0 * AROUND_M + 2.0).all()
    assert camera == pair_camera(STREET, sides[::-1])


def test_what_lies_beyond_60_m_is_left_out_unless_it_is_gone() -> None:
    sides = added(20.0), added(80.0)
    camera = pair_camera(STREET, sides)
    assert camera.x_max_m < 35.0
    assert len(covered_boxes(STREET.scene, camera, sides)) == 2  # the scale and an arrow
    walker = replace(scenes.pedestrian("New1", 50.0, 2.0), walk_to_m=(90.0, 2.0))
    camera = pair_camera(STREET, (Modification(added=(walker,)), Modification()))
    assert 60.0 <= camera.x_max_m < 70.0
    far = scenes.vehicle("Agent9", 80.0, 0.0)
    street = Ground.of(replace(STREET.scene, agents=(far,)))
    camera = pair_camera(street, (Modification(removed=("Agent9",)), Modification()))
    assert holds(camera, far.box.corners_m, AROUND_M)


def test_whoever_moves_in_a_film_stays_in_the_frame() -> None:
    motion = PlannedMotion(speeds=((0.0, 12.0),), start=AtTime())
    moving = scenes.vehicle("New1", 30.0, 0.0, motion=motion)
    change = Modification(added=(moving,))
    camera = pair_camera(STREET, (change, added(20.0)), is_filmed=True)
    driven = STREET.motion_after(change)
    for movement in (driven.ego, *driven.others):
        if movement.agent.id in (moving.id, STREET.scene.ego.id):
            assert holds(camera, film_states(movement)[:, :2], AROUND_M)


BUS = replace(scenes.vehicle("New1", 20.0, 0.0), type=AgentType.BUS, length_m=12.0)
WALK = scenes.pedestrian("New1", 10.0, 6.0)


@pytest.mark.parametrize(
    ("one", "change", "place_m"),
    [
        (scenes.vehicle("New1", 20.0, 0.0), {"x_m": 20.2}, (20.1, 0.0)),
        (scenes.vehicle("New1", 20.0, 0.0), {"speed_mps": 0.3}, (22.6, 0.0)),
        (BUS, {"heading_rad": 0.02}, (26.0, 0.0)),  # too long to be enlarged as a whole
        (scenes.vehicle("New1", 80.0, 0.0), {"y_m": 3.0}, (80.0, 1.5)),  # alike by their arrows
        (replace(WALK, walk_to_m=(10.0, -6.0)), {"walk_to_m": (10.2, -6.0)}, (10.1, -6.0)),
    ],
)
def test_what_differs_little_has_an_inset(one: TrafficAgent, change: Any, place_m: Any) -> None:
    sides = Modification(added=(one,)), Modification(added=(replace(one, **change),))
    (shift,) = find_shifts(*sides) or ()
    camera = pair_camera(STREET, sides, differing=((shift.one, shift.other, shift.metres),))
    assert holds(camera.inset.camera, np.array([place_m]))
    assert shift.metres * camera.inset.camera.px_per_m >= 4.0
    assert camera.key != pair_camera(STREET, sides).key
    pictures = [draw(STREET.scene, side, camera) for side in sides]
    assert len(set(pictures)) == 2
    scale, inset = covered_boxes(STREET.scene, camera, sides)[:2]
    assert scale[2] < inset[0] or inset[2] < scale[0] or scale[3] < inset[1] or inset[3] < scale[1]
    far = ((added(20.0).added[0], added(22.0).added[0], 2.0),)
    assert pair_camera(STREET, (added(20.0), added(22.0)), differing=far).inset is None


def test_of_objects_that_differ_alike_the_same_is_enlarged_whichever_comes_first() -> None:
    cars = [[scenes.vehicle(f"New{x_m}", x_m, y_m) for x_m in (15, 50)] for y_m in (0.0, 0.2)]
    near, far = zip(*cars, (0.2, 0.2), strict=True)
    first = pair_camera(STREET, (added(15.0), added(50.0)), differing=(near, far))
    assert first == pair_camera(STREET, (added(15.0), added(50.0)), differing=(far, near))


def test_distances_that_are_named_are_ticked_on_the_egos_lane_as_far_as_it_goes() -> None:
    sides, ends_m = (added(12.0), added(18.0)), find_end_m()
    camera = pair_camera(STREET, sides, ticks_m=(30.0, ends_m + 5.0))
    assert camera.x_max_m == 40.0
    plain = replace(camera, ticks_m=())
    for side in sides:
        ticked, bare = (draw(STREET.scene, side, one) for one in (camera, plain))
        changed = at_camera_size(ticked, camera) != at_camera_size(bare, plain)
        columns = np.flatnonzero(changed.any(axis=(0, 2)))
        assert all(max(pixel_at(ticked, camera, 30.0, y_m)) < 60 for y_m in (-1.0, 1.0))
        # Metres ahead of the ego; a label is about 3 m wide.
        assert np.abs(camera.x_min_m + columns / camera.px_per_m - 30.0).max() < 4.0


def test_what_is_ticked_is_what_the_sentence_says() -> None:
    about = Length(low_m=21.5, high_m=21.5, is_approximate=True)
    spots = [Spot(distance=about, relation=side) for side in Relation]
    spots.append(Spot(distance=Length(low_m=5.0, high_m=9.0), relation=Relation.AHEAD, anchor="a"))
    requests = tuple(VehicleRequest(spot=spot) for spot in spots)
    assert list_distances(Intent(requests=requests)) == (-21.5, 21.5)


def find_end_m() -> float:
    """How far ahead of the ego its lane ends."""
    route = EgoRoute.of(STREET.scene)
    return route.line.length_m - route.ego_s_m


def test_over_the_catalogue_pictures_are_large_enough() -> None:
    base, entries = read_catalogue(FIXTURES)
    scales = []
    for entry in entries:
        whole = base[entry.scene]
        scene = whole if entry.keep_traffic else without_traffic(whole)
        if entry.reference is not None and not entry.reference.has_motion:
            sides = entry.reference, entry.reference
            scales.append(pair_camera(Ground.of(scene), sides, intent=entry.intent).px_per_m)
    assert statistics.median(scales) >= 10.0
    assert statistics.quantiles(scales, n=20)[0] >= 6.0
