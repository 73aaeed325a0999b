"""Slots of words that many rules share."""

from __future__ import annotations

from augment.instruction.facts import Rank
from augment.instruction.intent import Body, LaneChoice, LateralTarget, Side
from augment.instruction.phrases import Phrase, Reader, alternatives, means, phrases
from augment.instruction.quantities import read_angle, read_count, read_length, read_speed

_EGO = phrases(
    means("ego"),
    "the? ego vehicle|car? 's?",
    "our|my|your own? vehicle|car 's?",
    "us|our|my|me|ourselves|ours|mine|you|your|yours|ego|egos",
    "the? av|adv|sdc|avs 's?",
    "the? test|host|subject|own|automated|autonomous|driverless|robot vehicle|car|taxi 's?",
    "the? self driving|driven car|vehicle 's?",
)

_SIDE = phrases(
    means(Side.LEFT), "left hand?", "nearside left", "leftwards|leftward|lefthand"
) + phrases(means(Side.RIGHT), "right hand?", "rightwards|rightward|righthand")

_LANE = (
    phrases(
        means(LaneChoice.OWN),
        "<ego> own? driving|travel? lane",
        "lane of <ego>",
        "own|same|current|its lane",
        "its|his|her|our|my own lane",
        "lane that|which? it is? driving|using|travelling|traveling|moving|on in|along?",
        "lane that|which? <ego> is using|following|on",
        "lane that|which? <ego> is? driving|travelling|traveling|moving? in|on|along|down",
        "lane in|on which <ego> is? driving|drives|travelling|travels|moving|moves",
        "lane that|which? <ego> uses|occupies|follows",
        "lane used|occupied by <ego>",
        "same lane as <ego>",
        "driving|travel|traffic lane of <ego>",
    )
    + phrases(means(LaneChoice.LEFT), "left hand? neighbouring|neighboring|adjacent? lane")
    + phrases(means(LaneChoice.LEFT), "lane to|on left of <ego>", "lane left of <ego>")
    + phrases(means(LaneChoice.RIGHT), "right hand? neighbouring|neighboring|adjacent? lane")
    + phrases(means(LaneChoice.RIGHT), "lane to|on right of <ego>", "lane right of <ego>")
    + phrases(
        means(LaneChoice.ONCOMING),
        "oncoming|opposite|opposing|other traffic|direction? lane",
        "lane of|for oncoming|opposite|opposing traffic|vehicles|cars|direction?",
    )
)

