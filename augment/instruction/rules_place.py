"""Rules about where: distance, direction, lane, surroundings."""

from __future__ import annotations

from dataclasses import replace

from augment.instruction.facts import (
    Direction,
    Distance,
    Fact,
    InLane,
    PartlyIn,
    Purpose,
    Reaches,
    Surroundings,
    Towards,
    WrongSide,
)
from augment.instruction.intent import LaneChoice, LateralTarget, Length, Relation, Setting, Side
from augment.instruction.phrases import Found, Phrase, means, phrases

_START = "starting|starts|start|beginning|begins|begin"
_AHEAD_OF = (
    "further|farther? ahead|forward|forwards|onwards|upfront",
    "further? ahead of <ego>",
    "further? in front",
    "further? in front of <ego>",
    "further|farther? down|along|up|on <ego>? road|street|lane|way|route|path",
    "from <ego> in|along its? direction of? travel|driving|motion?",
    "away? ahead",
    "straight|directly|dead|right|up|out? ahead of? <ego>?",
    "straight|directly|right? in front of? <ego>?",
    "away in front of? <ego>?",
    "away? down|along|up <ego>? road|street|lane|way|route|path",
    "beyond|past <us>",
    "up front",
    "to front of <ego>",
    "ahead on|along road|street|lane|way|route|path",
    "away? in <ego>? direction of? travel|driving|motion?",
    "in|from direction of travel of <ego>",
)


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
        "at|in|after <length>",
        "at? <length> away? from|to <ego>",
        "at? <length> away",
        "at? distance of? <length>",
        "at? distance of? <length> away? from|to <ego>",
        f"{_START} at|from? <length>",
        f"{_START} at|from? <length> from <ego>",
    )
    + phrases(
        _ahead,
        *(f"at|in? distance? of? <length> {tail}" for tail in _AHEAD_OF),
        "from <length> <ahead>? on|onwards|onward",
        "from <length> <ahead>",
        *(f"{_START} at|from? distance? of? <length> {tail}" for tail in _AHEAD_OF[:4]),
        "ahead|forward at|by <length>",
        "ahead of <ego> at|by? distance? of? <length>",
        "in front of <ego> at|by? distance? of? <length>",
        "in front at? distance? of? <length>",
        "ahead at? distance? of? <length>",
    )
    + phrases(
        _behind,
        "at? distance? of? <length> behind <ego>",
        "at? distance? of? <length> back? to|at rear of <ego>",
        "behind <ego> at|by? distance? of? <length>",
    )
)

DIRECTION = (
    phrases(
        means((Direction(Relation.AHEAD),)),
        "ahead",
        "ahead of <ego>",
        "in front of <ego>",
        "dead|straight|right|directly ahead",
        "in front",
        "in front of / in travel direction of <ego>",
        "in front of / in direction of travel of <ego>",
        "in <ego> travel|driving direction",
        "in its? travel|driving direction",
        "in travel|driving direction of <ego>",
        "in its? direction of travel",
        "in direction of travel of <ego>",
        "in <ego> direction of travel",
        "further? down|along|up <ego>? road|street|lane",
    )
    + phrases(
        means((Direction(Relation.AHEAD), InLane(LaneChoice.OWN))),
        "in|into|on <ego> path",
        "in|into|on path of <ego>",
        "in <ego> way",
        "directly|right|straight in front of <ego>",
        "directly|right|straight ahead of <ego>",
    )
    + phrases(means((Direction(Relation.BEHIND),)), "behind <ego>")
)


def _reaches(found: Found) -> tuple[Fact, ...]:
    start, end = found.maybe("a", Length), found.maybe("b", Length)
    ahead = (Direction(Relation.AHEAD),) if found.maybe("ahead", str) else ()
    return (Reaches(start, end, found.maybe("size", Length)), *ahead)


_END = "ending|ends|end|finishing|finishes|stopping|reaching|reaches|extending|extends|up|to|until"

