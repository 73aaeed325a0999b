"""The stand-in's answers to open wishes: placements are drawn and measured until one will do.

Every throw of the dice may lead to another answer, and each that is found is right. Frame: ego
frame.
"""

import math
import random
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import islice

from augment.baselines.rule_placer import number_agents
from augment.checks import Finding, FindingKind, Ground
from augment.checks.purpose import check_drive
from augment.checks.registry import check_against_intent
from augment.errors import CannotPlace
from augment.geometry.frames import Pose, wrap
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import AgentType, Modification, Scene, TrafficAgent
from augment.scene.intent import Intent, Purpose
from augment.scene.planned_motion import MotionPreset, NearEgo
from augment.scene.presets import PresetNumbers, with_preset
from augment.simulation.drive import run
from augment.simulation.planners import NAMED, planner_named
from augment.simulation.score import collisions, criticality
from augment.simulation.traffic import DriveSetting

MOST_TRIES = 400


def search(
    scene: Scene, intent: Intent, rng: random.Random, *, misses: bool = False
) -> Modification:
    """Return the first drawn change that serves a purpose, without a fault by the checks.

    Args:
        scene: Before the change.
        intent: With a purpose.
        rng: The dice.
        misses: Whether a change is wanted whose only faults are that it misses the purpose.

    Raises:
        CannotPlace: None was found, or the map has no lane for the ego.
    """
    route, purpose = EgoRoute.of(scene), intent.purpose
    if route is None or purpose is None:
        raise CannotPlace("There is no purpose, or the ego stands on no lane of the map.")
    ground = Ground.of(scene)
    for change in islice(_draw_changes(route, purpose, rng), MOST_TRIES):
        findings = check_against_intent(ground, change, intent)
        faults = [finding for finding in findings if finding.is_fault]
        missed = [fault for fault in faults if fault.kind is FindingKind.PURPOSE]
        if len(missed) < len(faults) or (missed and not misses):
            continue
        driven = () if missed else find_driven_faults(scene, change, purpose)
        if misses is bool(missed or driven):
            return change
    raise CannotPlace(f"None of {MOST_TRIES} placements serves the purpose.")


def find_driven_faults(scene: Scene, change: Modification, purpose: Purpose) -> Iterable[Finding]:
    """Return what drives of the built-in planners say against a change, if they are asked for."""
    if purpose.braking_mps2 is None and purpose.ttc_s is None:
        return ()
    setting, faults = DriveSetting(scene=scene, modification=change), list[Finding]()
    for name in sorted(NAMED):  # IDM first, which is faster
        drive = run(setting, planner_named(name))
        hits = collisions(drive)
        critical = criticality(drive, hits)
        findings = check_drive(
            purpose,
            name,
            braking_mps2=critical["required_braking_mps2"] or 0.0,
            ttc_s=critical["least_ttc_s"] or math.inf,
            crashes=bool(hits),
        )
        faults += [finding for finding in findings if finding.is_fault]
        if faults:
            break
    return faults


# Private


def _draw_changes(route: EgoRoute, purpose: Purpose, rng: random.Random) -> Iterator[Modification]:
    draw = _hide if purpose.sight else _narrow if purpose.passage else _brake
    while True:
        try:
            drawn = draw(route, rng)
        except CannotPlace:
            continue
        yield Modification(added=number_agents(tuple(drawn), route.scene))


def _hide(route: EgoRoute, rng: random.Random) -> Iterable[TrafficAgent]:
    """A pedestrian who starts late, close behind a van or bus at the edge of the ego's lane."""
    side, ahead_m = rng.choice([-1.0, 1.0]), rng.uniform(16.0, 45.0)
    length_m, width_m = rng.choice([(5.9, 2.0), (7.5, 2.1), (12.0, 2.55)])
    left_m = side * rng.uniform(0.8, 3.2)
    van = _put(route, AgentType.VEHICLE, ahead_m, left_m, size_m=(length_m, width_m))
    behind_m = ahead_m + length_m / 2.0 + rng.uniform(0.8, 2.0)
    walker = _put(route, AgentType.PEDESTRIAN, behind_m, left_m + side * rng.uniform(-0.5, 0.8))
    numbers = PresetNumbers(
        start=NearEgo(within_m=round(rng.uniform(9.0, 24.0), 1)), speed_mps=rng.uniform(1.4, 2.5)
    )
    preset = MotionPreset.LATE_PEDESTRIAN
    return van, with_preset(preset, route.scene, replace(walker, id="Walker"), numbers)


def _narrow(route: EgoRoute, rng: random.Random) -> Iterable[TrafficAgent]:
    """A row of parked vehicles across the road, some of them turned."""
    ahead_m, left_m = rng.uniform(20.0, 50.0), rng.uniform(-4.5, 4.5)
    for number in range(rng.randint(1, 3)):
        turn_rad = rng.uniform(-1.6, 1.6)
        size_m = rng.choice([(4.8, 2.0), (7.5, 2.1), (12.0, 2.55)])
        at_m = ahead_m + rng.uniform(-1.0, 1.0)
        yield _put(
            route, AgentType.VEHICLE, at_m, left_m + 4.0 * number, turn_rad=turn_rad, size_m=size_m
        )


def _brake(route: EgoRoute, rng: random.Random) -> Iterable[TrafficAgent]:
    """Somebody on foot who steps out close ahead of the ego."""
    side, speed_mps = rng.choice([-1.0, 1.0]), rng.uniform(1.5, 3.0)
    left_m = side * rng.uniform(2.0, 3.5)
    walker = _put(route, AgentType.PEDESTRIAN, rng.uniform(20.0, 45.0), left_m)
    start = NearEgo(within_m=round(rng.uniform(12.0, 28.0), 1))
    numbers = PresetNumbers(start=start, speed_mps=speed_mps)
    preset = MotionPreset.LATE_PEDESTRIAN
    return (with_preset(preset, route.scene, replace(walker, id="Walker"), numbers),)


def _put(
    route: EgoRoute,
    kind: AgentType,
    ahead_m: float,
    left_m: float,
    *,
    turn_rad: float = 0.0,
    size_m: tuple[float, float] | None = None,
) -> TrafficAgent:
    x_m, y_m = route.position(ahead_m, left_m)
    heading_rad = wrap(route.heading_at(ahead_m) + turn_rad)
    pose = Pose(x_m=round(x_m, 2), y_m=round(y_m, 2), heading_rad=heading_rad)
    lane_id = route.graph.under(x_m, y_m, heading_rad)
    return TrafficAgent.at(kind, pose, size_m, lane_id=lane_id)
