"""Rules about pedestrians: who walks, from where to where, and how."""

from __future__ import annotations

from augment.instruction.facts import (
    Bears,
    Crosses,
    Drifts,
    Fact,
    Kind,
    Mention,
    OnRoad,
    Sides,
    Surroundings,
)
from augment.instruction.intent import Bearing, Length, Relation, Setting, Side
from augment.instruction.phrases import Found, means, phrases
from augment.instruction.rules_things import many, that, thing

_WALKER = (
    "pedestrian|person|walker|man|woman|child|boy|girl|kid|passer|student|adult|lady|gentleman|"
    "guy|bloke|fellow|lad|lass|teenager|teen|toddler|schoolchild|schoolboy|schoolgirl|pupil|"
    "pensioner|senior|jogger|runner|commuter|tourist|stranger|shopper|youngster|passerby|"
    "individual|human|mother|father|grandmother|grandfather"
)
_WALKERS = (
    "pedestrians|persons|people|walkers|men|women|children|boys|girls|kids|passers|students|"
    "adults|ladies|gentlemen|guys|teenagers|toddlers|schoolchildren|pupils|pensioners|seniors|"
    "joggers|runners|tourists|commuters|youngsters|passersby|individuals"
)
_GROUP = "group|party|family|file|line|row"

_CROSS = "cross|crosses|crossing|crossed|jaywalks|jaywalking|jaywalk|traverses|traversing|traverse"

_WALK = (
    "walk|walks|walking|step|steps|stepping|run|runs|running|go|goes|going|come|comes|coming|"
    "dart|darts|darting|hurry|hurries|hurrying|stroll|strolls|strolling|dash|dashes|dashing|"
    "emerge|emerges|emerging|enter|enters|entering|moves|moving|head|heads|heading|set|sets|"
    "wander|wanders|wandering|amble|ambles|ambling|saunter|saunters|sprint|sprints|sprinting|"
    "rush|rushes|rushing|bolt|bolts|march|marches|ventures|jog|jogs|jogging|dawdles|trots|hops|"
    "stumbles|staggers|tiptoes|ran|walked|ambled|strides|striding|traipses|scurries|scurrying|"
    "leave|leaves|leaving|sneaks|shuffles|shuffling|making"
)

PEDESTRIANS = (
    phrases(
        thing(Kind.PEDESTRIAN),
        f"<count>? {_WALKER}",
        f"<count>? {_WALKER} by",
        f"<count>? {_WALKER} on foot",
    )
    + phrases(
        many(Kind.PEDESTRIAN),
        f"<count>? {_WALKERS}",
        f"{_GROUP} of|with <count> {_WALKERS}",
    )
    + phrases(
        thing(Kind.PEDESTRIAN, Crosses()),
        "<count>? jaywalker",
        f"<count>? jaywalking|crossing {_WALKER}",
        f"somebody|someone is? {_CROSS} <road>?",
        f"somebody|someone who? should|shall|must|will|is|to to? {_CROSS} <road>?",
        f"somebody|someone on foot who? should|shall|must|will|is? to? {_CROSS} <road>?",
        f"somebody|someone who? should|shall|must|will|is|to to? {_WALK} out? "
        "across|over|onto|into <road>",
        f"somebody|someone is? {_WALK} out? across|over|onto|into <road>",
    )
    + phrases(
        many(Kind.PEDESTRIAN, Crosses()),
        "<count>? jaywalkers",
        f"<count>? jaywalking|crossing {_WALKERS}",
        f"{_GROUP} of|with <count> jaywalking|crossing {_WALKERS}",
        f"{_GROUP} of|with <count> jaywalkers",
    )
    + phrases(
        that(Kind.PEDESTRIAN), f"the {_WALKER}", f"the {_WALKERS}", "the jaywalker|jaywalkers"
    )
)

_EDGES = "side|kerb|curb|walkway|sidewalk|pavement|edge|footpath|verge|shoulder"
_BEGINS = "starting|starts|start|beginning|begins|begin|coming|comes|come"
_PATH = "walkway|sidewalk|pavement|footpath|footway|promenade"
_ROAD = "road|street|lane|carriageway|roadway"


def _sides(found: Found) -> tuple[Fact, ...]:
    return (Sides(found.maybe("start", Side), found.maybe("end", Side)),)


def _crosses_sides(found: Found) -> tuple[Fact, ...]:
    return (Crosses(), *_sides(found))


