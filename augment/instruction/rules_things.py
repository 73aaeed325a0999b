"""Rules about what: the nouns, what they do, and how they stand together."""

from __future__ import annotations

from augment.instruction.facts import (
    Crashed,
    Crosses,
    Faces,
    Fact,
    InLane,
    Kind,
    Mention,
    Moving,
    Sides,
    Standing,
    Thing,
    Turned,
)
from augment.instruction.intent import Body, Facing, LaneChoice, Side
from augment.instruction.phrases import Build, Found, means, phrases
from augment.instruction.quantities import Angle, Speed

_WALKER = "pedestrian|person|walker"
_WALKERS = "pedestrians|persons|people|walkers"
_CRASHED = "crashed|collided|wrecked"
_MOVING = "moving|driving|travelling|traveling|going|approaching|moves|drives|approaches|goes"
_ACCIDENT = "accident|crash|collision|pileup"


def thing(kind: Kind, *more: Fact) -> Build:
    """A build for a noun with an optional count, and what else its phrase says."""
    return lambda found: (Thing(kind=kind, count=found.maybe("count", int)), *more)


def that(kind: Kind) -> Build:
    """A build for a noun with "the": something that was named before."""
    return means((Thing(kind=kind, is_definite=True),))


def _many(kind: Kind, *more: Fact) -> Build:
    """A build for a plural noun, with or without its number."""
    return lambda found: (
        Thing(kind=kind, count=found.maybe("count", int), is_plural=True),
        *more,
    )


def _vehicle(found: Found) -> tuple[Fact, ...]:
    plural = found.maybe("bodies", Body)
    thing = Thing(
        kind=Kind.VEHICLE,
        count=found.maybe("count", int),
        body=plural or found.get("body", Body),
        is_plural=plural is not None,
    )
    return (thing, Standing()) if found.maybe("standing", str) else (thing,)


def _that_vehicle(found: Found) -> tuple[Fact, ...]:
    body = found.maybe("bodies", Body) or found.get("body", Body)
    thing = Thing(kind=Kind.VEHICLE, body=body, is_definite=True)
    return (thing, Standing()) if found.maybe("standing", str) else (thing,)


def _oncoming_vehicle(found: Found) -> tuple[Fact, ...]:
    return (*_vehicle(found), InLane(LaneChoice.ONCOMING), Moving())


def _crash(found: Found) -> tuple[Fact, ...]:
    count, body = found.maybe("count", int), found.maybe("bodies", Body)
    return (Thing(kind=Kind.CRASH, count=count, body=body), Crashed())


VEHICLES = (
    phrases(_vehicle, "<count>? <standing>? <body>", "<count>? <standing>? <bodies>")
    + phrases(
        _that_vehicle, "the|this|that <standing>? <body>", "the|these|those <standing>? <bodies>"
    )
    + phrases(_oncoming_vehicle, "<count>? oncoming <body>", "<count>? oncoming <bodies>")
)

CRASHES = phrases(
    _crash,
    f"<count> {_CRASHED} <bodies>",
    f"car|traffic? {_ACCIDENT} site|scene?",
    f"car|traffic? {_ACCIDENT} site|scene? of|between|with|involving <count> {_CRASHED}? <bodies>",
    f"<count> <body> {_ACCIDENT}",
) + phrases(
    means((Crashed(),)),
    "have|has|had|are|just? crashed|collided",
    "has|have? happened|occurred",
    "have|has|had|are|just? crashed|collided into|with it|each|one other|another?",
    "jammed|pushed|wedged|leaning|stuck against|into it",
    "jammed|pushed|wedged|leaning|stuck against|into each|one other|another",
)

PEDESTRIANS = (
    phrases(thing(Kind.PEDESTRIAN), f"<count>? {_WALKER}")
    + phrases(_many(Kind.PEDESTRIAN), f"<count>? {_WALKERS}", f"group of <count> {_WALKERS}")
    + phrases(
        thing(Kind.PEDESTRIAN, Crosses()),
        "<count>? jaywalker",
        f"<count>? jaywalking|crossing {_WALKER}",
    )
    + phrases(
        _many(Kind.PEDESTRIAN, Crosses()),
        "<count>? jaywalkers",
        f"<count>? jaywalking|crossing {_WALKERS}",
        f"group of <count> jaywalking|crossing {_WALKERS}",
        "group of <count> jaywalkers",
    )
    + phrases(
        that(Kind.PEDESTRIAN), f"the {_WALKER}", f"the {_WALKERS}", "the jaywalker|jaywalkers"
    )
)

