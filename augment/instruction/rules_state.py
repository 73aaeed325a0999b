"""Rules about how a thing stands or moves, where it looks, and what it stands beside."""

from __future__ import annotations

from augment.instruction.facts import (
    Apart,
    Bears,
    Faces,
    Fact,
    Mention,
    Moving,
    Rank,
    Row,
    Standing,
    Turned,
)
from augment.instruction.intent import Bearing, Facing, Length, Side
from augment.instruction.phrases import Build, Found, Phrase, means, phrases
from augment.instruction.quantities import Angle, Speed

_MOVING = (
    "moving|driving|travelling|traveling|going|approaching|moves|drives|approaches|goes|coming|"
    "comes|travels|move|drive|approach|come"
)
_STOP = "halt|stop|standstill|rest"

MOTION = (
    phrases(
        means((Standing(),)),
        "park|parks|parking|parked",
        "has|have|is? stopped|stalled|halted",
        "stand|stands|standing|sit|sits|sitting|rest|rests|resting still|there?",
        "wait|waits|waiting still|there?",
        "is|are? stationary|immobile|standing|abandoned|motionless|halted|idle|stuck|stranded",
        "has|have|is|was? broken|breaks|broke|break|breaking down",
        "been|was left standing|parked|there?",
        "left standing|parked there?",
        "none|neither of? them|cars|vehicles moves|move|drives",
        "none|neither of? them|cars|vehicles? is|are? moving|driving",
        f"has|have? come|comes|coming|came to {_STOP}",
        f"at|in complete? {_STOP}",
        "is|are|does|do? not move|moving",
        "isn|aren|doesn|don '|’ t move|moving",
        "with|has engine|breakdown trouble|failure?",
        "has|have|with breakdown|puncture",
        "with? hazard|warning lights|flashers on|flashing|blinking",
        "loading|unloading|delivering goods|parcels|passengers?",
        "with? speed|velocity of? zero|0 m / s",
        "double parked",
        "has|have|is|are? pulled up|over|in",
        "has|have|is|are? parked up",
        "has|have|is|are? drawn up",
        "has|have|was|been? dumped|ditched|abandoned|deserted|stranded|marooned",
        "dead|stock still",
    )
    + phrases(
        lambda found: (Moving(found.get("speed", Speed).mps),),
        f"{_MOVING} <ego>? at|with about? speed|velocity? of? <speed>",
        f"{_MOVING} towards|toward <ego> at|with about? speed|velocity? of? <speed>",
        "at|with constant|steady? speed|velocity|pace? of? <speed>",
        "doing <speed>",
        "in free? flow at? <speed>",
        "speed|velocity is? of? <speed>",
        "( <speed> )",
    )
    + phrases(
        means((Row(),)),
        "one behind|after other|another|next",
        "bumper to bumper",
        "nose to tail",
        "in tandem",
        "in single? file|queue|column",
    )
)

_LOOKS = "facing|heading|pointing|faces|face|heads|looking|oriented|pointed|directed"
_WAY = "way|direction|heading|orientation"
_TURNED = (
    "yawed|turned|rotated|angled|twisted|tilted|skewed|swung|standing|stands|pointing|heading"
)
_MAKE = "making|make|makes|forming|form|forms"
_AXES = "their|its? headings|axes|directions|bodies|orientations|noses|long"
_TO_WHAT = "it|each|lane|road|other|one|them|first|second|street|direction|neighbour"


def _turned(found: Found) -> tuple[Fact, ...]:
    return (Turned(found.get("angle", Angle).degrees, found.maybe("side", Side)),)


def _turned_clock(side: Side) -> tuple[Phrase, ...]:
    word = "clockwise"
    words = word if side is Side.RIGHT else f"counter|anti|counterclockwise|anticlockwise {word}?"
    return phrases(
        lambda found: (Turned(found.get("angle", Angle).degrees, side),),
        f"{_TURNED}? by? <angle> {words}",
        f"{_TURNED}? {words} by <angle>",
    )