_EDGE = "boundary|border|edge|line|marking|side|limit|kerb|curb|half"
_LINE = "boundary|border|line|marking|edge|limit"
_WAYSIDE = "kerb|curb|kerbside|curbside|roadside|nearside|verge"
_BOUNDARY = (
    phrases(
        means(LateralTarget.LEFT_BOUNDARY),
        f"left hand? lane {_EDGE}",
        f"left hand? {_LINE}",
        f"left hand? {_EDGE} of its? own? <lane>",
        f"left hand? {_EDGE} of lane|road|street|carriageway",
        f"left hand? {_WAYSIDE} side? of? road|street|lane?",
    )
    + phrases(
        means(LateralTarget.RIGHT_BOUNDARY),
        f"right hand? lane {_EDGE}",
        f"right hand? {_LINE}",
        f"right hand? {_EDGE} of its? own? <lane>",
        f"right hand? {_EDGE} of lane|road|street|carriageway",
        f"right hand? {_WAYSIDE} side? of? road|street|lane?",
    )
    + phrases(
        means(LateralTarget.KERB),
        _WAYSIDE,
        f"{_WAYSIDE} side? {_EDGE} of? <lane>?",
        f"{_WAYSIDE} side? {_EDGE} of lane|road|street",
        "road|roadside|outer|outside edge|side of? <lane>?",
        "edge|side of road|street|carriageway|roadway",
        "edge|side of road|street|carriageway|roadway on kerb|curb side",
    )
    + phrases(
        means(LateralTarget.CENTRE_LINE),
        "centre|center|dividing|median line|marking",
        "road|street centre|center line",
        "centerline|centreline of road|street|carriageway|roadway",
        "centre|center|middle line? of road|street|carriageway|roadway",
        "line between lanes|directions",
        "inner|inside edge|side of? <lane>?",
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
    "its centre|center|middle|midpoint",
    "centre|center|middle of it",
    "lane 's centre|center|centerline|centreline|middle line?",
    "centre|center|centerline|centreline|middle|midline|midpoint",
    "lane 's? midline|midpoint|axis",
    "midline|midpoint|axis of its? <lane>",
    "midline|midpoint|axis of lane",
    "very|exact|dead centre|center|middle of? <lane>?",
    "very|exact|dead centre|center|middle of lane",
)

_BODY = (
    phrases(means(Body.VEHICLE), "vehicle")
    + phrases(
        means(Body.CAR),
        "passenger|private|police|family|sports|estate? car",
        "automobile|sedan|hatchback|suv|taxi|cab|saloon|motorcar|taxicab|limousine|limo|jeep",
        "estate|convertible|cabriolet|roadster|coupe|pickup|crossover|minicab|supermini",
        "station wagon",
        "pick up truck?",
        "pickup truck",
        "off roader",
    )
    + phrases(
        means(Body.VAN),
        "delivery|parcel|post|transport|mail|moving|removal|builder|panel? van",
        "minivan|transporter|minibus|camper|campervan|motorhome|ambulance",
    )
    + phrases(
        means(Body.TRUCK),
        "delivery|box|dump|garbage|refuse|fire|moving|removal|heavy|semi? truck|lorry",
        "hgv|dustcart|juggernaut",
        "fire engine",
        "heavy goods vehicle",
        "bin lorry",
    )
    + phrases(means(Body.BUS), "city|school|public|tour|transit|shuttle|tourist|passenger? bus")
    + phrases(means(Body.BUS), "tour|tourist? coach", "omnibus", "double decker bus?")
)

_BODIES = (
    phrases(means(Body.VEHICLE), "vehicles")
    + phrases(
        means(Body.CAR),
        "passenger|private|police? cars|automobiles|sedans|hatchbacks|suvs|taxis|cabs|saloons",
        "motorcars|limousines|jeeps|pickups|estates|coupes|convertibles",
    )
    + phrases(means(Body.VAN), "delivery? vans|minivans|transporters|minibuses")
    + phrases(means(Body.TRUCK), "delivery? trucks|lorries")
    + phrases(means(Body.BUS), "city|school? buses|coaches|busses")
)

_ONCOMING = phrases(
    means("oncoming"),
    "oncoming|opposite|opposing|other traffic? lane|side",
    "lane of|for oncoming|opposite|opposing traffic|vehicles|cars|direction?",
)

_WALKWAY = phrases(
    means("walkway"),
    "walkway|sidewalk|pavement|footpath|footway|kerb|curb|verge|roadside|walkside|promenade",
    "edge|side of road|street",
)

_ROAD = phrases(
    means("road"),
    "<ego> road|street|carriageway|roadway|side",
    "whole|entire|full? road|street|roadway|carriageway|lane|lanes|avenue|boulevard|way",
    "<lane>",
    "<ego>? path",
    "path of <ego>",
    "both|all|two lanes",
)

_STANDING = phrases(
    means("standing"),
    "parked|parking|stopped|stationary|standing|stalled|abandoned|immobile|halted|waiting|idle",
    "stranded|immobilised|immobilized|idling|unattended|broken|inoperable",
    "clumsily|awkwardly|inconsiderately parked",
    "badly|carelessly|illegally|improperly|poorly|double|wrongly parked",
    "broken down",
    "disabled|unmoving|motionless|static",
)

_PARKED = phrases(
    means("parked"),
    "parked|parking cars|vehicles|row|line|ones",
    "row|rows|line|lines of parked|parking? cars|vehicles",
    "parking row|rows|space|bay|spot|lot",
)

_THEM = phrases(
    means("them"),
    "them|it|each|neighbours|neighbors|neighbouring|adjacent|consecutive traffic? cone|cones?",
    "each|every|two traffic? cone|cones",
    "each|every of? them|two|pair",
    "traffic? cone|cones|pylon|pylons",
    "line|row|taper|ring|circle of? cones|pylons?",
    "ones|rest|others",
    "construction|work zone|site|area",
    "roadworks|works|barrier|closure",
)

_ONE = "one|car|vehicle|cone|pylon|pedestrian|person|walker|bus|van|truck"
_NEIGHBOUR = (
    phrases(
        means("it"), "it|him|her|them|that|two|cars|vehicles", "bus|car|van|truck|vehicle|lorry"
    )
    + phrases(means("it"), "each|one other|another")
    + phrases(means(Rank.FIRST), f"first|nearest|nearer|closest|former|leading {_ONE}?", "leader")
    + phrases(means(Rank.SECOND), f"second {_ONE}?")
    + phrases(means(Rank.THIRD), f"third {_ONE}?")
    + phrases(means(Rank.OTHER), f"other|previous|preceding|last|latter {_ONE}?")
)

_AHEAD = phrases(means("ahead"), "ahead|forward of? <ego>?", "in front of? <ego>?", "from <ego>")

SLOT_WORDS: set[str] = set()
"""The words that the slots read, numbers and units apart."""

SLOTS: dict[str, Reader] = {
    "count": read_count,
    "length": read_length,
    "angle": read_angle,
    "speed": read_speed,
}


def _add(name: str, options: tuple[Phrase, ...]) -> None:
    SLOTS[name] = alternatives(options, SLOTS)
    SLOT_WORDS.update(word for one in options for piece in one.pieces for word in piece.words)


_add("ego", _EGO)
_add("us", phrases(means("ego"), "we", "<ego>"))
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
_add("ahead", _AHEAD)
_add("obstacle", phrases(means("it"), "it|them|him|her|this|that|obstacle", "the"))
_add("neighbour", _NEIGHBOUR)
_add("parked", _PARKED)
_add("them", _THEM)
_add("oncoming", _ONCOMING)
