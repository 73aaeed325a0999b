"""Rules about roadworks: cones and how they stand, the construction zone, its worker."""

from __future__ import annotations

from augment.instruction.facts import Fact, Formation, Kind, Mention, Sides, Spacing
from augment.instruction.intent import Length, Shape, Side
from augment.instruction.phrases import Found, means, phrases
from augment.instruction.rules_things import that, thing

_CONE = "traffic|construction? cone|cones|pylon|pylons"
_WORKER = "construction|road? worker|workers"

CONES = (
    phrases(thing(Kind.CONES), f"<count>? {_CONE}")
    + phrases(that(Kind.CONES), f"the {_CONE}")
    + phrases(
        thing(Kind.CONES, Formation(Shape.TAPER)),
        f"short|long? taper of|with <count>? {_CONE}",
        f"tapered|tapering line|row of|with? <count>? {_CONE}",
    )
    + phrases(
        thing(Kind.CONES, Formation(Shape.LINE)),
        f"short|long? straight? line|row of|with? <count>? {_CONE}",
    )
    + phrases(
        thing(Kind.CONES, Formation(Shape.RING)),
        f"small|closed? ring|circle of|with? <count>? {_CONE}",
    )
    + phrases(means((Formation(Shape.TAPER),)), "in|as|forming|forms taper", "tapering|tapered")
    + phrases(
        means((Formation(Shape.LINE),)), "in|as|forming|forms short|long? straight? line|row"
    )
    + phrases(means((Formation(Shape.RING),)), "in|as|forming|forms closed? ring|circle")
)

ZONES = phrases(
    thing(Kind.ZONE),
    "<count>? construction|work zone|site|area",
    "roadworks|roadwork",
    "road works|work zone|site|area?",
) + phrases(that(Kind.ZONE), "the construction|work zone|site|area", "the roadworks|roadwork")


def _spacing(found: Found) -> tuple[Fact, ...]:
    return (Spacing(found.get("length", Length)),)


SPACING = phrases(
    _spacing,
    "with? spacing|gap|distance|gaps of? <length>",
    "with? spacing|gap|distance|gaps of? <length> between <them>",
    "with? spacing|gap of? <length> from cone to cone",
    "with? <length> apart",
    "with? <length> between <them>",
    "with? <length> spacing|gaps|gap",
    "with? <length> spacing|gaps|gap between <them>",
    "spaced by|at? <length> apart?",
    "every <length>",
)


def _between_boundaries(found: Found) -> tuple[Fact, ...]:
    return (Sides(found.get("start", Side), found.maybe("end", Side)),)


_LINE = "boundary|border|edge|line|marking|side|one"

TAPER_SIDES = phrases(
    _between_boundaries,
    f"from <start:side> lane? {_LINE} towards|toward|to <end:side> lane? {_LINE}?",
    f"from <start:side> lane? {_LINE}",
    f"starting|beginning at|from <start:side> lane? {_LINE}",
    f"closing|close|closes lane? from <start:side> lane? {_LINE}?",
)

WORKERS = phrases(
    thing(Kind.WORKER),
    f"with|and? <count>? {_WORKER}",
    f"around|surrounding <count>? {_WORKER}",
) + phrases(that(Kind.WORKER), f"the {_WORKER}")

BESIDE_CONES = phrases(
    means((Mention(),)),
    "stand|stands|standing beside|near|behind? <them>",
    "stand|stands|standing next to <them>",
    "beside|near <them>",
    "next to <them>",
)


ROADWORK_RULES = {
    "cones": CONES,
    "construction zone": ZONES,
    "spacing": SPACING,
    "sides of the taper": TAPER_SIDES,
    "worker": WORKERS,
    "beside the cones": BESIDE_CONES,
}
