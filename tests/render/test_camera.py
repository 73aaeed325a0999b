"""The window depends on the scenario alone, holds its reference and is mostly road."""

from hypothesis import given
from hypothesis import strategies as st

from augment.geometry.frames import corners
from augment.render.camera import MARGIN_M, camera_for
from augment.scene.entities import Modification
from tests import scenes
from tests.properties import examples


def test_without_a_reference_the_window_looks_far_ahead() -> None:
    camera = camera_for(scenes.scene(), None)
    assert camera.x_max_m - camera.x_min_m == 72.0
    assert camera.x_max_m >= 40.0
    assert camera.x_min_m <= -5.0


@given(x_m=st.floats(-60.0, 120.0), y_m=st.floats(-60.0, 60.0), heading_rad=st.floats(-3.2, 3.2))
@examples(30)
def test_ego_and_reference_are_inside_with_room_around_them(
    x_m: float, y_m: float, heading_rad: float
) -> None:
    car = scenes.vehicle("New1", x_m, y_m, heading_rad)
    camera = camera_for(scenes.scene(), Modification(added=(car,)))
    box = corners(car.pose, car.length_m, car.width_m)
    assert (box.min(axis=0) - MARGIN_M >= [camera.x_min_m, camera.y_min_m]).all()
    assert (box.max(axis=0) + MARGIN_M <= [camera.x_max_m, camera.y_max_m]).all()
    assert camera.x_min_m <= -5.0
    assert camera.x_max_m >= 15.0
    assert (camera.width_px, camera.height_px) == (1200, 300)


def test_a_reference_out_of_all_reach_does_not_shrink_the_rest() -> None:
    far, near = scenes.vehicle("New1", 5000.0, 0.0), scenes.vehicle("New2", 60.0, 0.0)
    both = camera_for(scenes.scene(), Modification(added=(far, near)))
    assert both == camera_for(scenes.scene(), Modification(added=(near,)))


def test_the_window_holds_where_walks_end() -> None:
    walker = scenes.pedestrian("New1", 10.0, 0.0, (10.0, 40.0))
    assert camera_for(scenes.scene(), Modification(added=(walker,))).y_max_m >= 40.0 + MARGIN_M


def test_the_window_lies_where_the_road_is() -> None:
    # The lane and its walkway lie to the right of y = 1.75.
    reference = Modification(added=(scenes.vehicle("New1", 20.0, 0.0),))
    camera = camera_for(scenes.scene(), reference)
    assert camera.y_max_m - camera.y_min_m == 18.0
    assert -camera.y_min_m > 0.4 * (camera.y_max_m - camera.y_min_m)


def test_the_window_holds_what_contestants_changed_within_60_m_and_no_more() -> None:
    street, reference = scenes.scene(), Modification(added=(scenes.vehicle("New1", 20.0, 0.0),))
    behind = Modification(added=(scenes.vehicle("New1", -50.0, 20.0),))
    lost = Modification(added=(scenes.vehicle("New1", -80.0, 0.0),))
    camera = camera_for(street, reference, (behind, lost))
    assert camera == camera_for(street, reference, (behind,))
    assert camera.x_min_m <= -57.0
    assert camera.y_max_m >= 26.0
    assert camera.x_max_m >= 27.0
