"""The distance along the ego's lane against the one that was asked for."""

from __future__ import annotations

import math
from collections.abc import Iterator

from augment.checks.asked.crash import in_order
from augment.checks.asked.parties import Party
from augment.checks.asked.question import Asked, distance_outside, severity_of
from augment.checks.finding import Finding, FindingKind
from augment.checks.tolerances import CRASH_M
from augment.scene.entities import TrafficAgent
from augment.scene.intent import (
    ConesRequest,
    CrashRequest,
    Relation,
    Shape,
    VehicleRequest,
    WalkRequest,
)


def asked_distance(asked: Asked) -> Iterator[Finding]:
    """One finding a request: wrong beyond the tolerance.

    A crash counts by its first vehicle, cones by the first, a ring by its middle, pedestrians
    by where a walk begins or meets the ego's route. Where the number is wrong, which is a fault of
    its own, any may be the first, and where the first is missing the next one is.
    """
    for party in asked.parties:
        span_m = party.request.spot.span_m
        if party.placed and span_m is not None:
            yield _finding(asked, party, span_m)


def _finding(asked: Asked, party: Party, span_m: tuple[float, float]) -> Finding:
    sign = -1.0 if party.request.spot.relation is Relation.BEHIND else 1.0
    low_m, high_m = sorted(sign * one for one in span_m)
    first, measured_m = _measured(asked, party, sign, (low_m, high_m))
    off_m = distance_outside(measured_m, low_m, high_m)
    allowed_m = asked.tolerances.distance_m
    if math.isfinite(high_m):
        allowed_m = max(allowed_m, asked.tolerances.distance_share * high_m) + _to_next_m(party)
    side = "ahead of" if measured_m * sign >= 0.0 else "behind"
    what, place = _words(party, low_m, high_m)
    belongs_m = sign * min(max(measured_m, low_m), high_m)
    words = f"{place} ahead is asked for" if sign > 0.0 else f"{place} behind is asked for"
    return Finding(
        kind=FindingKind.ASKED_DISTANCE,
        severity=severity_of(fits=off_m <= allowed_m),
        agents=(first.id, *(agent.id for agent in party.everyone if agent is not first)),
        belongs_m=asked.route.position(belongs_m, asked.left_m(first)),
        measured={
            "along_m": measured_m,
            "asked_low_m": low_m,
            "asked_high_m": high_m if math.isfinite(high_m) else None,
            "off_m": off_m,
        },
        template=f"{what} is {{along_m:.1f}} m {side} the ego along its lane; {words}.",
    )


def _measured(
    asked: Asked, party: Party, sign: float, wanted_m: tuple[float, float]
) -> tuple[TrafficAgent, float]:
    """Who tells the distance, and the distance in the direction asked for."""
    request = party.request
    along = [(sign * asked.ahead_m(one), one) for one in (*party.placed, *party.spare)]
    if isinstance(request, WalkRequest):
        along += [
            (sign * asked.route.locate(*point).ahead_m, one)
            for one in party.placed
            for point in _ends_on_road(asked, one)
        ]
    elif isinstance(request, ConesRequest) and request.shape is Shape.RING:
        middle_m = sum(value for value, _ in along) / len(along)
        return min(along, key=lambda item: (item[0], item[1].id))[1], middle_m
    elif isinstance(request, CrashRequest) and party.is_exact:
        first = in_order(party, request, asked.route)[0]
        return first, sign * asked.ahead_m(first)
    elif isinstance(request, (ConesRequest, VehicleRequest)) and party.is_exact:
        value, agent = min(along, key=lambda item: (item[0], item[1].id))
        return agent, value
    value, agent = min(along, key=lambda item: (distance_outside(item[0], *wanted_m), item[1].id))
    return agent, value


def _to_next_m(party: Party) -> float:
    """How much further the next one stands where one is missing."""
    if not party.missing:
        return 0.0
    if isinstance(party.request, CrashRequest):
        return CRASH_M
    spacing = party.request.spacing if isinstance(party.request, ConesRequest) else None
    return 0.0 if spacing is None else spacing.high_m


def _ends_on_road(asked: Asked, agent: TrafficAgent) -> Iterator[tuple[float, float]]:
    """Where a walk is level with the middle of the ego's route, if it gets there."""
    if agent.walk_to_m is None:
        return
    start, end = asked.left_m(agent), asked.route.locate(*agent.walk_to_m).left_m
    if start * end < 0.0:
        share = start / (start - end)
        yield (
            agent.x_m + share * (agent.walk_to_m[0] - agent.x_m),
            agent.y_m + share * (agent.walk_to_m[1] - agent.y_m),
        )


def _words(party: Party, low_m: float, high_m: float) -> tuple[str, str]:
    request = party.request
    what: str
    if isinstance(request, CrashRequest):
        what = "The first of the crashed vehicles, {agents[0]},"
    elif isinstance(request, ConesRequest):
        is_ring = request.shape is Shape.RING
        first = "The first cone, {agents[0]},"
        what = "The middle of the cones" if is_ring else first
    elif isinstance(request, WalkRequest):
        what = "The walk of {agents[0]}"
    else:
        what = "{agents[0]}"
    if not math.isfinite(high_m):
        return what, "a place"
    if high_m > low_m:
        return what, "{asked_low_m:.4g} to {asked_high_m:.4g} m"
    return what, "{asked_low_m:.4g} m"
