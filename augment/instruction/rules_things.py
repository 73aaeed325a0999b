"""Rules about what: vehicles and accidents, and the words that name them."""

from __future__ import annotations

from augment.instruction.facts import (
    Bears,
    Crashed,
    Fact,
    InLane,
    Kind,
    Mention,
    Moving,
    Row,
    Standing,
    Thing,
    Turned,
)
from augment.instruction.intent import Bearing, Body, LaneChoice, Side
from augment.instruction.phrases import Build, Found, means, phrases

_CRASHED = "crashed|collided|wrecked|damaged|smashed|crumpled|colliding"
_ACCIDENT = "accident|crash|collision|pileup|wreck|smash|shunt|prang|smashup"


def thing(kind: Kind, *more: Fact) -> Build:
    """A build for a noun with an optional count, and what else its phrase says."""
    return lambda found: (Thing(kind=kind, count=found.maybe("count", int)), *more)


def that(kind: Kind) -> Build:
    """A build for a noun with "the": something that was named before."""
    return means((Thing(kind=kind, is_definite=True),))


def many(kind: Kind, *more: Fact) -> Build:
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


def _row(found: Found) -> tuple[Fact, ...]:
    return (*_vehicle(found), Row())


def _that_vehicle(found: Found) -> tuple[Fact, ...]:
    body = found.maybe("bodies", Body) or found.get("body", Body)
    thing = Thing(kind=Kind.VEHICLE, body=body, is_definite=True)
    return (thing, Standing()) if found.maybe("standing", str) else (thing,)


def _oncoming_vehicle(found: Found) -> tuple[Fact, ...]:
    return (*_vehicle(found), InLane(LaneChoice.ONCOMING), Moving())


def _crash(found: Found) -> tuple[Fact, ...]:
    count = found.maybe("count", int)
    body = found.maybe("bodies", Body) or found.maybe("body", Body)
    return (Thing(kind=Kind.CRASH, count=count, body=body), Crashed())


def _crash_turned(degrees: float) -> Build:
    return lambda found: (*_crash(found), Turned(degrees))


_HIT = "has|have|had|was|were? hit|struck|rammed|touched|hitting|hits"
_BESIDE = {Side.LEFT: Bearing.LEFT, Side.RIGHT: Bearing.RIGHT}
_SITE = "site|scene|spot?"
_OF = "of|between|with|involving|among|consisting"

VEHICLES = (
    phrases(
        _vehicle,
        "<count>? other? <standing>? <body>",
        "<count>? other? <standing>? <bodies>",
    )
    + phrases(
        lambda found: (Thing(kind=Kind.VEHICLE, count=1, body=found.get("body", Body)),),
        "a second|third|further|following <body>",
    )
    + phrases(
        _row,
        "row|line|queue|column of <count> <standing>? <bodies>",
        "<count> <standing> <bodies> in row|line",
    )
    + phrases(
        _that_vehicle,
        "the|this|that|same <standing>? <body>",
        "the|these|those|both <standing>? <bodies>",
    )
    + phrases(
        _oncoming_vehicle,
        "<count>? oncoming|approaching <body>",
        "<count>? oncoming|approaching <bodies>",
        "<count>? <body> coming|approaching towards|toward|from opposite? <ego>|direction",
        "<count>? <body> coming|approaching from opposite|other|oncoming direction|side|way",
        "<count>? <body> coming|approaching towards|toward <ego>",
        "<count>? <body> in oncoming traffic",
    )
    + phrases(
        means((InLane(LaneChoice.ONCOMING), Moving())),
        "coming|comes|approaching|approaches|driving|drives from opposite|oncoming|other "
        "direction|side|way",
        "coming|comes|driving|drives|moving towards|toward <ego>",
    )
    + phrases(means((InLane(LaneChoice.ONCOMING),)), "oncoming|opposing traffic|lane :")
)

