"""What an instruction asks for, as frozen values; what it does not say stays open (None).

Distances run along the ego's lane, from centre to centre, in metres. Left and right are those of
the ego's direction of travel. Kerb and centre line are named as such here and become left or
right on the map, because people do not drive on one side everywhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from augment.scene.entities import TurnType
from augment.scene.intent_words import (
    Bearing,
    Body,
    Facing,
    LateralTarget,
    Nearness,
    Post,
    Setting,
    Shape,
)
from augment.scene.landmarks import LaneChoice as LaneChoice
from augment.scene.landmarks import MapPlace, Pick
from augment.scene.landmarks import Relation as Relation
from augment.scene.landmarks import Side as Side


@dataclass(frozen=True, slots=True, kw_only=True)
class Length:
    """A length or a range of lengths in metres; `is_approximate` if the sentence says "about"."""

    low_m: float
    high_m: float
    is_approximate: bool = False

    @property
    def is_range(self) -> bool:
        """Whether a value has to be drawn from it."""
        return self.high_m > self.low_m

    def __str__(self) -> str:
        about = "about " if self.is_approximate else ""
        if self.is_range:
            return f"{about}{self.low_m:g} to {self.high_m:g} m"
        return f"{about}{self.low_m:g} m"


@dataclass(frozen=True, slots=True, kw_only=True)
class Lateral:
    """Where across the lane: towards `target`, by `offset` or, without a number, by `nearness`.

    Attributes:
        on_shoulder: The sentence says that it stands (partly) beside the road, so the target has
            to be the kerb's side.
    """

    target: LateralTarget
    offset: Length | None = None
    nearness: Nearness | None = None
    on_shoulder: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Spot:
    """A place: how far along the lane from its anchor, in which lane, where across it.

    Attributes:
        distance: None where no number is said; `relation` alone says on which side then.
        anchor: The name of an earlier request, of whose first object the distance runs; None for
            the ego, as for the two that follow, of which one alone may be given.
        landmark: A road user of the scene of whom the distance runs.
        mark: A place of the map of which the distance runs.
        lane: None where no lane is said, or none is meant (walks).
        lateral: Where across the lane; None where nothing is said.
    """

    distance: Length | None = None
    relation: Relation | None = None
    anchor: str | None = None
    landmark: Pick | None = None
    mark: MapPlace | None = None
    lane: LaneChoice | None = None
    lateral: Lateral | None = None
    settings: tuple[Setting, ...] = ()

    @property
    def span_m(self) -> tuple[float, float] | None:
        """From where to where along the lane, behind the anchor negative; None where open."""
        if self.relation is None:
            return None
        low_m, high_m = 0.0, math.inf
        if self.distance is not None:
            low_m, high_m = self.distance.low_m, self.distance.high_m
        return (low_m, high_m) if self.relation is Relation.AHEAD else (-high_m, -low_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleRequest:
    """Vehicles that stand (speed 0) or move; the first of them at the spot.

    Attributes:
        name: What an anchor calls it by; empty where none does. So for all requests.
        turn_deg: On top of `facing`, positive to the left.
        count: More than one stand in a row along the lane, each further one further on.
        spacing: Between the centres of neighbours in a row.
    """

    spot: Spot = Spot()
    name: str = ""
    body: Body = Body.VEHICLE
    facing: Facing | None = None
    turn_deg: float = 0.0
    speed_mps: float | None = None
    count: int | None = None
    spacing: Length | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class WalkRequest:
    """Pedestrians who cross the road, side by side; the first of them at the spot.

    Attributes:
        start: From which side; they cross to the other.
        drift_m: How much further along the lane a walk ends than it begins.
        is_file: They walk one behind the other.
        behind: How far behind the first one the others walk in a file, where that is said.
        on_road: The first one stands in the ego's lane already.
    """

    spot: Spot = Spot()
    name: str = ""
    start: Side | None = None
    count: int | None = None
    speed_mps: float | None = None
    drift_m: float | None = None
    is_file: bool = False
    behind: tuple[Length, ...] = ()
    on_road: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ConesRequest:
    """Cones in a shape, and a worker or none.

    Attributes:
        spot: Of the first cone, or of a ring's centre.
        start: The lane boundary at which a taper begins.
        ends_in_middle: A taper ends in the middle of the lane, not at its other boundary.
        both_sides: A line of `count` cones along each boundary of the lane.
        reach_m: From the first cone to the last along the lane, None where the spacing says it.
        post: Where the worker stands.
        post_side: To which side of the cones.
    """

    spot: Spot = Spot()
    name: str = ""
    shape: Shape | None = None
    count: int | None = None
    spacing: Length | None = None
    start: Side | None = None
    ends_in_middle: bool = False
    both_sides: bool = False
    reach_m: float | None = None
    has_worker: bool = False
    post: Post | None = None
    post_side: Side | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class CrashedCar:
    """A further vehicle of an accident, against the one named before it.

    Attributes:
        gap: Between the two centres.
        bearing: Where it stands, seen from the one before.
        turn_deg: Against the one before, positive to the left.
        is_signed: The sentence names the side that it is turned to.
    """

    gap: Length | None = None
    bearing: Bearing | None = None
    turn_deg: float | None = None
    is_signed: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class CrashRequest:
    """Vehicles that have run into each other, and stand; the spot is that of the first.

    Attributes:
        facing: Of the first one, against its lane.
        others: What is said of the further ones in order; none where it is left open.
    """

    spot: Spot = Spot()
    name: str = ""
    count: int | None = None
    body: Body = Body.CAR
    facing: Facing | None = None
    others: tuple[CrashedCar, ...] = ()


Request = VehicleRequest | WalkRequest | ConesRequest | CrashRequest


@dataclass(frozen=True, slots=True, kw_only=True)
class Move:
    """A road user of the scene that is to stand or drive elsewhere.

    Attributes:
        spot: Where it belongs; the sides and distances are as for what is added.
        speed_mps: None where it keeps its speed.
    """

    who: Pick
    spot: Spot
    facing: Facing | None = None
    turn_deg: float = 0.0
    speed_mps: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Intent:
    """All that was asked for.

    Attributes:
        requests: What is to be added.
        moves: Who of the scene is to be elsewhere.
        removals: Who of the scene is to go.
        route: Where the way leads along which the distances run, where it first parts.
        unmet: Why the wish can't be met in its scene; then nothing else is asked for, and the
            right outcome is a refusal. Empty where it can be met.
        beyond: Parts of the sentence that these fields can't hold, in its own words.
    """

    requests: tuple[Request, ...] = ()
    moves: tuple[Move, ...] = ()
    removals: tuple[Pick, ...] = ()
    route: TurnType = TurnType.STRAIGHT
    unmet: str = ""
    beyond: tuple[str, ...] = ()


def resolve_anchors(intent: Intent) -> Intent:
    """The intent with every distance from the ego: anchors' distances are added up.

    The anchor's own spot must come before it; its distance is open where the anchor's is.
    """
    spots: dict[str, Spot] = {}
    resolved: list[Request] = []
    for request in intent.requests:
        spot = request.spot
        if spot.anchor is not None:
            spot = from_ego(spot, spots[spot.anchor])
        spots[request.name] = spot
        resolved.append(replace(request, spot=spot))
    return replace(intent, requests=tuple(resolved))


def from_ego(spot: Spot, anchor: Spot) -> Spot:
    """A spot that counts from another, counted from the ego; open where either is."""
    own, base = spot.span_m, anchor.span_m
    if own is None or base is None or not math.isfinite(sum((*own, *base))):
        return replace(spot, anchor=None, distance=None, relation=None)
    low_m, high_m = own[0] + base[0], own[1] + base[1]
    is_ahead = low_m + high_m >= 0.0
    is_approximate = any(one.distance and one.distance.is_approximate for one in (spot, anchor))
    return replace(
        spot,
        anchor=None,
        relation=Relation.AHEAD if is_ahead else Relation.BEHIND,
        distance=Length(
            low_m=low_m if is_ahead else -high_m,
            high_m=high_m if is_ahead else -low_m,
            is_approximate=is_approximate,
        ),
    )
