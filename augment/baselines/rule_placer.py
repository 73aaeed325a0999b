"""The rule placer: a contestant without a language model, which refuses rather than guesses.

The instruction becomes an intent, the intent places along the lanes, the places agents. Every
placement is held against the same checks that judge everybody's; where one finds something, the
placement gives way a little along the lane or is made in another way, and if nothing helps, it is
refused.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from augment.baselines.rule_placer_cones import cones
from augment.baselines.rule_placer_crash import crash, ways_to_crash
from augment.baselines.rule_placer_ground import Ground
from augment.baselines.rule_placer_jury import Jury, numbered
from augment.baselines.rule_placer_vehicles import vehicle
from augment.baselines.rule_placer_walkers import walkers
from augment.baselines.rule_placer_words import described
from augment.errors import InstructionNotUnderstood
from augment.geometry.boxes import Box, overlap
from augment.instruction.grammar import parse
from augment.instruction.intent import (
    ConesRequest,
    CrashRequest,
    Intent,
    Relation,
    Request,
    VehicleRequest,
    WalkRequest,
)
from augment.scene.entities import Scene, TrafficAgent
from augment.scene.modification import Modification

_SHIFT_STEP_M = 0.25
_SHIFT_EXACT_M = 0.5
_SHIFT_ABOUT_M = 1.5
"""How far along the lane a placement may give way, for an exact and for an "about" distance."""

_Agents = tuple[TrafficAgent, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Placement:
    """What was placed, and how the instruction was read.

    Attributes:
        understood: The parts of the sentence that were read, in its own words.
        ignored: Parts that were read and place nothing.
        not_understood: Words that were passed over, because they place nothing either way.
        notes: All that in sentences, for a page.
    """

    modification: Modification
    understood: tuple[str, ...]
    ignored: tuple[str, ...]
    not_understood: tuple[str, ...]
    notes: str


def place(scene: Scene, instruction: str, *, seed: int = 0) -> Placement:
    """Add what an instruction asks for to a scene; the same for the same seed.

    Raises:
        InstructionNotUnderstood: The sentence was not read in full, or the map or the traffic
            leaves no room for what it asks.
    """
    intent = parse(instruction)
    rng = np.random.default_rng(seed)
    try:
        ground, jury = Ground(scene), Jury(scene)
        added: _Agents = ()
        sentences = []
        for request in intent.requests:
            agents, distance_m = _fitted(request, ground, jury, added, rng)
            added += agents
            sentences.append(
                described(request, distance_m, across_m=ground.left_of_lane_m(agents[0]))
            )
    except InstructionNotUnderstood as refusal:
        raise InstructionNotUnderstood(refusal.reason, understood=intent.understood) from refusal
    return Placement(
        modification=Modification(added=numbered(added, scene)),
        understood=intent.understood,
        ignored=intent.ignored,
        not_understood=intent.not_understood,
        notes=_notes(sentences, intent),
    )


# Private


def _fitted(
    request: Request, ground: Ground, jury: Jury, added: _Agents, rng: np.random.Generator
) -> tuple[_Agents, float]:
    """The agents of a request nearest to the asked distance that the checks pass, and it."""
    spot = request.spot
    asked_m = float(rng.uniform(spot.distance.low_m, spot.distance.high_m))
    sign = 1.0 if spot.relation is Relation.AHEAD else -1.0
    draw = int(rng.integers(2**32))
    tolerance_m = _SHIFT_ABOUT_M if spot.distance.is_approximate else _SHIFT_EXACT_M
    first_problem = ""
    best: tuple[int, _Agents, float] | None = None
    for shift_m, way in itertools.product(_shifts(tolerance_m), range(_ways(request))):
        distance_m = asked_m + shift_m
        if spot.distance.is_range and not (
            spot.distance.low_m <= distance_m <= spot.distance.high_m
        ):
            continue
        again = np.random.default_rng(draw)
        agents = tuple(
            _rounded(agent) for agent in _made(request, ground, sign * distance_m, again, way)
        )
        problem = _problem(request, ground, sign * distance_m, agents, added)
        if problem is None:
            verdict = jury.verdict(request, added, agents)
            if verdict.is_clean:
                return agents, distance_m
            if verdict.wrong is None and (best is None or verdict.doubts < best[0]):
                best = verdict.doubts, agents, distance_m
            problem = verdict.wrong
        first_problem = first_problem or problem or ""
    if best is not None:
        return best[1], best[2]
    raise InstructionNotUnderstood(first_problem)


def _ways(request: Request) -> int:
    return ways_to_crash(request) if isinstance(request, CrashRequest) else 1


def _shifts(tolerance_m: float) -> list[float]:
    """0, then further and further to either side."""
    steps = range(1, int(tolerance_m / _SHIFT_STEP_M) + 1)
    return [0.0, *(sign * step * _SHIFT_STEP_M for step in steps for sign in (1.0, -1.0))]


def _made(
    request: Request, ground: Ground, distance_m: float, rng: np.random.Generator, way: int
) -> _Agents:
    match request:
        case VehicleRequest():
            return vehicle(request, ground, distance_m, rng)
        case WalkRequest():
            return walkers(request, ground, distance_m, rng)
        case ConesRequest():
            return cones(request, ground, distance_m, rng)
        case CrashRequest():
            return crash(request, ground, distance_m, rng, way=way)


def _problem(
    request: Request, ground: Ground, distance_m: float, agents: _Agents, added: _Agents
) -> str | None:
    """Why the agents can't stand there, None if they can."""
    for agent in agents:
        for other in (*ground.scene.everyone, *added):
            if overlap(_box(agent), _box(other)).depth_m > 0.0:
                name = "the ego" if other is ground.scene.ego else other.id or "what was added"
                return f"{abs(distance_m):.1f} m from the ego it would stand in {name}."
    path_m = np.array([point for agent in agents for point in _path(agent)])
    for setting in request.spot.settings:
        if not ground.fits(distance_m, path_m, setting):
            return f"{abs(distance_m):.1f} m from the ego is not {setting}."
    return None


def _path(agent: TrafficAgent) -> NDArray[np.float64]:
    """Where an agent stands or walks, a point (P, 2) about every half metre."""
    start = np.array([agent.x_m, agent.y_m])
    end = start if agent.walk_to_m is None else np.array(agent.walk_to_m)
    return np.asarray(np.linspace(start, end, 60 if agent.walk_to_m else 1), dtype=np.float64)


def _box(agent: TrafficAgent) -> Box:
    return Box(pose=agent.pose, length_m=agent.length_m, width_m=agent.width_m)


def _rounded(agent: TrafficAgent) -> TrafficAgent:
    """To the millimetre, so that no digits are kept that the arithmetic alone made up."""
    walk = agent.walk_to_m
    return replace(
        agent,
        x_m=_millimetres(agent.x_m),
        y_m=_millimetres(agent.y_m),
        heading_rad=round(agent.heading_rad, 5),
        walk_to_m=None if walk is None else (_millimetres(walk[0]), _millimetres(walk[1])),
    )


def _millimetres(length_m: float) -> float:
    return round(length_m, 3) + 0.0  # + 0.0 makes -0.0 a plain zero


def _notes(sentences: list[str], intent: Intent) -> str:
    parts = list(sentences)
    if intent.assumed:
        parts.append(f"Not said, so assumed: {'; '.join(intent.assumed)}.")
    if intent.ignored:
        quoted = ", ".join(f"“{words}”" for words in intent.ignored)
        parts.append(f"Read, but placing nothing: {quoted}.")
    return " ".join(parts)
