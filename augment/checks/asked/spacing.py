"""How cones, their worker and vehicles in a row stand to each other, against what is asked."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations, pairwise
from statistics import median

from augment.checks.finding import Finding, FindingKind
from augment.checks.parties import WORKER_M, Asked, Party, distance_outside, severity_of, side_of
from augment.scene.entities import TrafficAgent
from augment.scene.intent import ConesRequest, Length, Side, VehicleRequest


def asked_spacing(asked: Asked) -> Iterator[Finding]:
    """The median gap between neighbours in a row, and from a worker to the cones."""
    for party in asked.parties:
        request = party.request
        if isinstance(request, ConesRequest):
            yield from _around_cones(asked, party, request)
        elif isinstance(request, VehicleRequest):
            yield from _in_row(asked, party, request.spacing, _VEHICLES)


def fits_gap(asked: Asked, gap_m: float, wanted: Length) -> bool:
    """Whether two things are as far apart as is asked for."""
    allowed_m = max(asked.tolerances.spacing_m, asked.tolerances.spacing_share * wanted.high_m)
    return distance_outside(gap_m, wanted.low_m, wanted.high_m) <= allowed_m


def apart_m(one: TrafficAgent, other: TrafficAgent) -> float:
    """From centre to centre."""
    return math.hypot(one.x_m - other.x_m, one.y_m - other.y_m)


def _around_cones(asked: Asked, party: Party, request: ConesRequest) -> Iterator[Finding]:
    wanted = request.spacing if request.reach_m is None else None
    yield from _in_row(asked, party, wanted, _CONES)
    for worker in party.workers:
        if party.agents:
            yield _worker(worker, party)
            if request.post_side is not None:
                yield _worker_side(asked, worker, party, request.post_side)


def _are_apart(cones: Sequence[TrafficAgent]) -> bool:
    """Whether none stands in another, which is a fault of its own and leaves gaps elsewhere."""
    pairs = combinations(cones, 2)
    return all(apart_m(one, other) > one.width_m for one, other in pairs)


def _in_row(asked: Asked, party: Party, wanted: Length | None, template: str) -> Iterator[Finding]:
    """From centre to centre, straight or along the ego's lane: whichever is nearer to the wish."""
    things = party.agents
    if wanted is None or not party.is_exact or len(things) < 2 or not _are_apart(things):
        return
    straight_m = median(
        min(apart_m(one, other) for other in things if other is not one) for one in things
    )
    stations_m = sorted(asked.ahead_m(one) for one in things)
    along_m = median(after - before for before, after in pairwise(stations_m))
    gap_m = min(
        straight_m, along_m, key=lambda m: distance_outside(m, wanted.low_m, wanted.high_m)
    )
    yield Finding(
        kind=FindingKind.ASKED_SPACING,
        severity=severity_of(fits=fits_gap(asked, gap_m, wanted)),
        agents=tuple(one.id for one in things),
        measured={"gap_m": gap_m, "asked_m": wanted.middle_m},
        template=template,
    )


def _worker(worker: TrafficAgent, party: Party) -> Finding:
    nearest = min(party.agents, key=lambda cone: (apart_m(worker, cone), cone.id))
    return Finding(
        kind=FindingKind.ASKED_SPACING,
        severity=severity_of(fits=apart_m(worker, nearest) <= WORKER_M),
        agents=(worker.id, nearest.id),
        measured={"gap_m": apart_m(worker, nearest)},
        template="The worker {agents[0]} is {gap_m:.1f} m from the nearest cone, {agents[1]}.",
    )


def _worker_side(asked: Asked, worker: TrafficAgent, party: Party, side: Side) -> Finding:
    nearest = min(party.agents, key=lambda cone: (apart_m(worker, cone), cone.id))
    left_m = asked.left_m(worker) - asked.left_m(nearest)
    return Finding(
        kind=FindingKind.ASKED_SIDE,
        severity=severity_of(fits=side_of(left_m) == side.value),
        agents=(worker.id, nearest.id),
        measured={"left_m": left_m},
        template=(
            f"The worker {{agents[0]}} stands to the {side_of(left_m)} of {{agents[1]}}; the "
            f"{side.value} is asked for."
        ),
    )


_CONES = "The cones stand {gap_m:.1f} m apart; {asked_m:.1f} m are asked for."
_VEHICLES = "The vehicles stand {gap_m:.1f} m apart; {asked_m:.1f} m are asked for."
