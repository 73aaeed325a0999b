"""Rules about roadworks: cones and how they stand, the construction zone, its worker."""

from __future__ import annotations

from augment.instruction.facts import (
    BothSides,
    Fact,
    Formation,
    Kind,
    Mention,
    Posted,
    Sides,
    Spacing,
    Thing,
    Towards,
)
from augment.instruction.intent import LateralTarget, Length, Post, Shape, Side
from augment.instruction.phrases import Found, means, phrases
from augment.instruction.rules_things import that, thing

_CONE = "traffic|construction|warning|safety|road|orange? cone|cones|pylon|pylons|marker|markers"
_WORKER = (
    "construction|road|building|maintenance|roadwork|roadworks? worker|workers|workman|workmen|"
    "roadworker|labourer|laborer|workperson|builder"
)
_LINE = "line|row|string|queue|series|chain|column"

CONES = (
    phrases(thing(Kind.CONES), f"<count>? {_CONE}", f"by|with <count> {_CONE}")
    + phrases(that(Kind.CONES), f"the|these|those {_CONE}")
    + phrases(
        thing(Kind.CONES, Formation(Shape.TAPER)),
        f"short|long? taper|wedge of|with|from|formed|made|consisting of? <count>? {_CONE}",
        f"tapered|tapering|slanted|slanting|diagonal|oblique {_LINE} of|with? <count>? {_CONE}",
    )
    + phrases(
        thing(Kind.CONES, Formation(Shape.LINE)),
        f"short|long? straight? {_LINE} of|with|from? <count>? {_CONE}",
    )
    + phrases(
        thing(Kind.CONES, Formation(Shape.RING)),
        f"small|closed? ring|circle|oval out? of|with|from <count>? {_CONE}",
    )
    + phrases(
        means((Formation(Shape.TAPER),)),
        "in|as|forming|forms|form short|long? taper|wedge",
        f"in|as|forming|forms|form tapered|tapering|slanted|slanting|diagonal {_LINE}",
        "tapering|tapered|tapers off|in?",
        "as? taper",
    )
    + phrases(
        means((Formation(Shape.LINE),)),
        f"in|as|forming|forms|form short|long|single? straight? {_LINE}",
        "lined up",
    )
    + phrases(
        means((Formation(Shape.RING),)),
        "in|as|forming|forms|form closed|small? ring|circle|oval",
        "in|as|forming|forms|form closed|small? ring|circle around <them>",
        "arranged in ring|circle",
        "surrounded|encircled|ringed|enclosed|circled",
        "surround|surrounds|surrounding|encircle|encircles|encircling <them>?",
    )
    + phrases(
        thing(Kind.CONES, Formation(Shape.ROW)),
        f"<count>? {_CONE} stand|standing|placed|set|are|all? side by side",
        f"<count>? {_CONE} stand|standing|placed|set|are|all? next to each|one other|another",
    )
    + phrases(
        means((Formation(Shape.ROW),)),
        f"in|as|forming|forms|form straight? {_LINE} straight|right? across|over <road>",
        f"in|as|forming|forms|form straight? {_LINE} across|over it",
        "right|straight? across it",
        "side by side across <road>",
    )
)

ZONES = (
    phrases(
        thing(Kind.ZONE),
        "<count>? construction|work|building|road zone|site|area",
        "<count>? roadwork|roadworks zone|site|area",
        "roadworks|roadwork",
        "road works|work|construction zone|site|area?",
        "<count>? lane closure",
        "<count>? barrier|closure",
    )
    + phrases(
        that(Kind.ZONE),
        "the construction|work|road zone|site|area",
        "the roadworks|roadwork zone|site|area?",
    )
    + phrases(
        lambda found: (
            Thing(kind=Kind.ZONE),
            Thing(kind=Kind.CONES, count=found.get("count", int)),
        ),
        f"construction|work|building|road zone|site|area of|with|from|marked by? <count> {_CONE}",
        f"roadworks|closure|roadwork of|with|marked by? <count> {_CONE}",
    )
)


def _spacing(found: Found) -> tuple[Fact, ...]:
    return (Spacing(found.get("length", Length)),)


_GAP = "spacing|gap|distance|gaps|interval|intervals|distances|space"

SPACING = phrases(
    _spacing,
    f"with {_GAP} of? <length>",
    "at? spacing|gap|gaps|interval|intervals of? <length>",
    f"with|at? {_GAP} of? <length> between|from <them>",
    f"with|at? {_GAP} of? <length> from cone|one to cone|next|another",
    f"{_GAP} between <them> is|being? <length>",
    "with|at|set|placed|standing? <length> apart",
    "with|at|set|placed|standing? <length> apart from each|one other|another",
    "with|at|leaving? <length> between <them>",
    "with|at? <length> from cone|one to cone|next|other|another",
    f"with|at? <length> {_GAP}",
    f"with|at? <length> {_GAP} between <them>",
    "spaced|placed|set|separated by|at? <length> apart?",
    "one|cone every <length>",
    "follow|follows|following? every <length>",
    f"follow|follows|following at|with {_GAP} of? <length>",
    "each|every <length> away? from next|previous|last|other one|cone?",
    "<length> away? from each|one other|another",
    "with? <length> separating|between <them>",
    "with? <length> between|separating neighbours|neighbors|two|each|adjacent|consecutive ones?",
    f"with? {_GAP} of? <length> between|separating neighbours|neighbors|two|each|them ones?",
    f"{_GAP} is|being|are? <length>",
    "every <length>",
    f"with|at? {_GAP} of? <length> from|to each|one other|another",
    "with? <length> between one|each? cone? and|to next|other one|cone?",
    "with? <length> in between",
    "<length> from neighbour|neighbor to neighbour|neighbor",
    "<length> separate|separates <them>",
)


