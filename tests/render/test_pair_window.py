"""A pair's window holds what belongs to it and no more; a small difference is shown enlarged."""

import statistics
from dataclasses import replace
from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from augment.checks import Ground
from augment.render.bev import draw
from augment.render.camera import Camera
from augment.render.pair_window import AROUND_M, covered_boxes, film_states, pair_camera
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import Modification, without_traffic
from augment.scene.planned_motion import AtTime, PlannedMotion
from augment.services.scenarios.catalogue import read_catalogue
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


def test_what_lies_beyond_60_m_leaves_the_window_to_the_rest() -> None:
    assert pair_camera(STREET, (added(20.0), added(80.0))).x_max_m < 35.0


def test_whoever_moves_in_a_film_stays_in_the_frame() -> None:
    motion = PlannedMotion(speeds=((0.0, 12.0),), start=AtTime())
    moving = scenes.vehicle("New1", 30.0, 0.0, motion=motion)
    change = Modification(added=(moving,))
    camera = pair_camera(STREET, (change, added(20.0)), is_filmed=True)
    driven = STREET.motion_after(change)
    for movement in (driven.ego, *driven.others):
        if movement.agent.id in (moving.id, STREET.scene.ego.id):
            assert holds(camera, film_states(movement)[:, :2], AROUND_M)


def test_a_difference_of_few_pixels_has_an_inset_at_the_same_place_on_both_sides() -> None:
    sides = added(20.0), added(20.2)
    pairs = ((sides[0].added[0], sides[1].added[0], 0.2),)
    camera = pair_camera(STREET, sides, differing=pairs)
    assert 0.2 * camera.px_per_m < 12.0 < 4.0 * 0.2 * camera.inset.camera.px_per_m
    assert camera.key != pair_camera(STREET, sides).key
    pictures = [draw(STREET.scene, side, camera) for side in sides]
    assert len(set(pictures)) == 2
    scale, inset = covered_boxes(STREET.scene, camera)
    assert scale[2] < inset[0] or inset[2] < scale[0] or scale[3] < inset[1] or inset[3] < scale[1]
    far = ((sides[0].added[0], sides[1].added[0], 2.0),)
    assert pair_camera(STREET, sides, differing=far).inset is None


def test_distances_that_are_named_are_ticked_on_the_egos_lane_as_far_as_it_goes() -> None:
    sides, ends_m = (added(12.0), added(18.0)), find_end_m()
    camera = pair_camera(STREET, sides, ticks_m=(30.0, ends_m - 5.0, ends_m + 5.0))
    camera = replace(camera, x_max_m=ends_m + 15.0)
    plain = replace(camera, ticks_m=())
    for side in sides:
        ticked, bare = (draw(STREET.scene, side, one) for one in (camera, plain))
        changed = at_camera_size(ticked, camera) != at_camera_size(bare, plain)
        columns = np.flatnonzero(changed.any(axis=(0, 2)))
        # Metres ahead of the ego; a label is about 3 m wide.
        ahead_m = camera.x_min_m + columns / camera.px_per_m
        for at_m in (30.0, ends_m - 5.0):
            assert pixel_at(ticked, camera, at_m, 1.0) == pixel_at(ticked, camera, at_m, -1.0)
            assert max(pixel_at(ticked, camera, at_m, 1.0)) < 60
        near = np.minimum(abs(ahead_m - 30.0), abs(ahead_m - ends_m + 5.0))
        assert near.max() < 4.0


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