CROSSING = (
    phrases(
        means((Crosses(),)),
        f"{_CROSS} <road>?",
        f"{_CROSS} over <road>?",
        "over whole|entire? road|street|carriageway|roadway|avenue",
        f"{_CROSS} in front of <ego>",
        f"{_WALK} straight|right|directly? out? across|over <road>",
        f"{_WALK} straight|right|directly? across",
        f"{_WALK} his|her|its|their way across <road>?",
        f"{_CROSS} directly|right|just? ahead of <ego>",
        "gets|get|getting across|over <road>?",
        f"{_WALK} out? onto|into|on <road>",
        f"{_WALK} out in? front? of? <ego>?",
        f"{_WALK} to other|opposite|far side of? road|street?",
        "to other|opposite|far side of? road|street?",
        f"begins|starts|about|wants|tries|decides|intends|trying to {_CROSS} <road>?",
        f"begins|starts|about|wants|tries|decides|intends to {_WALK} across|over <road>?",
        "from one side to other of? road|street?",
    )
    + phrases(
        _sides,
        f"having? started|starting from|on|at <start:side> {_EDGES}?",
        f"{_WALK} <start:side> to|towards <end:side>",
        f"from? <start:side> {_EDGES}? to|towards <end:side> {_EDGES}? one?",
        f"from? <start:side> {_EDGES}? over|across|through to|towards <end:side> {_EDGES}? one?",
        f"from? <start:side> {_EDGES}? of {_ROAD} to|towards <end:side> {_EDGES}? of? {_ROAD}?",
        f"from? <start:side> {_EDGES}? to|towards <end:side> {_EDGES}? of {_ROAD}",
        f"{_WALK} from <start:side> {_EDGES}? to|towards <end:side> {_EDGES}? one?",
        f"from <start:side> {_EDGES}",
        f"{_WALK} <end:side>",
        f"on|at <start:side> {_PATH}",
        "from <start:side>",
        f"from <start:side> {_EDGES} of {_ROAD}",
        "off|from|leaves|leaving <start:side> <walkway>",
        "off|from|leaves|leaving <walkway> on|to|at <start:side> side?",
        f"{_WALK} off|from|out|down of? <walkway> on|to|at <start:side> side?",
        "to|towards|onto <walkway> on|to|at <end:side> side?",
        f"{_BEGINS} from|on|at <start:side> {_EDGES}? of? {_ROAD}?",
        f"{_BEGINS} from|on|at <start:side> <walkway>",
        f"{_WALK} off|from|out|down of? <start:side> <walkway>",
        f"to|towards|toward|reaching|reaches <end:side> {_EDGES} of? {_ROAD}?",
    )
    + phrases(
        _crosses_sides,
        f"{_CROSS} <road>? to|towards|toward <end:side> {_EDGES}? of? {_ROAD}?",
        f"{_WALK} straight? across|over <road>? to|towards <end:side> {_EDGES}? of? {_ROAD}?",
        f"{_WALK} to|towards|toward|onto|for <end:side> {_EDGES}? of? {_ROAD}?",
    )
)


def _by_parked(found: Found) -> tuple[Fact, ...]:
    side = found.maybe("side", Side)
    settings = {Side.LEFT: Setting.BY_PARKED_LEFT, Side.RIGHT: Setting.BY_PARKED_RIGHT}
    if side is None:
        return (Surroundings(Setting.BY_PARKED),)
    return (Surroundings(settings[side]), Sides(side, None))


FROM_CARS = phrases(
    _by_parked,
    f"{_WALK}? out? from|of between|behind|among <parked>",
    f"{_WALK} out? between|behind|among <parked>",
    f"{_WALK} out? between|behind|among <parked> on|at|to|along <side> side? of? road|street?",
    f"{_WALK}? out? from|of gap between|in|of <parked>",
    *(
        f"{_WALK}? out? from|of {gap} <parked> on|at|to|along <side> side? of? road|street?"
        for gap in ("between|behind|among", "gap between|in|of", "gap in row|line of")
    ),
)


_ALONG = "along|down|up|on|ahead"
_ARRIVES = (
    "coming|comes|arriving|arrives|ending|ends|reaching|getting|emerging|landing|finishing|which"
)

SLANTED = (
    phrases(
        lambda found: (Drifts(found.get("length", Length), Relation.AHEAD),),
        f"{_ARRIVES} out|up|it|there? <length> further|farther? {_ALONG} road|street?",
        "<length> further|farther along|down|up|on road|street?",
        f"{_ARRIVES} out|up|it|there? <length> further|farther|later away?",
        "drifting <length> forward|ahead|along along? road|street?",
    )
    + phrases(
        lambda found: (Drifts(found.get("length", Length), Relation.BEHIND),),
        f"{_ARRIVES} out|up|it|there? <length> nearer|closer to? <ego>?",
        "<length> nearer|closer to? <ego>?",
    )
    + phrases(means((Mention(),)), "diagonally|obliquely|slantwise", "at slant")
    + phrases(
        means((Crosses(),)),
        "takes|taking|take short cut|shortcut across|through? bend|curve|road|street?",
        "takes|taking|take shortcut across|through? bend|curve|road|street?",
        "cuts|cutting across|through? bend|curve|corner",
    )
)

TOGETHER = phrases(
    means((OnRoad(),)),
    "is|are? already|just on|in <road>",
    "has|have already? stepped|walked|entered onto|on|into? <road>",
)

STEPPING = phrases(
    means((Mention(),)),
    "walk|walks|walking|run|runs|running|strolls|strolling|dashes|hurries|emerges|emerging",
    "on foot",
    f"{_WALK} off|from|out|down of? <walkway>",
    f"{_WALK} off|out|down from|of <walkway>",
    f"{_WALK} out",
    "off|leaves|leaving|from <walkway>",
    "without looking|warning|care|caution|attention",
    "without paying attention",
    "out of nowhere",
    "all of sudden",
    "in hurry|rush",
    "in|at normal|slow|leisurely? pace|speedtowards|toward <walkway>",
) + phrases(
    means((Bears(Bearing.AHEAD),)), f"{_WALK} out? in front of it|bus|car|van|truck|vehicle"
)

WALK_RULES = {
    "pedestrian": PEDESTRIANS,
    "crossing": CROSSING,
    "from between cars": FROM_CARS,
    "slanted walk": SLANTED,
    "together": TOGETHER,
    "stepping off": STEPPING,
}