def _between_boundaries(found: Found) -> tuple[Fact, ...]:
    return (Sides(found.get("start", Side), found.maybe("end", Side)),)


_SIDE_OF = {LateralTarget.LEFT_BOUNDARY: Side.LEFT, LateralTarget.RIGHT_BOUNDARY: Side.RIGHT}


def _between_edges(found: Found) -> object:
    """From one named boundary to another; None where one is named by the map alone."""
    start = _SIDE_OF.get(found.get("start", LateralTarget))
    end = found.maybe("end", LateralTarget)
    if start is None or (end is not None and end not in _SIDE_OF):
        return None
    side = found.maybe("side", Side)
    return (Sides(start, side if end is None else _SIDE_OF[end]),)


def _to_middle(found: Found) -> tuple[Fact, ...]:
    return (Sides(found.get("start", Side), None), Towards(LateralTarget.LANE_CENTRE))


_EDGE = "boundary|border|edge|line|marking|side|one|limit|kerb|curb"

_RUN = "running|runs|run|leading|leads|lead|going|goes|go|slanting|slants|reaching|reach"
_TO = "to|towards|toward"

TAPER_SIDES = (
    phrases(
        _between_boundaries,
        f"from|at <start:side> lane? {_EDGE} of? lane? {_TO} <end:side> lane? {_EDGE}?",
        f"from <start:side> lane? {_EDGE} of? lane?",
        f"from its? <start:side> {_EDGE} {_TO} its? <end:side> {_EDGE}",
        f"starting|starts|beginning|begins|begin|start at|from|on <start:side> lane? {_EDGE} of? "
        "lane?",
        f"closing|close|closes lane? from <start:side> lane? {_EDGE}?",
        f"{_RUN} from <start:side> lane? {_EDGE}? of? lane? {_TO} <end:side> lane? {_EDGE}?",
        "from <start:side> to|towards|toward <end:side>",
        f"starting|starts|beginning|begins at|from|on <start:side> lane? {_EDGE}? and ending|ends "
        f"at|on <end:side> lane? {_EDGE}?",
    )
    + phrases(
        _between_edges,
        f"{_RUN}? over|across? from <start:boundary> over|across? {_TO} <end:boundary>",
        f"{_RUN}? over|across? from <start:boundary> over|across? {_TO} <side> one|side?",
        "starting|starts|beginning|begins|begin|start at|from|on <start:boundary> and? "
        "ending|ends|finishing|finishes at|on <end:boundary>",
    )
    + phrases(
        _between_boundaries,
        "starting|starts|beginning|begins|begin|start at|from|on <start:side> side|edge of <lane>",
    )
    + phrases(
        lambda found: (Sides(None, found.get("end", Side)),),
        f"ending|ends|end at|on <end:side> lane? {_EDGE}? of? lane?",
        "closing|closes|close <road> to|towards <end:side>",
        f"across|over <road>? to|towards|toward <end:side> lane? {_EDGE}? of? lane?",
    )
    + phrases(
        _to_middle,
        f"{_RUN}? from <start:side> lane? {_EDGE} of? lane? to|towards|toward <centre>",
        f"{_RUN}? from <start:side> lane? {_EDGE} of? lane? {_TO} centre|center|middle of? lane?",
    )
)

WORKERS = phrases(
    thing(Kind.WORKER),
    f"with|and|plus? <count>? {_WORKER}",
    f"with|and? <count>? {_WORKER} inside|within it?",
    f"around|surrounding|surround|encircling|enclosing|enclose <count>? {_WORKER}",
) + phrases(that(Kind.WORKER), f"the {_WORKER}")


_STAND = "stand|stands|standing|works|working|walks|waits|positioned|is|stood|placed|with"

POSTS = (
    phrases(
        means((Posted(Post.BESIDE),)),
        f"{_STAND}? beside|near|by|alongside <them>",
        f"{_STAND}? next|close to <them>",
    )
    + phrases(
        means((Posted(Post.BEHIND),)), f"{_STAND}? behind|beyond|past <them>", f"{_STAND} behind"
    )
    + phrases(
        lambda found: (Posted(Post.BESIDE, found.get("side", Side)),),
        f"{_STAND}? on|to|at <side> side? of <them>",
        f"{_STAND}? <side> of <them>",
    )
    + phrases(
        lambda found: (Posted(Post.AT_LAST, found.maybe("side", Side)),),
        f"{_STAND}? on|to|at <side> side? of last|final <them>",
        f"{_STAND}? <side> of last|final <them>",
        f"{_STAND}? beside|near|by|at|alongside last|final <them>",
        f"{_STAND}? next|close to last|final <them>",
        f"{_STAND}? at end of <them>",
    )
    + phrases(
        means((Mention(),)),
        f"{_STAND}? inside|within|in|amid <them>",
        f"{_STAND}? in|inside middle|centre|center of? <them>",
        "in|inside it",
        "around|surrounding him|her|it|them",
    )
)

BOTH_SIDES = phrases(
    means((BothSides(is_each=True),)),
    "on|along|at each side|boundary|edge of? <lane>?",
    "on|along|at each side|boundary|edge of lane",
    "per side",
) + phrases(
    means((BothSides(is_each=False),)),
    "on|along|at both sides|boundaries|edges of? <lane>?",
    "on|along|at both sides|boundaries|edges of lane",
    "left and right of <lane>",
)


ROADWORK_RULES = {
    "cones": CONES,
    "construction zone": ZONES,
    "spacing": SPACING,
    "sides of the taper": TAPER_SIDES,
    "worker": WORKERS,
    "beside the cones": POSTS,
    "both sides": BOTH_SIDES,
}