_CROSS = "cross|crosses|crossing|jaywalks|jaywalking|jaywalk"
_WALK = "walk|walks|walking|step|steps|stepping|run|runs|running|go|goes|going|come|comes|coming"


def _sides(found: Found) -> tuple[Fact, ...]:
    return (Sides(found.maybe("start", Side), found.maybe("end", Side)),)


_EDGE = "side|kerb|curb|walkway|sidewalk|pavement|edge"

CROSSING = phrases(
    means((Crosses(),)),
    f"{_CROSS} <road>?",
    f"{_CROSS} in front of <ego>",
    f"{_WALK} across|over <road>",
    f"{_WALK} onto|into <road>",
) + phrases(
    _sides,
    f"from? <start:side> {_EDGE}? to <end:side> {_EDGE}? one?",
    f"from? <start:side> {_EDGE}? of road|street to <end:side> {_EDGE}? of? road|street?",
    f"from? <start:side> {_EDGE}? to <end:side> {_EDGE}? of road|street",
    f"from <start:side> {_EDGE}?",
    f"from <start:side> {_EDGE}? of road|street",
    "off|from|leaves|leaving <start:side> <walkway>",
    "steps|stepping|walks|walking|comes|coming off|from <start:side> <walkway>",
    f"to <end:side> {_EDGE} of? road|street?",
)

OFF_WALKWAY = phrases(
    means((Mention(),)),
    f"{_WALK} off|from|out <walkway>",
    "off|leaves|leaving <walkway>",
)


def _turned(found: Found) -> tuple[Fact, ...]:
    return (Turned(found.get("angle", Angle).degrees, found.maybe("side", Side)),)


MOTION = phrases(
    means((Standing(),)),
    "park|parks|parking|parked",
    "has|have? stopped",
    "stand|stands|standing still?",
    "is|are? stationary|immobile|standing|abandoned",
    "broken|breaks|broke down",
) + phrases(
    lambda found: (Moving(found.get("speed", Speed).mps),),
    f"{_MOVING} at|with speed? of? <speed>",
    "at|with speed? of? <speed>",
)

HEADING = (
    phrases(
        means((Faces(Facing.WITH_LANE),)),
        "facing|heading|pointing|in? same way|direction as|like <ego>",
        "facing|heading|pointing in|along direction of travel|traffic",
        "facing|heading|pointing along lane",
        "aligned with lane",
    )
    + phrases(
        means((Faces(Facing.AGAINST_LANE),)),
        "facing|heading|pointing <ego>",
        "facing|heading|pointing towards|toward <ego>",
        "facing|heading|pointing in? opposite way|direction",
        "facing|heading|pointing against traffic|lane",
        "facing|heading|pointing in? wrong way",
        "wrong way round?",
    )
    + phrases(
        means((Faces(Facing.ACROSS),)),
        "sideways",
        "across <lane>",
        "across lane",
        "perpendicular to <lane>",
        "perpendicular to lane",
    )
    + phrases(
        _turned,
        "at? angle of? <angle>",
        "turned|rotated|angled by? <angle>",
        "turned|rotated|angled by? <angle> to <side>",
        "turned|rotated|angled to <side> by <angle>",
    )
    + phrases(means((Mention(),)), "turned|rotated|angled|twisted against|towards|to each other")
)

MENTIONS = phrases(
    means((Mention(),)),
    "<ego>",
    "first|nearest|nearer|closest|closer one|cone|car|vehicle",
    "other|second|third|others one|car|vehicle?",
    "all|both|each|some of? them|cars|vehicles?",
)

THING_RULES = {
    "vehicle": VEHICLES,
    "accident": CRASHES,
    "pedestrian": PEDESTRIANS,
    "crossing": CROSSING,
    "stepping off": OFF_WALKWAY,
    "motion": MOTION,
    "heading": HEADING,
    "mention": MENTIONS,
}