CRASHES = (
    phrases(
        _crash,
        f"<count> {_CRASHED} <bodies>",
        f"car|traffic|road|vehicle? {_ACCIDENT} {_SITE}",
        f"car|traffic|road? {_ACCIDENT} {_SITE} {_OF} of? <count> {_CRASHED}? <bodies>",
        f"<count> <body> {_ACCIDENT}",
        f"{_ACCIDENT} {_SITE} {_OF} of? <count> {_CRASHED}? <bodies>",
        "pile up",
        "pile up of|with|involving <count> <bodies>",
        "<count> <body> pile up",
    )
    + phrases(
        _crash_turned(180.0),
        f"head on|frontal|front {_ACCIDENT}",
        f"head on {_ACCIDENT} {_OF} <count> <bodies>",
        f"frontal {_ACCIDENT} {_OF} <count> <bodies>",
    )
    + phrases(
        _crash_turned(0.0),
        f"rear end|ender {_ACCIDENT}?",
        f"rear end {_ACCIDENT} {_OF} <count> <bodies>",
    )
    + phrases(
        means((Crashed(),)),
        "have|has|had|are|just|been? crashed|collided",
        "crashed|collided|involved|entangled in accident|collision|crash?",
        "has|have? happened|occurred|taken place?",
        "have|has|had|are|just? crashed|collided into|with it|each|one other|another?",
        "have|has|had|are|just? smashed|slammed|ploughed|plowed|banged|bashed|rammed|knocked "
        "into it|each|one other|another?",
        "crash|collide into|with? it|each|one other|another?",
        "crashing|colliding into|with? it|each|one other|another?",
        "caught|tangled up? in collision|crash|accident|pileup",
        "fender bender",
        "collide|collides",
        "came|come|comes into contact",
        "came|come|comes|crashed|collided together",
        "had accident|crash|collision",
        "has|have|are|just? crashed|collided|smashed|slammed together",
        "crash|smash together",
        "have|has? hit each|one other|another",
        "are|is|were|was involved",
        "are|is|were|was? involved in fender bender",
        "are|is|were|was? involved in accident|crash|collision|pileup",
        "has|have|had|was|were? hit|struck|rammed|touched|hitting|hits",
        "has|have|had|was|were? hit|struck|rammed|touched|hitting|hits it|each|one other|another?",
        "has|have? run|driven|ran|drove|slid|skidded|bumped into it|each|one? other|another?",
        "have|has had accident|crash|collision",
        "have|has? piled up|into each? other?",
        "jammed|pushed|wedged|leaning|stuck|lodged|resting|pressed against|into|on|to? it",
        "jammed|pushed|wedged|leaning|stuck|lodged|pressed against|into|to each|one|the "
        "other|another|first",
        "touching|touch|touches each|one? other|another|it?",
        "have|has|had|are|just? crashed|collided|driven|run|slid into its? side|rear|back|door",
        "interlocked|tangled|entangled|colliding",
        "has|have? come|came to rest|halt against it|other|first one|car?",
        "after crash|collision|accident",
        "after having? crashed|collided",
    )
    + phrases(
        means((Crashed(), Bears(Bearing.BEHIND))),
        f"{_HIT} it|one|other|first one|car? from|in|into|at its? behind|rear|back",
        f"{_HIT} rear|back|tail of? it|other|first one|car?",
    )
    + phrases(
        lambda found: (Crashed(), Bears(_BESIDE[found.get("side", Side)])),
        f"{_HIT} it|one|other|first one|car? from|on|in|into|at its? <side> side|flank?",
        f"{_HIT} its <side> side|flank",
    )
    + phrases(means((Thing(kind=Kind.VEHICLE, count=1, joins=True),)), "another one")
    + phrases(
        means((Thing(kind=Kind.VEHICLE, count=1, joins=True), Bears(Bearing.BEHIND))),
        "car|vehicle|one behind|following it|this",
        "following car|vehicle",
    )
    + phrases(
        means((Thing(kind=Kind.VEHICLE, count=1, joins=True), Bears(Bearing.AHEAD))),
        "car|vehicle|one in front|ahead of it|this",
    )
    + phrases(
        means((Mention(),)),
        "turning|coming|emerging|pulling|driving out? of|from side|minor|cross? street|road",
        "went|going|driving|driven|travelling|goes straight on|ahead|through?",
        "coming from side|minor|cross street|road",
        "chain reaction",
    )
)

THING_RULES = {"vehicle": VEHICLES, "accident": CRASHES}
