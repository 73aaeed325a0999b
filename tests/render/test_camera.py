"""The window depends on the scenario alone, grows in steps and keeps 3:2."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from augment.render.camera import Camera, camera_for
from augment.scene.modification import Modification
from tests import scenes


def window(camera: Camera) -> tuple[float, float, float, float]:
    return camera.x_min_m, camera.x_max_m, camera.y_min_m, camera.y_max_m


def test_the_usual_window_is_sixty_by_forty_metres() -> None:
    camera = camera_for(scenes.scene(), None)
    assert window(camera) == (-15.0, 45.0, -20.0, 20.0)
    assert (camera.width_px, camera.height_px, camera.px_per_m) == (1200, 800, 20.0)


def test_left_is_up_and_ahead_is_right() -> None:
    camera = camera_for(scenes.scene(), None)
    pixels = camera.to_pixels(np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 5.0]]))
    assert pixels.tolist() == [[300.0, 400.0], [500.0, 400.0], [300.0, 300.0]]


def test_a_reference_that_fits_changes_nothing() -> None:
    reference = Modification(added=(scenes.vehicle("New1", 39.0, -15.0),))
    assert camera_for(scenes.scene(), reference) == camera_for(scenes.scene(), None)


@pytest.mark.parametrize(
    ("x_m", "y_m", "expected"),
    [
        (40.0, 0.0, (-15.0, 60.0, -25.0, 25.0)),  # 40 + 2.4 + 3 is just beyond 45
        (60.0, 0.0, (-15.0, 75.0, -30.0, 30.0)),
        (0.0, 18.0, (-15.0, 60.0, -25.0, 25.0)),
        (-20.0, 0.0, (-30.0, 45.0, -25.0, 25.0)),
        (30.0, 30.0, (-15.0, 75.0, -25.0, 35.0)),
    ],
)
def test_the_window_grows_in_steps_and_keeps_its_shape(
    x_m: float, y_m: float, expected: tuple[float, float, float, float]
) -> None:
    reference = Modification(added=(scenes.vehicle("New1", x_m, y_m),))
    camera = camera_for(scenes.scene(), reference)
    assert window(camera) == expected
    assert (camera.width_px, camera.height_px) == (1200, 800)


def test_the_end_of_a_walk_belongs_into_the_picture() -> None:
    walker = scenes.pedestrian("New1", 20.0, -5.0, (20.0, 22.0))
    camera = camera_for(scenes.scene(), Modification(added=(walker,)))
    assert camera.y_max_m >= 25.0


def test_the_old_place_of_what_the_reference_moves_belongs_into_the_picture() -> None:
    far = scenes.vehicle("Agent2", 60.0, 0.0)
    reference = Modification(moved=(replace(far, x_m=20.0),))
    assert camera_for(scenes.scene(agents=(far,)), reference).x_max_m == 75.0


def test_a_reference_out_of_all_reach_does_not_shrink_the_rest() -> None:
    reference = Modification(
        added=(scenes.vehicle("New1", 5000.0, 0.0), scenes.vehicle("New2", 60.0, 0.0))
    )
    assert window(camera_for(scenes.scene(), reference)) == (-15.0, 75.0, -30.0, 30.0)
