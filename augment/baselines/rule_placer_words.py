"""What the rule placer has placed, in a sentence for a page."""

from __future__ import annotations

from augment.instruction.intent import (
    Body,
    ConesRequest,
    CrashRequest,
    LaneChoice,
    LateralTarget,
    Relation,
    Request,
    VehicleRequest,
    WalkRequest,
)

_LANES = {
    LaneChoice.OWN: "the ego's lane",
    LaneChoice.LEFT: "the lane on the left",
    LaneChoice.RIGHT: "the lane on the right",
    LaneChoice.ONCOMING: "the oncoming lane",
}


def described(request: Request, distance_m: float, *, across_m: float) -> str:
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
            across = _across(request, abs(across_m))
            return f"A {request.body}, {motion}, {where}, in {lane}, {across}."
        case WalkRequest():
            who = "A pedestrian" if request.count == 1 else f"{request.count} pedestrians"
            return (
                f"{who}, {where}, crossing the road from the {request.start} "
                f"to the {request.start.other}."
            )
        case ConesRequest():
            worker = " and one worker" if request.has_worker else ""
            return f"{request.count} cones in a {request.shape}{worker}, {where}, in {lane}."
        case CrashRequest():
            plural = "buses" if request.body is Body.BUS else f"{request.body}s"
            return f"{request.count} crashed {plural}, the nearest {where}, in {lane}."


def _why_there(request: Request, distance_m: float) -> str:
    """A remark where the distance is not simply the one in the sentence."""
    asked = request.spot.distance
    if asked.is_range:
        return f" (drawn from {asked})"
    if abs(distance_m - asked.low_m) > 0.01:
        return f" (moved from {asked.low_m:g} m, where it had no room)"
    return ""


def _across(request: VehicleRequest, offset_m: float) -> str:
    lateral = request.spot.lateral
    if lateral.target is LateralTarget.LANE_CENTRE:
        return "on the lane centre"
    drawn = lateral.offset is not None and lateral.offset.is_range
    remark = f" (drawn from {lateral.offset})" if drawn else ""
    return f"{offset_m:.2f} m{remark} from the lane centre towards the {lateral.target}"
