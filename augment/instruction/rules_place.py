"""Rules about where: distance, direction, lane, offset, surroundings."""

from __future__ import annotations

from dataclasses import replace

from augment.instruction.facts import (
    Direction,
    Distance,
    Fact,
    InLane,
    Offset,
    Shoulder,
    Surroundings,
    Towards,
)
from augment.instruction.intent import (
    LaneChoice,
    LateralTarget,
    Length,
    Nearness,
    Relation,
    Setting,
    Side,
)
from augment.instruction.phrases import Found, means, phrases

_SLIGHT = "slight|small|little"
_SLIGHTLY = "slightly|somewhat"


def _distance(found: Found) -> tuple[Fact, ...]:
    return (Distance(found.get("length", Length)),)


def _ahead(found: Found) -> tuple[Fact, ...]:
    return (Distance(found.get("length", Length)), Direction(Relation.AHEAD))


def _behind(found: Found) -> tuple[Fact, ...]:
    return (Distance(found.get("length", Length)), Direction(Relation.BEHIND))


def _about(found: Found) -> tuple[Fact, ...]:
    return (Distance(replace(found.get("length", Length), is_approximate=True)),)


DISTANCE = (
    phrases(
        _about,
        "at? approximate|approx distance of? <length>",
        "at? approx . distance of? <length>",
        "at? approximate|approx distance of? <length> away? from|to <ego>",
        "at? approx . distance of? <length> away? from|to <ego>",
    )
    + phrases(
        _distance,
        "at|in <length>",
        "at <length> away? from <ego>",
        "<length> away from <ego>",
        "<length> from <ego>",
        "at? distance of? <length>",
        "at? distance of? <length> away? from|to <ego>",
        "starting|starts|start|beginning|begins|begin at <length>",
    )
    + phrases(
        _ahead,
        "at? distance? of? <length> ahead|forward",
        "at? distance? of? <length> ahead of <ego>",
        "at? distance? of? <length> in front",
        "at? distance? of? <length> in front of <ego>",
        "at? distance? of? <length> further? down road|street|lane",
        "at? distance? of? <length> further? along road|street|lane",
        "starting|starts|start|beginning|begins|begin at? <length> ahead",
        "starting|starts|start|beginning|begins|begin at? <length> ahead of <ego>",
        "starting|starts|start|beginning|begins|begin at? <length> in front of <ego>",
    )
    + phrases(
        _behind,
        "at? distance? of? <length> behind <ego>",
        "at? distance? of? <length> back? to|at rear of <ego>",
    )
)

DIRECTION = (
    phrases(
        means((Direction(Relation.AHEAD),)),
        "ahead",
        "ahead of <ego>",
        "in front of <ego>",
        "in front of / in travel direction of <ego>",
        "in front of / in direction of travel of <ego>",
        "in <ego> travel|driving direction",
        "in its? travel|driving direction",
        "in travel|driving direction of <ego>",
        "in its? direction of travel",
        "in direction of travel of <ego>",
        "in <ego> direction of travel",
    )
    + phrases(
        means((Direction(Relation.AHEAD), InLane(LaneChoice.OWN))),
        "in|into <ego> path",
        "in|into path of <ego>",
        "in <ego> way",
        "directly|right|straight in front of <ego>",
        "directly|right|straight ahead of <ego>",
    )
    + phrases(means((Direction(Relation.BEHIND),)), "behind <ego>")
)

IN_LANE = phrases(
    lambda found: (InLane(found.get("lane", LaneChoice)),),
    "in|on|into|onto|inside|within <lane>",
    "blocking|blocks|block|close|closes|closing <lane>",
    "blocking|blocks|block|close|closes|closing <lane> with|by",
    "occupying|occupies <lane>",
)

AT_CENTRE = phrases(
    means((Towards(LateralTarget.LANE_CENTRE),)), "in|on|at <centre>", "centred|centered in lane"
) + phrases(
    lambda found: (Towards(LateralTarget.LANE_CENTRE), InLane(found.get("lane", LaneChoice))),
    "in|on|at centre|center|middle|centerline|centreline of <lane>",
    "centred|centered in <lane>",
    "in|on|at <lane> 's? centre|center|middle",
)


