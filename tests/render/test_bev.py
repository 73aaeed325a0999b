"""What a picture shows, by named pixels; never whole pictures."""

import math
from dataclasses import replace

import numpy as np
import pytest

from augment.render.bev import draw, draw_for_review
from augment.render.camera import camera_for
from augment.render.road import scale_corner
from augment.scene.entities import AgentType, Modification, TrafficAgent
from tests import scenes
from tests.render.pictures import (
    WIDE,
    chunks,
    draw_original,
    is_blue,
    is_grey,
    is_red,
    opened,
    patch,
    pixel_at,
)

STREET = scenes.scene()
CAMERA = WIDE


def added(*agents: TrafficAgent) -> Modification:
    return Modification(added=agents)


def test_the_ego_is_red_the_lane_grey_the_walkway_olive() -> None:
    png = draw_original(STREET, CAMERA)
    assert opened(png).size == (2400, 1600)
    assert is_red(pixel_at(png, CAMERA, -0.3, 0.3))
    lane = pixel_at(png, CAMERA, 21.2, 0.8)
    assert is_grey(lane)
    assert lane[0] < 240
    red, green, blue = pixel_at(png, CAMERA, 21.2, -3.0)
    assert min(red, green) - blue > 20
    assert pixel_at(png, CAMERA, 21.2, 12.3) == (255, 255, 255)


def test_a_moved_agent_leaves_its_old_place_and_is_blue_at_its_new_one() -> None:
    parked = scenes.vehicle("Agent2", 20.0, 0.0)
    scene = scenes.scene(agents=(parked,))
    png = draw(scene, Modification(moved=(replace(parked, x_m=30.0),)), CAMERA)
    assert is_blue(pixel_at(png, CAMERA, 30.0, 0.0))
    empty = draw_original(STREET, CAMERA)
    assert pixel_at(png, CAMERA, 20.3, 0.7) == pixel_at(empty, CAMERA, 20.3, 0.7)


def test_a_removed_agent_is_gone_without_a_trace_in_a_vote_and_a_ghost_for_reviewers() -> None:
    scene = scenes.scene(agents=(scenes.vehicle("Agent2", 20.0, 0.0),))
    removed = Modification(removed=("Agent2",))
    assert draw(scene, removed, CAMERA) == draw_original(STREET, CAMERA)
    ghost, nothing = (
        draw_for_review(base, change, CAMERA)
        for base, change in ((scene, removed), (STREET, Modification()))
    )
    assert ghost != nothing


def test_cones_differ_from_people_in_shape() -> None:
    cone = draw(STREET, added(scenes.cone("New1", 20.3, 0.9)), CAMERA)
    person = draw(STREET, added(scenes.pedestrian("New1", 20.3, 0.9)), CAMERA)
    rows = []
    for png in (cone, person):
        pixels = patch(png, CAMERA, 20.3, 0.9, 12)
        dark = pixels.min(axis=2) < 60
        rows.append(dark.sum(axis=1)[dark.any(axis=1)])
    triangle, circle = rows
    assert triangle[1] < triangle[-3] / 2
    assert abs(int(circle[1]) - int(circle[-2])) <= 3


@pytest.mark.parametrize("kind", [kind for kind in AgentType if kind is not AgentType.EGO_VEHICLE])
def test_every_type_has_a_mark_that_can_be_seen_in_the_widest_window(kind: AgentType) -> None:
    far = added(scenes.vehicle("Ref", 210.0, 0.0))
    camera = camera_for(STREET, far)
    assert camera.px_per_m < 6.0
    thing = scenes.cone("New1", 102.5, 12.0, type=kind)
    before, after = draw_original(STREET, camera), draw(STREET, added(thing), camera)
    changed = patch(before, camera, 102.5, 12.0, 20) != patch(after, camera, 102.5, 12.0, 20)
    assert changed.any(axis=2).any(axis=0).sum() >= 4


def test_what_moves_has_a_tick_and_what_is_parked_has_none() -> None:
    parked = scenes.vehicle("New1", 20.0, 3.5)
    moving = replace(parked, speed_mps=8.0)
    assert not is_blue(pixel_at(draw(STREET, added(parked), CAMERA), CAMERA, 26.0, 3.5))
    assert is_blue(pixel_at(draw(STREET, added(moving), CAMERA), CAMERA, 26.0, 3.5))
    noisy = replace(parked, speed_mps=0.2)
    assert draw(STREET, added(noisy), CAMERA) == draw(STREET, added(parked), CAMERA)


def test_a_walk_is_a_dashed_arrow_to_its_end() -> None:
    walker = scenes.pedestrian("New1", 20.0, -3.0, (20.0, 7.0))
    png = draw(STREET, added(walker), CAMERA)
    line = [is_blue(pixel_at(png, CAMERA, 20.0, y_m)) for y_m in np.arange(-1.0, 6.5, 0.1)]
    assert 0.4 < np.mean(line) < 0.8
    assert is_blue(pixel_at(png, CAMERA, 20.0, 6.9))
    assert not is_blue(pixel_at(png, CAMERA, 20.0, 7.6))


def test_the_same_picture_has_the_same_bytes_and_no_metadata() -> None:
    change = added(scenes.vehicle("New1", 20.0, 3.5), scenes.vehicle("New2", 500.0, 3.5))
    first, second = (draw(STREET, change, CAMERA) for _ in range(2))
    assert first == second
    assert set(chunks(first)) == {"IHDR", "PLTE", "IDAT", "IEND"}


def test_no_picture_leaves_a_trace_on_the_next_of_its_scene() -> None:
    before = draw_original(STREET, CAMERA)
    draw(STREET, added(scenes.vehicle("New1", 20.0, 3.5)), CAMERA)
    assert draw_original(STREET, CAMERA) == before
    other = scenes.scene(agents=(scenes.vehicle("Agent2", 20.0, 0.0),))
    assert draw_original(other, CAMERA) != before
    assert draw_original(STREET, replace(CAMERA, x_max_m=CAMERA.x_max_m + 5.0)) != before


def test_a_person_is_at_least_28_pixels_high_in_every_window() -> None:
    walker = scenes.pedestrian("New1", 20.0, 6.0)
    for camera in (CAMERA, camera_for(STREET, added(scenes.vehicle("Ref", 210.0, 0.0)))):
        png = draw(STREET, added(walker), camera)
        column = patch(png, camera, 20.0, 6.0, 40)[:, 40]
        assert sum(is_blue(tuple(pixel)) or pixel.max() < 110 for pixel in column) >= 28


@pytest.mark.parametrize("turn_deg", range(0, 360, 30))
def test_the_front_mark_of_a_car_is_at_its_front_at_every_angle(turn_deg: int) -> None:
    turn = math.radians(turn_deg)
    parked = scenes.vehicle("Agent2", 20.0, 9.0, turn, length_m=4.8)
    png = draw_original(scenes.scene(agents=(parked,)), CAMERA)
    front, rear = (
        patch(png, CAMERA, 20.0 + way * math.cos(turn), 9.0 + way * math.sin(turn), 6)
        for way in (1.3, -1.3)
    )
    assert front.min(axis=2).max() > 240 > rear.min(axis=2).max()


def test_the_scale_keeps_away_from_traffic() -> None:
    parked = scenes.vehicle("Agent2", CAMERA.x_min_m + 4.0, CAMERA.y_min_m + 3.0)
    assert scale_corner(STREET, CAMERA) == (False, False)
    assert scale_corner(scenes.scene(agents=(parked,)), CAMERA) == (True, False)