EXTENT = phrases(
    _reaches,
    f"{_START}|from at? <a:length> <ahead>? ,? and? {_END} at|to? <b:length> <ahead>?",
    "between <a:length> <ahead>? and <b:length> <ahead>?",
    "reaching|extending|running|stretching from <a:length> <ahead>? to|until <b:length> <ahead>?",
    "over length|stretch|distance of? <size:length>",
    "over|along <size:length>",
    "<size:length> long",
    "with length of <size:length>",
)

_BLOCK = (
    "fill|fills|filling|obstruct|cover|covers|covering|bar|bars|barring|shut|shuts|shutting|"
    "blocking|blocks|block|close|closes|closing|narrow|narrowing|narrows|obstruct|obstructing|"
    "obstructs|occupy|occupying|occupies"
)
_WHOLLY = "completely|fully|totally|entirely|wholly"
_WHOLE = "whole|entire|full|complete"
_DEAD = "right|exactly|precisely|dead|directly|bang|smack|squarely|plumb|slap"
_BLOCKED = "blocked|closed|obstructed|narrowed|occupied"

IN_LANE = (
    phrases(
        lambda found: (InLane(found.get("lane", LaneChoice)),),
        "in|on|into|onto|inside|within|along <lane>",
        "( <lane> )",
        "next|close to <ego> in <lane>",
    )
    + phrases(
        lambda found: (InLane(found.get("lane", LaneChoice)), Purpose(is_passed=True)),
        f"{_WHOLLY}? {_BLOCK} off|down|up? {_WHOLE}? <lane> off|down? with|by?",
        f"takes|taking|took up {_WHOLE}? <lane>",
        f"{_BLOCK} off <lane> with|by?",
        f"<lane> is? completely|fully? {_BLOCKED} by|with?",
    )
    + phrases(
        means((InLane(LaneChoice.OWN), Purpose(is_passed=True))),
        f"{_WHOLLY}? {_BLOCK} off? {_WHOLE}? lane|road|way|street off? with|by?",
        "<ego> way|path is? completely|fully? blocked|obstructed|barred by?",
        f"lane|road|way|street is? completely|fully? {_BLOCKED} by|with?",
    )
)

BLOCKED_AT = phrases(
    lambda found: (
        *_ahead(found),
        InLane(found.maybe("lane", LaneChoice) or LaneChoice.OWN),
        Purpose(is_passed=True),
    ),
    f"<lane> is? {_WHOLLY}? {_BLOCKED} at? <length> <ahead> by",
    f"<ego>? lane|road|way|route|path is? {_WHOLLY}? {_BLOCKED} at? <length> <ahead> by",
)

AT_CENTRE = phrases(
    means((Towards(LateralTarget.LANE_CENTRE),)),
    f"{_DEAD}? in|on|at <centre>",
    "centred|centered|centrally in lane",
    "with? no|zero lateral? offset from|to? <centre>?",
    "without any? lateral? offset from|to? <centre>?",
) + phrases(
    lambda found: (Towards(LateralTarget.LANE_CENTRE), InLane(found.get("lane", LaneChoice))),
    f"{_DEAD}? in|on|at centre|center|middle|centerline|centreline of <lane>",
    "centred|centered|centrally in|on <lane>",
    "in|on|at <lane> 's? centre|center|middle",
)

_SEEN = "bend|curve|turn|corner"
_JUNCTION = "intersection|junction|crossroads"
_ZEBRA = "pedestrian|zebra? crosswalk|crosswalks|crossing|zebra"


def _setting(setting: Setting, *patterns: str) -> tuple[Phrase, ...]:
    return phrases(means((Surroundings(setting),)), *patterns)


def _by_parked(found: Found) -> tuple[Fact, ...]:
    side = found.maybe("side", Side)
    setting = {
        None: Setting.BY_PARKED,
        Side.LEFT: Setting.BY_PARKED_LEFT,
        Side.RIGHT: Setting.BY_PARKED_RIGHT,
    }[side]
    return (Surroundings(setting),)


