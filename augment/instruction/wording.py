"""Slots of words that many rules share, and the words that mean nothing for a placement."""

from __future__ import annotations

from augment.instruction.intent import Body, LaneChoice, LateralTarget, Side
from augment.instruction.phrases import Phrase, Reader, alternatives, means, phrases
from augment.instruction.quantities import read_angle, read_count, read_length, read_speed

_EGO = phrases(means("ego"), "the? ego vehicle|car? 's?")

_SIDE = phrases(means(Side.LEFT), "left hand?") + phrases(means(Side.RIGHT), "right hand?")

_LANE = (
    phrases(
        means(LaneChoice.OWN),
        "<ego> own? driving|travel? lane",
        "lane of <ego>",
        "own|same|current|its lane",
        "lane <ego> is? in|on",
        "same lane as <ego>",
    )
    + phrases(means(LaneChoice.LEFT), "left hand? neighbouring|neighboring|adjacent? lane")
    + phrases(means(LaneChoice.LEFT), "lane to|on left of <ego>", "lane left of <ego>")
    + phrases(means(LaneChoice.RIGHT), "right hand? neighbouring|neighboring|adjacent? lane")
    + phrases(means(LaneChoice.RIGHT), "lane to|on right of <ego>", "lane right of <ego>")
    + phrases(
        means(LaneChoice.ONCOMING),
        "oncoming|opposite|opposing traffic? lane",
        "lane of|for oncoming|opposite|opposing traffic|vehicles|cars|direction?",
    )
)

_EDGE = "boundary|border|edge|line|marking|side"
_LINE = "boundary|border|line|marking"
_BOUNDARY = (
    phrases(
        means(LateralTarget.LEFT_BOUNDARY),
        f"left hand? lane {_EDGE}",
        f"left hand? {_LINE}",
        f"left hand? {_EDGE} of its? own? <lane>",
        f"left hand? {_EDGE} of lane",
    )
    + phrases(
        means(LateralTarget.RIGHT_BOUNDARY),
        f"right hand? lane {_EDGE}",
        f"right hand? {_LINE}",
        f"right hand? {_EDGE} of its? own? <lane>",
        f"right hand? {_EDGE} of lane",
    )
    + phrases(means(LateralTarget.KERB), "kerb|curb|kerbside|curbside|roadside", "road edge")
    + phrases(means(LateralTarget.KERB), "edge of road|street", "side of road|street")
    + phrases(
        means(LateralTarget.CENTRE_LINE),
        "centre|center line",
        "centerline|centreline of road|street",
        "centre|center|middle line? of road|street",
    )
)

_PLAIN_SIDE = phrases(means(LateralTarget.LEFT_BOUNDARY), "left hand?") + phrases(
    means(LateralTarget.RIGHT_BOUNDARY), "right hand?"
)

_LANE_CENTRE = phrases(
    means("lane centre"),
    "lane centre|center|centerline|centreline point|points|line?",
    "centre|center|centerline|centreline|middle point|points|line? of its? <lane>",
    "centre|center|centerline|centreline|middle point|points|line? of lane",
    "<lane> 's? centre|center|centerline|centreline|middle line?",
)

_BODY = (
    phrases(means(Body.VEHICLE), "vehicle")
    + phrases(means(Body.CAR), "car|automobile|sedan")
    + phrases(means(Body.VAN), "delivery? van", "minivan")
    + phrases(means(Body.TRUCK), "truck|lorry")
    + phrases(means(Body.BUS), "bus|coach")
)

_BODIES = (
    phrases(means(Body.VEHICLE), "vehicles")
    + phrases(means(Body.CAR), "cars|automobiles|sedans")
    + phrases(means(Body.VAN), "delivery? vans", "minivans")
    + phrases(means(Body.TRUCK), "trucks|lorries")
    + phrases(means(Body.BUS), "buses|coaches")
)

_ONCOMING = phrases(
    means("oncoming"),
    "oncoming|opposite|opposing|other traffic? lane|side",
    "lane of|for oncoming|opposite|opposing traffic|vehicles|cars|direction?",
)

_WALKWAY = phrases(
    means("walkway"), "walkway|sidewalk|pavement|footpath|footway|kerb|curb|verge|roadside"
)

_ROAD = phrases(
    means("road"), "road|street|roadway|carriageway|lane|lanes", "<lane>", "path of <ego>"
)

_STANDING = phrases(
    means("standing"),
    "parked|parking|stopped|stationary|standing|stalled|abandoned|immobile|halted",
    "broken down",
)

_THEM = phrases(
    means("them"),
    "them|it|each|neighbours|neighbors",
    "traffic? cone|cones|pylon|pylons",
    "construction|work zone|site|area",
)

SLOTS: dict[str, Reader] = {
    "count": read_count,
    "length": read_length,
    "angle": read_angle,
    "speed": read_speed,
}


def _add(name: str, options: tuple[Phrase, ...]) -> None:
    SLOTS[name] = alternatives(options, SLOTS)


_add("ego", _EGO)
_add("side", _SIDE)
_add("lane", _LANE)
_add("boundary", _BOUNDARY)
_add("plain", _PLAIN_SIDE)
_add("centre", _LANE_CENTRE)
_add("body", _BODY)
_add("bodies", _BODIES)
_add("walkway", _WALKWAY)
_add("road", _ROAD)
_add("standing", _STANDING)
_add("them", _THEM)
_add("oncoming", _ONCOMING)

FILLERS = frozenset(
    word
    for line in (
        "a an the this that these those there it its they them their he she",
        "and as while also then so where which who whose what with",
        "is are was were be being been has have had having do does",
        "should shall will can could would want wants need we you i please kindly just now",
        "add adds adding put puts place places placed insert create generate make",
        "let assume imagine suppose set up stage scene scenario",
    )
    for word in line.split()
)
"""Words that change nothing about a placement; sides, numbers and most prepositions never are."""

MARKS = frozenset(".,;:()!?\"'/“”‘’")
"""Marks that may stand between phrases."""

REFUSED = {
    **dict.fromkeys(
        ("not", "no", "never", "without", "don", "doesn", "isn", "except", "neither", "nor", "t"),
        "negations are not understood",
    ),
    **dict.fromkeys(
        ("remove", "delete", "erase", "clear", "move", "shift", "replace", "swap", "exchange"),
        "only adding to the scene is understood",
    ),
    **dict.fromkeys(("or", "either", "unless", "if"), "alternatives are not understood"),
}
"""Words whose refusal can say more than that the word is unknown."""
