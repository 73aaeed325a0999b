"""What the rule placer has placed, in sentences for a page, and its conventions for the rest."""

from __future__ import annotations

from collections.abc import Iterator

from augment.baselines.rule_placer_cones import CONE_SPACING_M
from augment.baselines.rule_placer_vehicles import BUMPER_GAP_M, SLIGHT_OFFSET_M
from augment.baselines.rule_placer_walkers import APART_M
from augment.scene.intent import (
    Body,
    ConesRequest,
    CrashRequest,
    LaneChoice,
    Lateral,
    LateralTarget,
    Nearness,
    Relation,
    Request,
    Shape,
    VehicleRequest,
    WalkRequest,
)

_LANES = {
    None: "the ego's lane",
    LaneChoice.OWN: "the ego's lane",
    LaneChoice.LEFT: "the lane on the left",
    LaneChoice.RIGHT: "the lane on the right",
    LaneChoice.ONCOMING: "the oncoming lane",
}


def describe(request: Request, distance_m: float, *, across_m: float) -> str:
    """One sentence: what stands where.

    Args:
        request: What was asked for.
        distance_m: Where it came to stand along the ego's lane, by its size.
        across_m: How far from the centre of its lane, for a vehicle.
    """
    relation = "ahead of" if request.spot.relation is Relation.AHEAD else "behind"
    where = (
        f"{distance_m:.1f} m {relation} the ego along its lane{_why_there(request, distance_m)}"
    )
    lane = _LANES[request.spot.lane]
    match request:
        case VehicleRequest():
            motion = f"driving at {request.speed_mps:.1f} m/s" if request.speed_mps else "standing"
            across = _across(request.spot.lateral, abs(across_m))
            return f"A {request.body}, {motion}, {where}, in {lane}, {across}."
        case WalkRequest():
            who = "A pedestrian" if request.count == 1 else f"{request.count} pedestrians"
            end = request.start.other if request.start else "other side"
            return f"{who}, {where}, crossing the road from the {request.start} to the {end}."
        case ConesRequest():
            worker = " and one worker" if request.has_worker else ""
            return f"{request.count} cones in a {request.shape}{worker}, {where}, in {lane}."
        case CrashRequest():
            plural = "buses" if request.body is Body.BUS else f"{request.body}s"
            return f"{request.count} crashed {plural}, the nearest {where}, in {lane}."


def name_of(request: Request) -> str:
    """What a request is about, in one word."""
    match request:
        case VehicleRequest():
            return "vehicles"
        case WalkRequest():
            return "pedestrians"
        case ConesRequest():
            return "cones"
        case CrashRequest():
            return "crashed vehicles"


def list_conventions(request: Request) -> Iterator[str]:
    """What fills the open parts of a request, where it is no refusal."""
    if request.spot.lane is None and not isinstance(request, WalkRequest):
        yield "in the ego's lane"
    match request:
        case VehicleRequest():
            yield from _vehicle_conventions(request)
        case WalkRequest():
            if len(request.behind) + 1 < (request.count or 0):
                yield f"{APART_M:g} m from one to the next"
        case ConesRequest():
            yield from _cone_conventions(request)
        case CrashRequest():
            yield from _crash_conventions(request)


def _vehicle_conventions(request: VehicleRequest) -> Iterator[str]:
    yield from _across_conventions(request.spot.lateral)
    if request.facing is None:
        yield "facing as the lane leads"
    if request.spacing is None and request.count != 1:
        yield f"{BUMPER_GAP_M:g} m from bumper to bumper"


def _cone_conventions(request: ConesRequest) -> Iterator[str]:
    if request.spacing is None and request.reach_m is None:
        yield f"{CONE_SPACING_M:g} m between the cones"
    if request.shape is Shape.TAPER and request.start is None:
        yield "the taper begins at the kerb's side of the lane"
    if request.has_worker and request.post is None and request.shape is not Shape.RING:
        yield "the worker stands where people do at such a shape"


def _crash_conventions(request: CrashRequest) -> Iterator[str]:
    if not any(other.turn_deg is not None for other in request.others):
        yield "the angles between them"
    if not request.others or any(other.gap is None for other in request.others):
        yield "as near as they come without sharing ground"


def _across_conventions(lateral: Lateral | None) -> Iterator[str]:
    if lateral is None:
        yield "in the middle of the lane"
    elif (
        lateral.target is not LateralTarget.LANE_CENTRE
        and lateral.offset is None
        and lateral.nearness in (None, Nearness.SLIGHTLY)
    ):
        yield f"slightly is {SLIGHT_OFFSET_M:g} m"


def _why_there(request: Request, distance_m: float) -> str:
    """A remark where the distance is not simply the one that is asked for."""
    asked = request.spot.distance
    if asked is None:
        return ""
    if asked.is_range:
        return f" (drawn from {asked})"
    if abs(distance_m - asked.low_m) > 0.01:
        return f" (moved from {asked.low_m:g} m, where it had no room)"
    return ""


def _across(lateral: Lateral | None, offset_m: float) -> str:
    if lateral is None or lateral.target is LateralTarget.LANE_CENTRE:
        return "on the lane centre"
    drawn = lateral.offset is not None and lateral.offset.is_range
    remark = f" (drawn from {lateral.offset})" if drawn else ""
    return f"{offset_m:.2f} m{remark} from the lane centre towards the {lateral.target}"
