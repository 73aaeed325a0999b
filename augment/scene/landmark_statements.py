"""Road users and places of a scene as an intent names them, in words that can be translated."""

from __future__ import annotations

from augment.scene.intent import LaneChoice, MapPlace, Pick, Relation, Side, Sight

MARKS = {
    MapPlace.JUNCTION_START: "the start of the junction",
    MapPlace.JUNCTION_END: "the end of the junction",
    MapPlace.CROSSWALK: "the crosswalk",
}


def state_pick(pick: Pick) -> str:
    """Who is meant: "parked vehicle 2 ahead of the ego, on its left"."""
    kind, where = _KINDS[pick.kind], _RELATIONS[pick.relation]
    if pick.every:
        words = f"every {kind} {where} the ego"
    else:
        words = f"{kind} {pick.ordinal} {where} the ego"  # fmt: skip
    if pick.side is not None:
        words = f"{words}, {_SIDES[pick.side]}"
    if pick.lane is not None:
        words = f"{words}, {LANES[pick.lane]}"
    return words


LANES = {
    LaneChoice.OWN: "in the ego's lane",
    LaneChoice.LEFT: "in the lane on the left",
    LaneChoice.RIGHT: "in the lane on the right",
    LaneChoice.ONCOMING: "in the oncoming lane",
}
_KINDS = {
    Sight.VEHICLE: "vehicle",
    Sight.PARKED: "parked vehicle",
    Sight.MOVING: "moving vehicle",
    Sight.BUS: "bus",
    Sight.BICYCLE: "bicycle",
    Sight.PEDESTRIAN: "pedestrian",
}
_RELATIONS = {Relation.AHEAD: "ahead of", Relation.BEHIND: "behind"}
_SIDES = {Side.LEFT: "on its left", Side.RIGHT: "on its right"}
