"""Tracks after t0 of those who drive by rules, without the ego's influence.

Films, stills, checks and functions look places up in them, so that they have everybody where
drives have them. Frame: the scene's. T steps.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from augment.errors import CannotDrive
from augment.scene.density import fit_boxes
from augment.scene.entities import Modification, Scene, TrafficAgent
from augment.scene.motion import HORIZON_S, LENGTH_S, STEP_S, find_motion
from augment.scene.recording import Recording, to_track
from augment.simulation.road import Road
from augment.simulation.shapes import move_ahead
from augment.simulation.states import WIDTH, EgoBody, FloatArray, Objects
from augment.simulation.traffic import DriveSetting, Traffic


@lru_cache(maxsize=32)
def expect_recording(
    scene: Scene, modification: Modification, recording: Recording | None = None
) -> Recording | None:
    """Return the tracks of a scene after a change, as `find_motion` takes them; None without any.

    Who is moved or removed has none of before. InterPlan's rules, and recordings that end within
    what is filmed, are carried on by `Traffic`, whom the ego's own motion passes unseen: it sets
    off triggers and walks, but nobody brakes for it. Where no drive can begin, they are not.

    Args:
        scene: Before the change.
        modification: What changes.
        recording: What was recorded after t0 in the scene before its change.

    Raises:
        InvalidModification: The change does not fit the scene, or a motion its lanes.
    """
    change = fit_boxes(scene, modification)
    setting = DriveSetting(scene=scene, modification=change, recording=recording)
    acting = {agent.id for agent in setting.after.agents if agent.motion or agent.walk_to_m}
    known = recording and recording.without(change.replaced | acting)
    last_s = 0.0 if recording is None else float(recording.times_s[-1])
    is_interplans = scene.options.interplan is not None
    if not is_interplans and (recording is None or last_s >= HORIZON_S):
        return known
    try:
        road = Road(scene, recording)
    except CannotDrive:
        return known
    longer = None if recording is None else _lengthen(recording.ego_alone, LENGTH_S)
    motion = find_motion(replace(scene, agents=()), recording=longer)
    absent = np.full_like(motion.ego.states, np.nan)
    unseen = absent.copy()
    unseen[0] = motion.ego.states[0]
    states = _find_states(_roll_out(setting, road, motion.ego.states))
    ruled = [agent for agent in setting.after.agents if is_interplans and _moves(agent)]
    tracks = [*(known.tracks if known else ()), *(to_track(agent, absent) for agent in ruled)]
    return Recording(
        times_s=motion.times_s,
        ego=motion.ego.states if recording is not None and recording.shows_ego else unseen,
        tracks=tuple(
            replace(track, states=states.get(track.agent_id, absent)) for track in tracks
        ),
    )


# Private


def _moves(agent: TrafficAgent) -> bool:
    """Return whether an agent without a motion of its own is not to stay where it is."""
    return agent.motion is None and (agent.speed_mps > 0.0 or agent.walk_to_m is not None)


def _lengthen(recording: Recording, last_s: float) -> Recording:
    """Return a recording of the ego that ends no earlier; it was not seen at the last moment."""
    if recording.times_s[-1] >= last_s - STEP_S / 2.0:
        return recording
    times_s = np.append(recording.times_s, last_s)
    return replace(recording, times_s=times_s, ego=np.vstack([recording.ego, np.full(4, np.nan)]))


def _roll_out(setting: DriveSetting, road: Road, centres: FloatArray) -> list[Objects]:
    """Return who is there at each of T moments, for an ego whose centre has the states (T, 4)."""
    body, states = EgoBody.of(setting.scene.ego), np.zeros((len(centres), WIDTH))
    states[:, :4] = centres
    # Drives go by the rear axle, which lies behind the centre.
    states[:, :3] = move_ahead(centres, -body.centre_m)
    traffic = Traffic(setting, road, body, states[0])
    rows = [traffic.objects()]
    for state in states[:-1]:
        traffic.step(state, rows[-1], sees_ego=False)
        rows.append(traffic.objects())
    return rows


def _find_states(rows: list[Objects]) -> dict[str, FloatArray]:
    """Return the states (T, 4) of everybody in T rows by id, NaN where one is not there."""
    states: dict[str, FloatArray] = {}
    for step, now in enumerate(rows):
        for name, box, speed_mps in zip(now.ids, now.boxes, now.speeds_mps, strict=True):
            states.setdefault(name, np.full((len(rows), 4), np.nan))[step] = *box[:3], speed_mps
    return states