HEADING = (
    phrases(
        means((Faces(Facing.WITH_LANE),)),
        f"{_LOOKS} in? same {_WAY} as|like <ego>",
        f"in? same {_WAY} as|like <ego>",
        f"{_LOOKS}? in|along|with direction of? travel|traffic|flow|lane",
        f"{_LOOKS}? in|along <ego>? direction of? travel|traffic|driving",
        f"{_LOOKS} in|along|to <ego>? travel|driving direction",
        f"{_LOOKS}? along|with lane|traffic",
        f"{_LOOKS} away from <ego>",
        f"{_LOOKS} forward|forwards|ahead",
        "aligned|parallel with|to lane|road|it|<lane>",
        "in line with lane|traffic",
    )
    + phrases(
        means((Faces(Facing.AGAINST_LANE),)),
        f"{_LOOKS} <ego>",
        f"{_LOOKS} towards|toward|at <ego>",
        f"{_LOOKS} in? opposite|other|wrong|reverse {_WAY}",
        f"{_LOOKS}? in? opposite {_WAY} to|of|as|from? <ego>",
        f"{_LOOKS}? against traffic|lane|direction of? travel|traffic?",
        f"{_LOOKS}? against direction of traffic|travel|lane",
        "wrong way round|around?",
        "with? its? front|nose|bonnet|hood|headlights towards|toward|to|facing <ego>",
        "with? its? front|nose|bonnet|hood pointing|turned|facing at|to|towards|toward <ego>",
        "turned|rotated around|round by? 180 degrees?",
    )
    + phrases(
        means((Faces(Facing.ACROSS),)),
        "sideways|crosswise|crossways|transversely|broadside",
        "across|blocking whole|entire|full? <lane>",
        "straight|right|directly? across lane|road|street",
        "straight|right|directly across <lane>",
        "perpendicular|transverse|square to <lane>",
        "perpendicular|transverse|square to lane|road|street|traffic",
        "at right angle|angles to <lane>",
        "at right angle|angles to lane|road|street|traffic",
    )
    + phrases(
        _turned,
        "at|with|in? relative? angle of? <angle>",
        f"at|with|in? relative? angle of? <angle> to|from|against|with|between {_TO_WHAT} "
        "other|another|one|car?",
        f"{_TURNED} by? <angle>",
        f"{_TURNED} by? <angle> to|towards|toward <side>",
        f"{_TURNED} by? <angle> <side>",
        f"{_TURNED} to|towards|toward <side> by <angle>",
        f"{_TURNED} <side> by <angle>",
        f"{_TURNED} by? <angle> to|from|against|relative to? {_TO_WHAT} other|another|one|car?",
        "at <angle> to|from|against|relative to? <neighbour>",
        "at <angle>",
        "at <angle> angle",
        "angle between <neighbour> is|being|of? <angle>",
        "with? <angle> angle between <neighbour>",
        "<angle> angle between <neighbour>",
        "with|at <angle> angle",
        f"<angle> between {_AXES}",
        f"with? {_AXES} <angle> apart",
        f"with? {_AXES} at <angle> angle? to|from? each|one? other|another?",
        "angle is|being|of <angle>",
        "angle between <neighbour> about|roughly|approximately? <angle>",
        f"{_MAKE} angle of? <angle> with|to? {_TO_WHAT}? other|another?",
        f"{_MAKE} <angle> angle with|to? {_TO_WHAT}? other|another?",
        "at|with <angle> angle to|from|between <neighbour>",
        f"at <angle> angle to|from {_TO_WHAT}",
        "<angle> apart",
        "<angle> between <neighbour>",
        "with? its? nose|front|bonnet turned|pointing? <angle> to <side>",
    )
    + _turned_clock(Side.LEFT)
    + _turned_clock(Side.RIGHT)
    + phrases(
        means((Mention(),)),
        "at odd|different|various|strange|unusual angles? to|against? each|one? other|another?",
        "turned|rotated|angled|twisted|skewed against|towards|to each|one other|another",
        "turned|rotated|angled|twisted|skewed relative to each|one? other|another|others",
        "at angles? to each|one other|another",
        "has|have? spun|span|skidded|slid round|around|sideways?",
        "has|have? lost control",
    )
)


def _apart(bearing: Bearing | None) -> Build:
    def build(found: Found) -> tuple[Fact, ...]:
        of = found.maybe("neighbour", str)
        rank = of if isinstance(of, Rank) else None
        return (Apart(found.get("length", Length), bearing, rank),)

    return build


def _both_behind(found: Found) -> tuple[Fact, ...]:
    names = ("a", "b")
    return tuple(Apart(found.get(name, Length), Bearing.BEHIND, None) for name in names)


def _bears(found: Found) -> tuple[Fact, ...]:
    side = found.get("side", Side)
    bearing = Bearing.LEFT if side is Side.LEFT else Bearing.RIGHT
    length = found.maybe("length", Length)
    return (Apart(length, bearing, None),) if length else (Bears(bearing),)


NEIGHBOURS = (
    phrases(
        _apart(Bearing.AHEAD),
        "at? <length> in front of <neighbour>",
        "at? <length> ahead of <neighbour>",
        "at? <length> beyond|past <neighbour>",
        "at? <length> further on|along|ahead|down",
    )
    + phrases(
        _apart(Bearing.BEHIND),
        "at? <length> behind <neighbour>",
        "follows|following|follow at|by|within? <length>",
        "follows|following|follow at|by|within? <length> behind|after|later <neighbour>?",
        "at? <length> later",
    )
    + phrases(
        _both_behind,
        "follows|following|follow? at|by? <a:length> and <b:length> behind|after <neighbour>?",
    )
    + phrases(
        _apart(None),
        "at? <length> away? from <neighbour>",
        "centres|centers? <length> apart|between <neighbour>?",
        "with? <length> between their? centres|centers",
        "with? their? centres|centers <length> apart",
    )
    + phrases(means((Bears(Bearing.AHEAD),)), "in front|ahead of <neighbour>")
    + phrases(means((Bears(Bearing.BEHIND),)), "behind <neighbour>")
    + phrases(
        _bears,
        "at|on|to|against|into its <side> side|flank|door?",
        "at|on|to <side> side? of <neighbour>",
        "<length> to|on|at its <side>",
        "<length> to|on <side> of <neighbour>",
    )
)

STATE_RULES = {
    "motion": MOTION,
    "heading": HEADING,
    "neighbour": NEIGHBOURS,
}
