"""Road users and places of a scene as an intent names them, in words that can be translated."""

from __future__ import annotations

from augment.scene.landmarks import LaneChoice, MapPlace, Pick, Relation, Side, Sight
from augment.sentences import Sentence, sentence

MARKS = {
    MapPlace.JUNCTION_START: sentence("the start of the junction"),
    MapPlace.JUNCTION_END: sentence("the end of the junction"),
    MapPlace.CROSSWALK: sentence("the crosswalk"),
}


def state_pick(pick: Pick) -> Sentence:
    """Who is meant: "parked vehicle 2 ahead of the ego, on its left"."""
    kind, where = _KINDS[pick.kind], _RELATIONS[pick.relation]
    if pick.every:
        words = sentence("every %(kind)s %(where)s the ego", kind=kind, where=where)
    else:
        words = sentence(
            "%(kind)s %(ordinal)s %(where)s the ego",
            kind=kind, ordinal=pick.ordinal, where=where,
        )  # fmt: skip
    if pick.side is not None:
        words = sentence("%(who)s, %(side)s", who=words, side=_SIDES[pick.side])
    if pick.lane is not None:
        words = sentence("%(who)s, %(lane)s", who=words, lane=LANES[pick.lane])
    return words


LANES = {
    LaneChoice.OWN: sentence("in the ego's lane"),
    LaneChoice.LEFT: sentence("in the lane on the left"),
    LaneChoice.RIGHT: sentence("in the lane on the right"),
    LaneChoice.ONCOMING: sentence("in the oncoming lane"),
}
_KINDS = {
    Sight.VEHICLE: sentence("vehicle"),
    Sight.PARKED: sentence("parked vehicle"),
    Sight.MOVING: sentence("moving vehicle"),
    Sight.BUS: sentence("bus"),
    Sight.BICYCLE: sentence("bicycle"),
    Sight.PEDESTRIAN: sentence("pedestrian"),
}
_RELATIONS = {Relation.AHEAD: sentence("ahead of"), Relation.BEHIND: sentence("behind")}
_SIDES = {Side.LEFT: sentence("on its left"), Side.RIGHT: sentence("on its right")}
