"""Clauses that place nothing: what the ego has to do about it, why, and that traffic is kept.

Such a clause is passed over as a whole, whatever its words, if it holds no number and names
nothing new; a clause about something else than the ego must also hold no word about a place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain

from augment.instruction.facts import Fact, Kept, Purpose
from augment.instruction.numbers import NUMBER_WORDS
from augment.instruction.phrases import Phrase, Tokens, means, phrases
from augment.instruction.quantities import METRES
from augment.instruction.tokens import word_set
from augment.instruction.word_lists import (
    ADDING,
    BODY_WORDS,
    OTHER_NOUNS,
    PLACE_WORDS,
    SENTENCE_ENDS,
)
from augment.instruction.wording import SLOTS

_MODAL = (
    "must|should|shall|can|could|may|might|will|would|needs|need|has|have|is|cannot|wants|tries|"
    "gets|reaches|sees|passes|nudges|overtakes|brakes|waits|stops|keeps|stays|approaches|comes|"
    "drives|does|then|only|just|still|squeezes|steers|swerves|slows|yields|avoids|goes|nears"
)
_FORCE = (
    "forcing|making|causing|requiring|obliging|letting|allowing|compelling|prompting|leaving|"
    "force|make|cause|require|let|allow|oblige|leave|give|giving|test|challenge|see"
)
_FORCES = "forces|makes|causes|requires|obliges|lets|allows|leaves|gives|means|prompts"
_ALL = "all|other|others|rest|existing|recorded|remaining|current|original|present|oncoming"
_TRAFFIC = (
    "traffic|users|vehicles|cars|agents|participants|people|objects|everything|everybody|everyone"
)

_MUSTS = "have|must|need|needs|can|cannot|will|should|could|may|might|would"
_ACTS = (
    "use|pass|overtake|squeeze|get|go|drive|steer|nudge|swerve|slow|stop|wait|brake|avoid|evade|"
    "manoeuvre|maneuver|cross|change|yield|make|be"
)

_ABOUT_EGO = phrases(
    means((Purpose(),)),
    f"so|such? that|therefore|thus? <ego> {_MODAL}",
    f"<ego> {_MODAL}",
    f"{_FORCE} <ego>",
    f"which|and|that {_FORCES} <ego>",
    f"to {_FORCE} <ego>",
    "in order to",
    f"we {_MUSTS} to? only|then|just|therefore|even? {_ACTS}",
    "only way|option|choice|possibility|chance",
    "which|and? leaves|leaving|means|gives|giving no|little|only|just|hardly|barely|enough",
    "getting|going|driving|squeezing past|by|around|round means|requires|takes|needs|is|forces",
    "in order for <ego>",
    "for <ego> to",
    f"while|as|when|until|before|once <ego> {_MODAL}",
    "while|as|when <ego>",
    "passing|overtaking|nudging <obstacle>",
    "going|driving|getting around|past|round <obstacle>",
    "through|using|via|into|over|on <oncoming>",
    "by using|driving|going|changing|crossing|moving|swerving",
    "there is no|little|barely|hardly|just|only|not|enough other? way|room|space",
    "there is just|only|barely|hardly|not enough way|room|space",
    "no|little|enough way|room|space|choice|option",
)
"""How a clause begins whose subject is the ego, or its way past; directions in it are its own."""

_ABOUT_OTHERS = phrases(
    means((Purpose(),)),
    "so|such that",
    "which means",
    "because|since",
    "due|owing to",
    "leaving",
    "it|they can|must|has|have|may|cannot only? to? be? overtaken|passed|avoided",
    "oncoming traffic|vehicles|cars has|have|may|can|must|will|is|are|comes|come",
    "traffic has|have|may|can|must|will|is|are",
)
"""How a reason or a consequence begins that may be about the thing itself."""

_STAYS = word_set("stay stays remain remains kept keep keeps unchanged continue continues is are")


@dataclass(frozen=True, slots=True)
class Aside:
    """A clause that was passed over, and the index behind it."""

    end: int
    fact: Fact


PlaceAt = Callable[[int], bool]
"""Whether a phrase that places something begins at an index."""


def aside_at(tokens: Tokens, at: int, places: PlaceAt) -> Aside | None:
    """The clause that begins here and places nothing, None if there is none."""
    if _opens(_ABOUT_EGO, tokens, at):
        end = _end(tokens, at, places, frozenset())
        return None if end is None else Aside(end, Purpose(is_passed=_passes(tokens[at:end])))
    if _opens(_ABOUT_OTHERS, tokens, at):
        end = _end(tokens, at, places, PLACE_WORDS)
        return None if end is None else Aside(end, Purpose())
    if (end := _kept(tokens, at)) is not None:
        return Aside(end, Kept())
    return None


# Private


def _opens(options: tuple[Phrase, ...], tokens: Tokens, at: int) -> bool:
    found = chain.from_iterable(option.read(tokens, at, SLOTS) for option in options)
    return next(found, None) is not None


_PASSING = word_set(
    "pass passing overtake overtaking nudge nudging avoid avoiding brake wait evade squeeze "
    "swerve past around yield"
)


def _passes(tokens: Tokens) -> bool:
    return any(token.text in _PASSING for token in tokens)


def _end(tokens: Tokens, at: int, places: PlaceAt, never: frozenset[str]) -> int | None:
    """Behind the clause: at the end of its sentence, or where something to place begins."""
    joint = None
    for index in range(at, len(tokens)):
        text = tokens[index].text
        if text in SENTENCE_ENDS:
            return index
        if text in {",", "—", "–", ")"} or text == "and":
            if index > at and places(index + 1):
                return index
            joint = index if index > at else joint
        if text in never or _is_number(tokens, index) or _is_new(tokens, index):
            return joint
    return len(tokens)


def _kept(tokens: Tokens, at: int) -> int | None:
    """Behind a clause that says that the traffic stays as it is."""
    opens = tokens[at].text in {"keep", "leave", "retain", "preserve", "keeping", "leaving"}
    has_traffic = has_stay = False
    for index in range(at, min(at + 14, len(tokens))):
        text = tokens[index].text
        following = tokens[index + 1].text if index + 1 < len(tokens) else ""
        adds = text in {"and", "but", "then"} and following in ADDING
        if adds or text in SENTENCE_ENDS or text in {",", "—", "–"}:
            return index if has_traffic and (opens or has_stay) else None
        if _is_number(tokens, index) or text in {"a", "an"}:
            return None
        has_traffic = has_traffic or text in _TRAFFIC_WORDS
        has_stay = has_stay or (has_traffic and text in _STAYS)
        if not opens and not has_traffic and text not in _BEFORE_TRAFFIC:
            return None
    return len(tokens) if has_traffic and (opens or has_stay) else None


_TRAFFIC_WORDS = frozenset(_TRAFFIC.split("|"))
_BEFORE_TRAFFIC = frozenset([*_ALL.split("|"), "the", "of", "road", "with", "and", "parked"])


def _is_number(tokens: Tokens, at: int) -> bool:
    if tokens[at].number is not None:
        return True
    following = tokens[at + 1].text if at + 1 < len(tokens) else ""
    return tokens[at].text in NUMBER_WORDS and following in METRES


def _is_new(tokens: Tokens, at: int) -> bool:
    """Whether "a car" or "two cars" begins here."""
    text = tokens[at].text
    if text not in {"a", "an", "another"} and NUMBER_WORDS.get(text, 0) < 2:
        return False
    if at > 0 and tokens[at - 1].text in {"the", "these", "those", "both"}:
        return False
    near = [token.text for token in tokens[at + 1 : at + 4]]
    return any(word in BODY_WORDS or word in OTHER_NOUNS for word in near)