def _offset(found: Found) -> tuple[Fact, ...]:
    return (Offset(found.get("length", Length)),)


def _beside_centre(found: Found) -> tuple[Fact, ...]:
    left = found.get("side", Side) is Side.LEFT
    target = LateralTarget.LEFT_BOUNDARY if left else LateralTarget.RIGHT_BOUNDARY
    length = found.maybe("length", Length)
    return (Towards(target), *(() if length is None else (Offset(length),)))


OFFSET = (
    phrases(
        _offset,
        f"with? {_SLIGHT}? lateral? offset of|by? anything|somewhere? randomly? <length>",
        f"with? {_SLIGHT}? lateral? offset of|by? anything|somewhere? randomly? <length> "
        "from|to|off <centre>",
        "<length> offset",
        "<length> offset from|to|off <centre>",
        "at? <length> away? from|off|beside <centre>",
        "shifted|displaced by? <length>",
        "shifted|displaced by? <length> from|off <centre>",
    )
    + phrases(
        _beside_centre,
        f"{_SLIGHTLY}? to|on? <side> of <centre>",
        "<length> to|on? <side> of <centre>",
        "offset|shifted|displaced by? <length> to <side>",
        "<length> to <side>",
    )
    + phrases(
        means((Offset(None),)),
        f"with? {_SLIGHT} lateral? offset",
        f"with? {_SLIGHT} lateral? offset from|to|off <centre>",
        f"{_SLIGHTLY} offset",
        f"{_SLIGHTLY} offset from|to|off <centre>",
        "offset from|to|off <centre>",
        f"{_SLIGHTLY} off <centre>",
    )
)


TOWARDS = (
    phrases(
        lambda found: (Towards(found.get("boundary", LateralTarget)),),
        "offset|shifted|displaced? towards|toward|to <boundary>",
        "towards|toward <boundary:plain>",
        "offset|shifted|displaced towards|toward|to <boundary:plain>",
    )
    + phrases(
        lambda found: (Towards(found.get("boundary", LateralTarget), Nearness.SLIGHTLY),),
        f"{_SLIGHTLY} offset|shifted|displaced? towards|toward|to <boundary>",
        f"{_SLIGHTLY} offset|shifted|displaced? towards|toward|to <boundary:plain>",
        f"with? {_SLIGHT} offset towards|toward|to <boundary>",
        f"with? {_SLIGHT} offset towards|toward|to <boundary:plain>",
        "bit|little offset|shifted|displaced? towards|toward|to <boundary>",
    )
    + phrases(
        lambda found: (Towards(found.get("boundary", LateralTarget), Nearness.AT_EDGE),),
        "at|along|by|near|on <boundary>",
        "next|close to <boundary>",
        "hugging|touching <boundary>",
    )
)

SHOULDER = phrases(
    lambda found: (Shoulder(found.maybe("side", Side), Nearness.HALF_OUT),),
    "partly|partially|half|halfway on|onto <side>? hard? shoulder",
    "partly|partially|half|halfway on|onto <side>? <walkway>",
    "with two wheels on <side>? hard? shoulder",
    "with two wheels on <side>? <walkway>",
) + phrases(
    lambda found: (Shoulder(found.maybe("side", Side), Nearness.OUTSIDE),),
    "on|onto <side>? hard? shoulder",
)

SURROUNDINGS = (
    phrases(
        means((Surroundings(Setting.BEFORE_INTERSECTION),)),
        "before intersection|junction|crossroads",
    )
    + phrases(
        means((Surroundings(Setting.IN_INTERSECTION),)),
        "in|inside|on|within middle? of? intersection|junction|crossroads",
    )
    + phrases(
        means((Surroundings(Setting.OFF_CROSSWALK),)),
        "away from|off|outside crosswalk|crosswalks|zebra crossing?",
        "away from|off|outside pedestrian crossing",
        "outside of crosswalk|crosswalks|zebra crossing?",
    )
)

PLACE_RULES = {
    "distance": DISTANCE,
    "direction": DIRECTION,
    "lane": IN_LANE,
    "lane centre": AT_CENTRE,
    "offset": OFFSET,
    "side of the lane": TOWARDS,
    "shoulder": SHOULDER,
    "surroundings": SURROUNDINGS,
}
