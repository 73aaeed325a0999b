"""What the rule placer has placed, in a sentence for a page."""

from __future__ import annotations

from augment.instruction.intent import (
    ConesRequest,
    CrashRequest,
    LaneChoice,
    LateralTarget,
    Nearness,
    Relation,
    Request,
    VehicleRequest,
    WalkRequest,
)
from augment.scene.entities import TrafficAgent

_LANES = {
    LaneChoice.OWN: "the ego's lane",
    LaneChoice.LEFT: "the lane on the left",
    LaneChoice.RIGHT: "the lane on the right",
    LaneChoice.ONCOMING: "the oncoming lane",
}


def described(request: Request, distance_m: float, agents: tuple[TrafficAgent, ...]) -> str:
    """One sentence: what stands where. `distance_m` is along the ego's lane."""
    relation = "ahead of" if request.spot.relation is Relation.AHEAD else "behind"
    where = f"{distance_m:.1f} m {relation} the ego along its lane"
    lane = _LANES[request.spot.lane]
    match request:
        case VehicleRequest():
            motion = f"driving at {request.speed_mps:g} m/s" if request.speed_mps else "standing"
            return f"A {request.body}, {motion}, {where}, in {lane}, {_across(request)}."
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
            return f"{request.count} crashed {request.body}s, the nearest {where}, in {lane}."


def _across(request: VehicleRequest) -> str:
    lateral = request.spot.lateral
    if lateral.target is LateralTarget.LANE_CENTRE:
        return "on the lane centre"
    if lateral.offset is not None:
        return f"{lateral.offset} from the lane centre towards the {lateral.target}"
    words = {
        Nearness.SLIGHTLY: "slightly towards",
        Nearness.AT_EDGE: "at",
        Nearness.HALF_OUT: "half beyond",
        Nearness.OUTSIDE: "beyond",
    }[lateral.nearness]
    return f"{words} the {lateral.target}"
