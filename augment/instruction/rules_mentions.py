"""Rules about words that place nothing: which of several is meant, manner, looks."""

from __future__ import annotations

from augment.instruction.facts import Mention, Purpose, Rank, Which
from augment.instruction.phrases import Phrase, means, phrases
from augment.instruction.tokens import word_set

_NOUN = "one|cone|pylon|car|vehicle|pedestrian|person|walker|bus|van|truck|jaywalker"
_QUEUE = "queue|line|row|group|column|them|these|taper"


def _which(rank: Rank, words: str) -> tuple[Phrase, ...]:
    return phrases(
        means((Which(rank),)),
        f"{words} {_NOUN}?",
        f"{words} {_NOUN}? of|in {_QUEUE}",
        f"{words} of",
    )


MENTIONS = (
    phrases(
        means((Mention(),)),
        "<ego>",
        "<us> is|are? approaching|approaches|approach|encounters|encounter|faces|face|meets",
        "<us> reaches|reach|meet|sees|see|finds|find",
        "<us> is|are? coming|comes|come|driving|drives|drive up? upon|on|to|across|towards",
        "hidden|concealed behind <neighbour>",
        "out? from behind <neighbour>",
        "walks|walking|steps|stepping|comes|coming|emerges|emerging out? from behind <neighbour>",
        "all|both|each|some of? them|cars|vehicles|pedestrians|people?",
        "hides|hiding|conceals|concealing|covers|obscures|obscuring",
        "hidden|concealed|obscured|covered by|behind <neighbour>",
        "its centre|center|middle|midpoint is?",
        "stand|stands|standing|placed? side by side",
        "on <ego> side of road|street",
        "obstacle is|being?",
        "centred|centered",
        "vehicle|car|bus|van|truck|lorry 's centre|center|middle|midpoint is?",
        "centre|center|middle|midpoint of vehicle|car|bus|van|truck|lorry is?",
        "at|from point|spot|place|position",
        "in which",
        "set|lay|mark|line|put|place out|up|down",
        "somebody|someone|they has|have? left",
        "neighbouring|adjacent|consecutive|successive cones|pylons?",
        "stand|stands|standing|placed? next|close to each|one other|another",
    )
    + _which(Rank.FIRST, "first|nearest|nearer|closest|closer|foremost")
    + phrases(means((Which(Rank.FIRST),)), "one in|at front", "leader")
    + phrases(means((Which(Rank.FIRST),)), "one", f"one of {_QUEUE}")
    + _which(Rank.SECOND, "second")
    + _which(Rank.THIRD, "third")
    + _which(Rank.FOURTH, "fourth")
    + _which(Rank.LAST, "last|final|rearmost|farthest|furthest|farther|further")
    + phrases(means((Which(Rank.OTHER),)), f"other|others {_NOUN}?", f"next {_NOUN}?")
    + phrases(means((Which(Rank.FORMER),)), "former")
    + phrases(means((Which(Rank.LATTER),)), "latter")
)

LOOKS = word_set(
    "red blue green white black grey gray silver yellow orange brown dark bright light coloured "
    "colored small big large little compact tall young old elderly lone lonely normal ordinary "
    "regular typical careless distracted"
)
"""Adjectives before a noun that change nothing about a placement."""

MANNER = phrases(
    means((Purpose(),)),
    "slowly|quickly|hastily|hurriedly|calmly|carelessly|unexpectedly|abruptly|briskly|leisurely",
    "would|should|ought|d|needs|wants|has|have|is|are|going|meant|supposed|like|love|want to be",
    "would|d|'d|like|love|want|need|prefer|wish to see|have|add|get|put|place|insert|include",
    "to see",
    "to be",
    "as? part of scene|scenario",
    "into|to|in scene|scenario|simulation|picture|map|world",
    "at night",
    "at moment",
    "of course",
    "for me",
    "give or take",
    "at time",
    "of all places",
    "in that place|spot",
    "in broad? daylight",
    "for? some|no|unknown reason",
)

MENTION_RULES = {"mention": MENTIONS, "manner": MANNER}