SURROUNDINGS = (
    _setting(
        Setting.BEFORE_INTERSECTION,
        f"just|shortly|right|directly|still? before <ego>? reaches|reaching? {_JUNCTION}",
        f"just|shortly? short of {_JUNCTION}",
        f"ahead of {_JUNCTION}",
        f"in front of {_JUNCTION}",
    )
    + _setting(
        Setting.IN_INTERSECTION,
        f"in|inside|on|within middle|centre|center? of? {_JUNCTION}",
    )
    + _setting(Setting.AT_INTERSECTION, f"at|near|by {_JUNCTION}")
    + phrases(
        means((Surroundings(Setting.AFTER_INTERSECTION), Direction(Relation.AHEAD))),
        f"just|shortly|right|directly? past|beyond|after|behind {_JUNCTION}",
        f"on other|far side of {_JUNCTION}",
    )
    + _setting(
        Setting.IN_BEND,
        f"in|inside|on|within|through|around|across|at {_SEEN}",
        f"in|at|near|around start|beginning|entrance|entry|middle|end of {_SEEN}",
        "where road|street bends|curves|turns",
        f"where {_SEEN} begins|starts",
    )
    + _setting(
        Setting.OFF_CROSSWALK,
        f"well|far? away from {_ZEBRA}",
        f"off|outside {_ZEBRA}",
        f"well|far? clear of {_ZEBRA}",
        f"some|good? distance from {_ZEBRA}",
        f"far from {_ZEBRA}",
        f"outside of {_ZEBRA}",
        f"not using|at|on|near? {_ZEBRA}",
        f"where there is no {_ZEBRA}",
    )
    + _setting(Setting.ON_CROSSWALK, f"on|over|using {_ZEBRA}")
    + phrases(
        _by_parked,
        "in gap? between|in|of <parked>",
        "in gap? between|in|of <parked> on|to|along <side> side? of? road|street?",
        "in gap in? row|line of <parked> on|to|along <side> side? of? road|street?",
        "between <parked> on|to|along <side> side? of? road|street?",
        "between <parked>",
        "next to <parked>",
        "beside|alongside|among|amongst|amid <parked>",
        "beside|alongside|among|amongst <parked> on|to|along <side> side?",
    )
)

_STICKS = "sticks|sticking|protrudes|protruding|juts|jutting|pokes|poking|sits|leans|hangs"

COVERS = phrases(
    means((PartlyIn(),)),
    "partly|partially|half blocking|blocks|block|covers|covering|in|into|on|occupying|occupies "
    "<lane>",
    "partly|partially|half blocking|blocks|block|covers|covering|obstructs lane|road|way",
    "blocking|blocks|covers|covering|occupying|occupies|takes|taking up? part|half|some of <lane>",
    *(f"still? {_STICKS} out? of|from|into|beyond {what}" for what in ("<parked>", "<road>")),
    f"{_STICKS} out",
    "so|such? that? <road> is only? partly|partially|half blocked|covered|obstructed|occupied",
    "only? partly|partially|half parked|standing? in|on|inside its|parking bay|space|spot",
    "has? not made it? into|in its? parking? bay|row|gap|space|spot",
    "has? not fully|completely|quite|properly? parked|pulled in|over?",
    "not fully|completely|quite|properly? in|inside|off bay|row|gap|space|road|lane",
) + phrases(
    means((WrongSide(),)),
    "on|along|at wrong side of? road|street?",
)

PLACE_RULES = {
    "extent": EXTENT,
    "distance": DISTANCE,
    "direction": DIRECTION,
    "lane": IN_LANE,
    "blocked lane": BLOCKED_AT,
    "lane centre": AT_CENTRE,
    "surroundings": SURROUNDINGS,
    "part of the lane": COVERS,
}
