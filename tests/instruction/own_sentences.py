"""Our own sentences with the facts that a careful reader finds in them, and who is right."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from augment.errors import InstructionNotUnderstood
from augment.instruction import parse
from augment.instruction.intent import (
    ConesRequest,
    CrashRequest,
    Intent,
    LaneChoice,
    LateralTarget,
    Length,
    Relation,
    Request,
    Side,
    VehicleRequest,
    WalkRequest,
)

_FILE = Path(__file__).with_name("own_sentences.txt")
_SIDES: dict[str, set[LateralTarget | Side]] = {
    "left": {LateralTarget.LEFT_BOUNDARY, Side.LEFT},
    "right": {LateralTarget.RIGHT_BOUNDARY, Side.RIGHT},
    "kerb": {LateralTarget.KERB},
}
_NEAR_M = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Sentence:
    """A sentence and what it asks for, by name of the fact."""

    text: str
    facts: dict[str, str]


def sentence_of(line: str) -> Sentence:
    """A line of the file: a sentence and its facts."""
    text, _, facts = line.partition(" | ")
    return Sentence(text=text, facts=dict(fact.split("=") for fact in facts.split()))


def halves() -> tuple[list[Sentence], list[Sentence]]:
    """The half that rules are developed against, and the second half."""
    lines = [line for line in _FILE.read_text().splitlines() if not line.startswith("#")]
    sentences = [sentence_of(line) for line in lines]
    return sentences[0::2], sentences[1::2]


def intent_of(sentence: Sentence) -> Intent | None:
    """What the grammar makes of it, None if it refuses."""
    try:
        return parse(sentence.text)
    except InstructionNotUnderstood:
        return None


def wrong_facts(sentence: Sentence, intent: Intent) -> list[str]:
    """The names of the facts that the intent has otherwise than the sentence."""
    oncoming = [one for one in intent.requests if one.spot.lane is LaneChoice.ONCOMING]
    rest = [one for one in intent.requests if one not in oncoming]
    if len(rest) != 1:
        return ["one request"]
    (request,) = rest
    wrong = [
        name
        for name, wanted in sentence.facts.items()
        if not _holds(name, wanted, request, oncoming, intent)
    ]
    return wrong if "oncoming" in sentence.facts or not oncoming else [*wrong, "oncoming"]


# Private


def _holds(
    name: str, wanted: str, request: Request, oncoming: list[Request], intent: Intent
) -> bool:
    match name:
        case "what":
            return _kind(request) in wanted.split("|")
        case "count":
            return request.count == int(wanted)
        case "ahead":
            ahead = request.spot.relation is Relation.AHEAD
            return ahead and _is(wanted, request.spot.distance)
        case "side":
            return bool(_SIDES[wanted] & _named_sides(request))
        case "offset":
            return _is(wanted, request.spot.lateral.offset)
        case "spacing":
            return isinstance(request, ConesRequest) and _is(wanted, request.spacing)
        case "length":
            return isinstance(request, ConesRequest) and request.reach_m == float(wanted)
        case "angle":
            return isinstance(request, CrashRequest) and abs(request.turn_deg or 0.0) == float(
                wanted
            )
        case "oncoming":
            return _comes(wanted, oncoming, intent)
    raise ValueError(f"unknown fact {name!r}")


def _kind(request: Request) -> str:
    match request:
        case WalkRequest():
            return "person"
        case ConesRequest():
            return "cone"
        case VehicleRequest() | CrashRequest():
            return request.body.value


def _is(wanted: str, length: Length | None) -> bool:
    if length is None:
        return False
    low, _, high = wanted.partition("..")
    return (
        abs(length.low_m - float(low)) < _NEAR_M
        and abs(length.high_m - float(high or low)) < _NEAR_M
    )


def _named_sides(request: Request) -> set[LateralTarget | Side]:
    lateral = request.spot.lateral
    named: set[LateralTarget | Side] = {lateral.target}
    named |= {lateral.also} if lateral.also else set()
    if isinstance(request, WalkRequest | ConesRequest) and request.start is not None:
        named.add(request.start)
    return named


def _comes(wanted: str, oncoming: list[Request], intent: Intent) -> bool:
    """Oncoming traffic without a number may be the scene's own, which is passed over."""
    if wanted == "yes":
        return bool(oncoming) or any("traffic" in words for words in intent.ignored)
    return len(oncoming) == 1 and _is(wanted, oncoming[0].spot.distance)
