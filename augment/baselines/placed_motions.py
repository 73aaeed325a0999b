"""Rule placer for motions: numbers, places and doors of the requested motion."""

from dataclasses import replace

import numpy as np

from augment.baselines.placing_ground import PlacingGround
from augment.checks.lanes_across import LanesAcross, find_mark, list_arms
from augment.errors import CannotPlace
from augment.geometry.frames import Pose
from augment.scene import planned_motion, presets
from augment.scene.entities import TrafficAgent
from augment.scene.intent import Side
from augment.scene.intent_parts import MotionWish, StartWish

_STOP_LINE_M = 3.5
"""From the centre of a car that waits to the junction."""


def give_motion(
    wish: MotionWish, ground: PlacingGround, agent: TrafficAgent, rng: np.random.Generator
) -> TrafficAgent:
    """Return the agent with the motion, or the door that is to be added.

    A pedestrian with a walk starts late on that walk, at its pace where no other is said.

    Raises:
        CannotPlace: The scene has not what it needs.
    """
    numbers = presets.PresetNumbers(start=_trigger(wish.start, ground.lanes, rng))
    for name in presets.preset_numbers(wish.preset):
        if (amount := getattr(wish, name)) is not None:
            numbers = replace(numbers, **{name: round(amount.draw(rng), 2)})
    mover = presets.with_preset(wish.preset, ground.scene, agent, numbers)
    if agent.walk_to_m is None or mover.motion is None:
        return mover
    path = planned_motion.PointPath(points_m=(agent.walk_to_m,))
    waiting = replace(mover, heading_rad=agent.heading_rad)
    return replace(waiting, motion=replace(mover.motion, path=path))


def find_arm(
    ground: PlacingGround, side: Side | None, speed_mps: float, *, nearer_m: float = 0.0
) -> tuple[Pose, str]:
    """Return a place on another arm of the junction, and its lane, for one who runs a red light.

    Who drives is as many seconds from where the ways cross as the ego is; who stands waits.
    It may be so much nearer or further.

    Raises:
        CannotPlace: No such arm leads over the ego's way.
    """
    arms = list_arms(ground.lanes, side)
    if not arms:
        where = f" from the {side}" if side else ""
        raise CannotPlace(f"No arm of a junction{where} leads over the ego's way at red.")
    arm = arms[0]
    before_m = _STOP_LINE_M
    if speed_mps > 0.0:
        before_m = max(
            speed_mps * arm.ahead_m / presets.ego_pace_mps(ground.scene) - arm.away_m, _STOP_LINE_M
        )
    length_m = ground.graph.lane(arm.lane_id).centerline.length_m
    place = ground.graph.along(arm.lane_id, length_m, nearer_m - before_m)
    if place is None:
        raise CannotPlace(f"The lanes end less than {before_m:.0f} m before the junction.")
    return place.pose, place.lane_id


def is_on_other_arm(wish: MotionWish | None) -> bool:
    """Return whether who is to move so comes from another arm of the junction."""
    return wish is not None and wish.preset is planned_motion.MotionPreset.RED_LIGHT


# Private


def _trigger(
    wish: StartWish | None, lanes: LanesAcross, rng: np.random.Generator
) -> planned_motion.Trigger | None:
    if wish is None:
        return None
    if wish.after_s is not None:
        return planned_motion.AtTime(after_s=round(wish.after_s.draw(rng), 2))
    within_m = (
        planned_motion.REACHED_M if wish.ego_distance is None else wish.ego_distance.draw(rng)
    )
    within_m = round(within_m, 2)
    if wish.mark is None:
        return planned_motion.NearEgo(within_m=within_m)
    mark_m = find_mark(lanes, wish.mark)
    if mark_m is None:
        raise CannotPlace(f"Not in this scene: {wish.mark}.")
    x_m, y_m = (round(value, 3) for value in lanes.route.position(mark_m))
    return planned_motion.AtPlace(x_m=x_m, y_m=y_m, within_m=within_m)
