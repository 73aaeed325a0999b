"""Counts, types and motion against those that were asked for, and how cones stand together."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations
from statistics import median

from augment.checks.asked import Asked, outside, severity
from augment.checks.finding import Finding, Kind, Severity
from augment.checks.parties import Party, Role, middle_of
from augment.checks.situation import STOPPED_BELOW_MPS
from augment.checks.tolerances import (
    SPACING_M,
    SPACING_SHARE,
    SPEED_MPS,
    SPEED_SHARE,
    WORKER_M,
)
from augment.instruction.intent import ConesRequest, CrashRequest, VehicleRequest
from augment.scene.entities import TrafficAgent


def asked_count(asked: Asked) -> Iterator[Finding]:
    """What is missing, and what nobody asked for."""
    for party in asked.parties:
        here = tuple(one.id for one in party.everyone)
        for role, number in party.missing:
            yield Finding(
                kind=Kind.ASKED_COUNT,
                severity=Severity.WRONG,
                agents=here,
                belongs_m=None if here else middle_of(party.request.spot, asked.way),
                measured={"missing": float(number)},
                template=f"{{missing:.0f}} {_plural(role, number)} asked for and not there.",
            )
    for agent in asked.casting.surplus:
        yield Finding(
            kind=Kind.ASKED_COUNT,
            severity=Severity.WRONG,
            agents=(agent.id,),
            measured={"surplus": 1.0},
            template=f"{{agents[0]}}, a {_named(agent)}, is more than was asked for.",
        )


def asked_type(asked: Asked) -> Iterator[Finding]:
    """What stands in for something of another type."""
    for party in asked.parties:
        for agent, role in party.mistyped:
            yield Finding(
                kind=Kind.ASKED_TYPE,
                severity=Severity.WRONG,
                agents=(agent.id,),
                template=f"{{agents[0]}} is a {_named(agent)}; a {role} is asked for.",
            )


def asked_motion(asked: Asked) -> Iterator[Finding]:
    """The speed of vehicles: those that are to stand do, the others drive as fast as said."""
    for party in asked.parties:
        request = party.request
        if not isinstance(request, (VehicleRequest, CrashRequest)):
            continue
        wanted_mps = request.speed_mps if isinstance(request, VehicleRequest) else 0.0
        allowed_mps = max(SPEED_MPS, SPEED_SHARE * wanted_mps) if wanted_mps else STOPPED_BELOW_MPS
        words = "{asked_mps:.1f} m/s is asked for" if wanted_mps else "it is to stand"
        for agent in party.agents:
            off_mps = abs(agent.speed_mps - wanted_mps)
            yield Finding(
                kind=Kind.ASKED_MOTION,
                severity=severity(fits=off_mps <= allowed_mps),
                agents=(agent.id,),
                measured={"speed_mps": agent.speed_mps, "asked_mps": wanted_mps},
                template=f"{{agents[0]}} moves at {{speed_mps:.1f}} m/s; {words}.",
            )


def asked_spacing(asked: Asked) -> Iterator[Finding]:
    """The median gap from a cone to the nearest other, and from a worker to the nearest cone."""
    for party in asked.parties:
        request = party.request
        if not isinstance(request, ConesRequest):
            continue
        is_said = request.reach_m is None and len(party.agents) > 1
        if party.is_exact and is_said and _are_apart(party.agents):
            yield _spacing(party.agents, request)
        for worker in party.workers:
            if party.agents:
                yield _worker(worker, party)


def unasked(asked: Asked) -> Iterator[Finding]:
    """Agents of the scene that were moved or removed, where only adding is asked for."""
    moved = [(one.id, "moved") for one in asked.modification.moved]
    removed = [(name, "removed") for name in asked.modification.removed]
    for name, done in (*moved, *removed):
        yield Finding(
            kind=Kind.UNASKED,
            severity=Severity.WRONG,
            agents=(name,),
            template=f"{{agents[0]}} was in the scene and is {done}; nobody asked for that.",
        )


# Private


def _are_apart(cones: Sequence[TrafficAgent]) -> bool:
    """Whether none stands in another, which is a fault of its own and leaves gaps elsewhere."""
    pairs = combinations(cones, 2)
    return all(_apart_m(one, other) > one.width_m for one, other in pairs)


def _spacing(cones: Sequence[TrafficAgent], request: ConesRequest) -> Finding:
    gaps_m = [min(_apart_m(one, other) for other in cones if other is not one) for one in cones]
    gap_m, wanted = median(gaps_m), request.spacing
    off_m = outside(gap_m, wanted.low_m, wanted.high_m)
    return Finding(
        kind=Kind.ASKED_SPACING,
        severity=severity(fits=off_m <= max(SPACING_M, SPACING_SHARE * wanted.high_m)),
        agents=tuple(one.id for one in cones),
        measured={"gap_m": gap_m, "asked_m": (wanted.low_m + wanted.high_m) / 2.0},
        template="The cones stand {gap_m:.1f} m apart; {asked_m:.1f} m are asked for.",
    )


def _worker(worker: TrafficAgent, party: Party) -> Finding:
    nearest = min(party.agents, key=lambda cone: (_apart_m(worker, cone), cone.id))
    return Finding(
        kind=Kind.ASKED_SPACING,
        severity=severity(fits=_apart_m(worker, nearest) <= WORKER_M),
        agents=(worker.id, nearest.id),
        measured={"gap_m": _apart_m(worker, nearest)},
        template="The worker {agents[0]} is {gap_m:.1f} m from the nearest cone, {agents[1]}.",
    )


def _apart_m(one: TrafficAgent, other: TrafficAgent) -> float:
    return math.hypot(one.x_m - other.x_m, one.y_m - other.y_m)


def _named(agent: TrafficAgent) -> str:
    return agent.type.value.lower().replace("_", " ")


def _plural(role: Role, number: int) -> str:
    plural = {Role.BUS: "buses are"}.get(role, f"{role}s are")
    return f"{role} is" if number == 1 else plural
