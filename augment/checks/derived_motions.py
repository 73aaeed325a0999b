"""The motion of somebody who was drawn as a wish: the preset that makes it, found by trying."""

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from augment.errors import CannotPlace
from augment.scene.entities import Scene, TrafficAgent
from augment.scene.intent_parts import Amount, Length, MotionWish, StartWish
from augment.scene.planned_motion import (
    AtTime,
    LanePath,
    MotionPreset,
    NearEgo,
    PlannedMotion,
    PointPath,
    Trigger,
)
from augment.scene.presets import PresetNumbers, preset_numbers, with_preset

_ORDER = (MotionPreset.EMERGENCY_STOP, *MotionPreset)
"""An emergency stop is hard braking at a moment that it finds out itself."""
_DOOR_WITHIN_M = 5.0


def find_wish(
    agent: TrafficAgent, scene: Scene, others: Iterable[TrafficAgent]
) -> tuple[MotionWish, TrafficAgent] | None:
    """Return the wish that an agent's motion fulfils, and whose it is: its own, or a door's car.

    Args:
        agent: Somebody who was drawn.
        scene: Before the change.
        others: Cars whose door it may be.
    """
    motion = agent.motion
    if motion is None:
        return None
    here = agent.pose.beside(0.0)
    cars = [agent for agent in others if math.dist(here, agent.pose.beside(0.0)) < _DOOR_WITHIN_M]
    for preset in _ORDER:
        is_door = preset is MotionPreset.DOOR_OPENING
        for who in cars if is_door else [replace(agent, motion=None)]:
            numbers = _numbers(preset, agent, motion)
            try:
                made = with_preset(preset, scene, who, numbers).motion
            except CannotPlace:
                continue
            if preset is MotionPreset.LATE_PEDESTRIAN and isinstance(motion.path, PointPath):
                made = made and replace(made, path=motion.path)  # wherever its walk ends
            if made == motion:
                return _wish(preset, numbers, agent), who
    return None


# Private


def _numbers(preset: MotionPreset, agent: TrafficAgent, motion: PlannedMotion) -> PresetNumbers:
    own_mps = agent.speed_mps
    takes_s, to_mps = motion.speeds[-1] if motion.speeds else (0.0, own_mps)
    values = {"speed_mps": to_mps, "duration_s": takes_s}
    if takes_s > 0.0 and own_mps > to_mps:
        # Even braking over the whole time.
        values["braking_mps2"] = (own_mps - to_mps) / takes_s
    if isinstance(motion.path, LanePath) and own_mps + to_mps > 0.0:
        # The length of the change over the mean speed.
        values["duration_s"] = 2.0 * motion.path.change_m / (own_mps + to_mps)
    start = None if preset is MotionPreset.EMERGENCY_STOP else motion.start
    numbers = {name: values.get(name) or None for name in preset_numbers(preset)}
    return PresetNumbers(start=start, **numbers)


def _wish(preset: MotionPreset, numbers: PresetNumbers, agent: TrafficAgent) -> MotionWish:
    amounts: dict[str, Any] = {
        name: Amount(low=round(value, 1), high=round(value, 1))
        for name in preset_numbers(preset)
        if (value := getattr(numbers, name)) is not None
    }
    return MotionWish(preset=preset, start=_start(numbers.start), **amounts)


def _start(start: Trigger | None) -> StartWish | None:
    match start:
        case AtTime(after_s=after_s):
            return StartWish(after_s=Amount(low=after_s, high=after_s))
        case NearEgo(within_m=within_m):
            return StartWish(ego_distance=Length(low_m=within_m, high_m=within_m))
    return None
