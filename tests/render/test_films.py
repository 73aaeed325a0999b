"""What moves: in stills as trails, in films as data that tell nothing of who made them."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from PIL import ImageColor

from augment.geometry.frames import wrap
from augment.render import palette
from augment.render.bev import draw
from augment.render.camera import PASSED_WIDTH_M, camera_for
from augment.render.film import STEPS, make_film
from augment.scene.entities import Modification, Scene, TrafficAgent
from augment.scene.motion import ego_spots, find_motion, find_trails
from augment.scene.planned_motion import AtTime, NearEgo, PlannedMotion, PointPath
from tests.moving import cutting_in
from tests.render.pictures import opened
from tests.scenes import cone, pedestrian, scene, vehicle

STREET = scene(agents=(vehicle("Agent2", 20.0, -3.0), pedestrian("Agent3", 25.0, 5.0)))


def film(change: Modification, base: Scene = STREET) -> dict[str, object]:
    document: dict[str, object] = json.loads(make_film(base, change, camera_for(base, change)))
    return document


def pixels_of(png: bytes) -> np.ndarray:
    """The colours of a picture, (N, 3)."""
    return np.unique(np.asarray(opened(png).convert("RGB")).reshape(-1, 3), axis=0)


def braking(start: AtTime | NearEgo) -> TrafficAgent:
    """A car that drives 10 m/s and stands 2 s after its start: 10 m later."""
    motion = PlannedMotion(speeds=((2.0, 0.0),), start=start)
    return vehicle("New1", 20.0, 0.0, speed_mps=10.0, lane_id="Lane1", motion=motion)


def test_a_trail_has_a_spot_each_second() -> None:
    for start, places_m in (
        (AtTime(), [27.5, 30.0]),  # 20 + 10 t - 2.5 t^2
        (AtTime(after_s=1.0), [30.0, 37.5, 40.0]),  # where it sets out, and on
        (AtTime(after_s=6.0), [80.0, 87.5, 90.0]),
        (AtTime(after_s=6.1), []),
        (NearEgo(within_m=5.0), []),
    ):
        (trail,) = find_trails(STREET, Modification(added=(braking(start),)))
        assert trail.sets_out == bool(places_m)
        assert [spot.x_m for spot in trail.spots] == pytest.approx(places_m)
        # Of one that does not set out, the way that it would take is told from where it is.
        assert trail.way_m[-1, 0] == pytest.approx(places_m[-1] if places_m else 30.0)


def test_who_has_no_motion_leaves_no_trail_and_the_ego_is_followed_for_six_seconds() -> None:
    assert find_trails(STREET, Modification(added=(cone("New1", 9.0, 0.0),))) == ()
    assert [spot.x_m for spot in ego_spots(STREET)] == pytest.approx(
        [8.0 * n for n in range(1, 7)]
    )


def test_the_window_holds_the_way_near_the_ego_and_has_films() -> None:
    change = Modification(added=(cutting_in(0.5),))
    camera = camera_for(STREET, None, (change,))
    for spot in (*ego_spots(STREET), *find_trails(STREET, change)[0].spots):
        if np.hypot(*spot.box.corners_m.T).max() <= 60.0:
            assert camera.x_min_m <= spot.x_m <= camera.x_max_m
            assert camera.y_min_m <= spot.y_m <= camera.y_max_m
    standing = replace(camera, is_filmed=False)
    assert camera.key == f"{standing.key}-film"


@pytest.mark.slow
def test_a_picture_shows_a_trail_and_one_without_has_the_palette_that_it_had() -> None:
    moving = Modification(added=(cutting_in(0.5),))
    camera = camera_for(STREET, moving)
    colours = {
        change: {tuple(one) for one in pixels_of(draw(STREET, change, camera)).tolist()}
        for change in (moving, Modification())
    }
    assert set(palette.TRAIL) <= colours[moving]
    assert not set(palette.TRAIL) & colours[Modification()]
    png = draw(STREET, Modification(), camera)
    entry = png.index(b"PLTE")
    assert int.from_bytes(png[entry - 4 : entry]) == 3 * palette.inks()[palette.TRAIL[0]]


def test_in_filmed_pictures_who_holds_a_velocity_looks_as_if_a_motion_said_so() -> None:
    bus = vehicle("New1", 20.0, 0.0, speed_mps=6.0, lane_id="Lane1")
    said = replace(bus, motion=PlannedMotion())
    changes = [Modification(added=(one,)) for one in (bus, said)]
    camera = camera_for(STREET, changes[1])
    first, second = (opened(draw(STREET, one, camera)).tobytes() for one in changes)
    assert first == second
    assert first != opened(draw(STREET, changes[0], replace(camera, is_filmed=False))).tobytes()


def test_a_film_names_nobody_and_is_the_same_whatever_they_are_called() -> None:
    cars = (cutting_in(0.5), vehicle("New2", 40.0, 0.0), cone("New3", 30.0, 2.0))
    change = Modification(added=cars)
    camera = camera_for(STREET, change)
    other = Modification(
        added=tuple(replace(one, id=f"X{9 - n}") for n, one in enumerate(cars))[::-1]
    )
    renamed = scene(agents=tuple(replace(one, id=f"R{one.id}") for one in STREET.agents))
    shown = make_film(STREET, change, camera)
    assert make_film(renamed, other, camera) == shown
    assert not any(name in shown.decode() for name in ("New", "Agent", "Lane"))
    assert len(shown) < 5_000


def test_a_film_says_where_everybody_is_when() -> None:
    car = cutting_in(0.5)
    change = Modification(added=(car,))
    camera = camera_for(STREET, change)
    document = json.loads(make_film(STREET, change, camera))
    assert (document["steps"], document["step_s"]) == (STEPS, 0.1) == (61, 0.1)
    assert (document["changed"], document["ticks"]) == (1, [5])  # it sets out after 0.5 s
    mark, first, last, values = document["movers"][-1]  # what is changed is painted last
    assert palette.CHANGED_MARK.fill in {
        ImageColor.getrgb(shape["fill"]) for shape in document["marks"][mark]
    }
    assert (first, last) == (0, 60)
    poses = np.array(values, dtype=float).reshape(-1, 3).cumsum(axis=0)
    motion = find_motion(replace(STREET, agents=(car,))).others[0].states[:STEPS]
    assert poses[:, :2] / 10.0 == pytest.approx(camera.to_pixels(motion[:, :2]), abs=0.051)
    turns = [
        wrap(-math.radians(turn) - heading)
        for turn, heading in zip(poses[:, 2], motion[:, 2], strict=True)
    ]
    assert np.abs(turns).max() <= math.radians(0.51)


def test_who_stands_is_one_pose_and_who_is_never_in_the_window_is_left_out() -> None:
    far = vehicle("Far", 900.0, 0.0)
    document = film(Modification(added=(cutting_in(0.5), far)))
    movers = document["movers"]
    assert isinstance(movers, list)
    # The parked car, the person, the ego and the car that cuts in.
    assert sorted(len(values) for *_, values in movers) == [3, 3, 3 * STEPS, 3 * STEPS]


def test_a_window_widens_for_a_way_but_never_loses_who_is_changed_for_it() -> None:
    way = PlannedMotion(path=PointPath(points_m=((30.0, -55.0),)), speeds=((0.0, 14.0),))
    crossing = vehicle("New1", 30.0, 45.0, -math.pi / 2, motion=way)
    camera = camera_for(STREET, Modification(added=(crossing,)))
    assert camera.shows(crossing.box.corners_m)
    still = camera_for(STREET, Modification(added=(replace(crossing, motion=None),)))
    # Already wider than ways may make it, and no wider for them.
    widths_m = [one.x_max_m - one.x_min_m for one in (camera, still)]
    assert widths_m[0] == widths_m[1] > PASSED_WIDTH_M
