"""Holds checks, films and stills against drives: everybody is at one place."""

import json
import math

import numpy as np

from augment.checks import Ground
from augment.render.camera import camera_for
from augment.render.film import make_film
from augment.scene.motion import find_trails
from augment.simulation.expected import expect_recording
from augment.simulation.road import Road
from augment.simulation.shapes import move_ahead
from augment.simulation.states import EgoBody, Objects, start_state
from augment.simulation.traffic import DriveSetting, Traffic


def place(objects: Objects, name: str) -> tuple[float, float]:
    x, y = objects.boxes[objects.ids.index(name), :2]
    return float(x), float(y)


def assert_everybody_is_at_one_place(setting: DriveSetting) -> None:
    """Hold checks, film and still against the drive over 6 s; drivers don't see the ego."""
    scene, change = setting.scene, setting.modification
    recording = expect_recording(scene, change, setting.recording)
    motion = Ground.of(scene, lambda *_: recording).motion_after(change)
    camera = camera_for(scene, change)
    film = json.loads(make_film(scene, change, camera, recording))
    tracks = [
        (first, last, np.array(values).reshape(-1, 3)[:, :2].cumsum(axis=0) / 10.0)
        for _, first, last, values in film["movers"]
    ]
    body = EgoBody.of(scene.ego)
    traffic = Traffic(setting, Road(scene, setting.recording), body, start_state(scene.ego, body))
    trails = find_trails(scene, change, recording, with_held=True)
    assert {trail.agent.id for trail in trails} == {
        one.id for one in change.changed if one.motion or (one.speed_mps and not one.walk_to_m)
    }
    for step in range(61):
        objects, at_t = traffic.objects(), [one for one in motion.others if one.is_present[step]]
        assert sorted(objects.ids) == sorted(one.agent.id for one in at_t)
        drawn = [
            track[min(step - first, len(track) - 1)]
            for first, last, track in tracks
            if first <= step <= last
        ]
        for one in at_t:
            x_m, y_m = one.states[step, :2].tolist()
            assert math.dist(place(objects, one.agent.id), (x_m, y_m)) < 0.1
            (pixel,) = camera.to_pixels(np.array([[x_m, y_m]]))
            if camera.shows(np.array([[x_m, y_m]])):
                off_px = np.hypot(*(np.array(drawn) - pixel).T).min()
                assert off_px / camera.px_per_m < 0.1
        for trail in (one for one in trails if one.agent.id in objects.ids and one.sets_out):
            assert np.hypot(*(trail.way_m - place(objects, trail.agent.id)).T).min() < 0.1
        states = np.zeros(6)
        states[:4] = motion.ego.states[step]
        states[:3] = move_ahead(states[None, :3], -body.centre_m)[0]
        traffic.step(states, objects, sees_ego=False)
