"""An understood intent as claims about the agents of a modification.

Agents are taken in the order of the requests, each request from the added ones of its type.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import pairwise

from augment.instruction.intent import (
    Body,
    ConesRequest,
    CrashRequest,
    Facing,
    Intent,
    LateralTarget,
    Length,
    Relation,
    Shape,
    Side,
    Spot,
    VehicleRequest,
    WalkRequest,
)
from augment.scene.claims import Claim, ClaimKind
from augment.scene.entities import AgentType, TrafficSide
from augment.scene.modification import Modification

_FACING_DEG = {Facing.WITH_LANE: 0.0, Facing.AGAINST_LANE: 180.0}


def claims_of(intent: Intent, modification: Modification, side: TrafficSide) -> tuple[Claim, ...]:
    """What the intent says, about the modification's added agents.

    Ranges and words without numbers ("slightly") give no claim; a lane other than the ego's
    gives none across it.

    Args:
        intent: What was understood.
        modification: Whose agents are named.
        side: Where people drive: it says which boundary is the kerb's.
    """
    reader = _Reader(modification, side)
    return tuple(claim for request in intent.requests for claim in reader.read(request)) + tuple(
        Claim(kind=ClaimKind.COUNT, type=kind, value=float(number))
        for kind, number in sorted(reader.counts.items())
    )


class _Reader:
    """Reads requests one after another; knows which agents are taken already."""

    def __init__(self, modification: Modification, side: TrafficSide) -> None:
        self.counts: Counter[AgentType] = Counter()
        self._names = {
            kind: [one.id for one in modification.added if one.type is kind] for kind in AgentType
        }
        self._kerb = 1.0 if side is TrafficSide.LEFT else -1.0

    def read(
        self, request: VehicleRequest | WalkRequest | ConesRequest | CrashRequest
    ) -> Iterator[Claim]:
        """The claims of one request; none where the modification has too few agents."""
        if isinstance(request, VehicleRequest):
            yield from self._vehicle(request)
        elif isinstance(request, WalkRequest):
            yield from self._walkers(request)
        elif isinstance(request, ConesRequest):
            yield from self._cones(request)
        else:
            yield from self._crash(request)

    def _take(self, kind: AgentType, number: int) -> tuple[str, ...]:
        first = self.counts[kind]
        self.counts[kind] += number
        return tuple(self._names[kind][first : first + number])

    def _vehicle(self, request: VehicleRequest) -> Iterator[Claim]:
        kind = AgentType.BUS if request.body is Body.BUS else AgentType.VEHICLE
        names = self._take(kind, request.count)
        yield from _ahead(request.spot, names[:1])
        for name in names:
            yield from self._lateral(request.spot, (name,))
            if request.facing in _FACING_DEG:
                turn_deg = _FACING_DEG[request.facing] + request.turn_deg
                yield Claim(kind=ClaimKind.TURN, value=turn_deg, agents=(name,))

    def _walkers(self, request: WalkRequest) -> Iterator[Claim]:
        names = self._take(AgentType.PEDESTRIAN, request.count)
        yield from _ahead(request.spot, names[:1])
        value = 1.0 if request.start is Side.LEFT else -1.0
        for name in names:
            yield Claim(kind=ClaimKind.CROSSES_FROM, value=value, agents=(name,))
            if request.drift_m:
                yield Claim(kind=ClaimKind.WALKS_ON, value=request.drift_m, agents=(name,))
        for name, behind in zip(names[1:], request.behind, strict=False):
            if not behind.is_range:
                yield Claim(kind=ClaimKind.GAP, value=behind.low_m, agents=(names[0], name))

    def _cones(self, request: ConesRequest) -> Iterator[Claim]:
        rows = 2 if request.both_sides else 1
        names = self._take(AgentType.TRAFFIC_CONE, request.count * rows)[: request.count]
        if request.has_worker:
            self._take(AgentType.PEDESTRIAN, 1)
        yield from _ahead(request.spot, names if request.shape is Shape.RING else names[:1])
        if not request.spacing.is_range and request.reach_m is None:
            yield Claim(kind=ClaimKind.SPACING, value=request.spacing.low_m, agents=names)

    def _crash(self, request: CrashRequest) -> Iterator[Claim]:
        names = self._take(AgentType.VEHICLE, request.count)
        yield from _ahead(request.spot, names[:1])
        if request.turn_deg is not None:
            yield Claim(kind=ClaimKind.TURNED_APART, value=abs(request.turn_deg), agents=names)
        for other, pair in zip(request.others, pairwise(names), strict=False):
            if request.turn_deg is None and other.turn_deg is not None:
                value = abs(other.turn_deg)
                yield Claim(kind=ClaimKind.TURNED_APART, value=value, agents=pair)
            if other.gap is not None and not other.gap.is_range:
                yield Claim(kind=ClaimKind.GAP, value=other.gap.low_m, agents=pair)

    def _lateral(self, spot: Spot, names: tuple[str, ...]) -> Iterator[Claim]:
        offset = spot.lateral.offset
        if offset is None or offset.is_range:
            return
        signs = {
            LateralTarget.LEFT_BOUNDARY: 1.0,
            LateralTarget.RIGHT_BOUNDARY: -1.0,
            LateralTarget.KERB: self._kerb,
            LateralTarget.CENTRE_LINE: -self._kerb,
            LateralTarget.LANE_CENTRE: 0.0,
        }
        value = signs[spot.lateral.target] * offset.low_m
        yield Claim(kind=ClaimKind.LEFT, value=value, agents=names)


def _ahead(spot: Spot, names: tuple[str, ...]) -> Iterator[Claim]:
    distance: Length = spot.distance
    if not distance.is_range and spot.relation is Relation.AHEAD:
        yield Claim(kind=ClaimKind.AHEAD, value=distance.low_m, agents=names)
