from __future__ import annotations

import pytest

from augment.instruction.intent import Length
from augment.instruction.phrases import Found, means, phrases
from augment.instruction.reading import RULES, read
from augment.instruction.tokens import tokenize
from augment.instruction.word_lists import FILLERS
from augment.instruction.wording import SLOTS


def longest(pattern: str, text: str) -> int:
    """How many tokens of the text a pattern reads, 0 if it does not match."""
    (phrase,) = phrases(means(True), pattern)
    return max((end for end, _ in phrase.read(tokenize(text), 0, SLOTS)), default=0)


@pytest.mark.parametrize(
    ("pattern", "text", "tokens"),
    [
        ("at? distance of", "distance of 3 m", 2),
        ("at? distance of", "at a distance of 3 m", 4),
        ("ahead|forward", "forward", 1),
        ("ahead|forward", "backward", 0),
        ("in <ego> lane", "in the ego's lane", 5),
        ("offset <length>", "offset (about 2.5 m)", 5),
        ("offset <length>", "offset the ( the ( 2 m", 0),
    ],
)
def test_a_pattern_reads_as_far_as_it_fits(pattern: str, text: str, tokens: int) -> None:
    assert longest(pattern, text) == tokens


@pytest.mark.parametrize(
    ("text", "low_m", "high_m", "about"),
    [
        ("21.4m", 21.4, 21.4, False),
        ("about 21.4 m", 21.4, 21.4, True),
        ("approx. 20 metres", 20.0, 20.0, True),
        ("~ 20 m", 20.0, 20.0, True),
        ("twelve meters", 12.0, 12.0, False),
        ("100 ft", 30.48, 30.48, False),
        ("0.5 km", 500.0, 500.0, False),
        ("15-20 m", 15.0, 20.0, False),
        ("15 – 20 m", 15.0, 20.0, False),
        ("between 0 to 1.5m", 0.0, 1.5, False),
        ("between 15 and 20 m", 15.0, 20.0, False),
        ("from 15 m to 20 m", 15.0, 20.0, False),
    ],
)
def test_lengths_are_read_with_their_units(
    text: str, low_m: float, high_m: float, about: bool
) -> None:
    tokens = tokenize(text)
    end, length = next(SLOTS["length"](tokens, 0))
    assert end == len(tokens)
    assert isinstance(length, Length)
    assert (length.low_m, length.high_m) == pytest.approx((low_m, high_m))
    assert length.is_approximate is about


@pytest.mark.parametrize(
    "text", ["20", "20 s", "-5 m", "20 m/s", "1,5 m", "1.2.3 m", "20 to 15 m", "20 inches", "m"]
)
def test_what_is_no_length_is_not_read_as_one(text: str) -> None:
    tokens = tokenize(text)
    whole = [end for end, _ in SLOTS["length"](tokens, 0) if end == len(tokens)]
    assert whole == []


def test_a_pattern_must_not_match_nothing() -> None:
    with pytest.raises(ValueError, match="could match nothing"):
        phrases(means(True), "at? of?")


def test_a_slot_of_another_kind_is_a_mistake_of_the_rule() -> None:
    with pytest.raises(TypeError, match="not a Length"):
        Found({"length": 3}).get("length", Length)


def test_every_word_is_read_listed_or_reported() -> None:
    found = read("Please add a parked car with a purple antenna 20 m ahead of the ego.")
    assert [part.words for part in found.reads] == ["a parked car", "20 m ahead of the ego"]
    assert [token.text for token in found.unknown] == ["purple", "antenna"]


def test_no_filler_carries_a_side_a_place_or_a_negation() -> None:
    meaning = {"left", "right", "behind", "before", "between", "of", "from", "to", "not", "no"}
    assert not FILLERS & meaning


def test_every_slot_that_a_rule_names_exists() -> None:
    named = {
        piece.slot
        for options in RULES.values()
        for option in options
        for piece in option.pieces
        if piece.slot
    }
    assert named <= set(SLOTS)
