"""What is not understood is refused, with a reason and the words at fault; never guessed."""

from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.errors import InstructionNotUnderstood
from augment.instruction import parse
from augment.instruction.reading import RULES
from augment.instruction.word_lists import FILLERS

WORDS = sorted(
    {
        word
        for options in RULES.values()
        for option in options
        for piece in option.pieces
        for word in piece.words
    }
    | FILLERS
    | {
        "ego",
        "car",
        "left",
        "right",
        "two",
        "m",
        "20",
        "1.5",
        "about",
        "-",
        ".",
        "lane",
        "(",
        "'s",
    }
)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "empty"),
        ("  \n\t ", "empty"),
        ("x" * 10_000, "10000 characters"),
        ("add a parked car 20 m ahead " * 400, "characters"),
        ("blorp", "blorp"),
        ("hello", "hello"),
        ("please", "No object"),
        ("20 m ahead of the ego", "No object"),
        ("add an elephant 20 m ahead", "elephant"),
        ("add a parked car with a purple antenna 20 m ahead", "purple"),
        ("Füge 20 m vor dem Ego ein geparktes Auto hinzu", "füge"),
        ("在自车前方20米处添加一辆停着的车", "在自车前方"),
        ("ajoute une voiture garée à 20 m devant", "ajoute"),
        ("add a parked car", "How far away"),
        ("add a parked car in front of the ego", "How far away"),
        ("add a parked car 20 m from the ego", "ahead of the ego or behind"),
        ("add a parked car 20 ahead", "20"),
        ("add a parked car -20 m ahead", "-"),
        ("add a parked car 1,5 m ahead", "1,5"),
        ("add a parked car 20 s ahead", "20"),
        ("add a parked car 20 m ahead of the bus", "a distance from a neighbour"),
        ("add a parked car 20 m behind the bus", "a distance from a neighbour"),
        ("add a parked car 20 m ahead, next to the bus", "to"),
        ("add a parked car 20 m ahead. The bus stands still.", "was not named before"),
        ("add a parked car 20 m ahead and 30 m ahead", "distances contradict"),
        ("add a parked car 20 m ahead of the ego, behind the ego", "directions contradict"),
        ("add a parked car 20 m ahead in the left lane and in the right lane", "lanes contradict"),
        (
            "a parked car 20 m ahead towards the left lane boundary, towards the right boundary",
            "sides contradict",
        ),
        ("a parked car 20 m ahead, offset 1 m from the lane centre", "To which side"),
        ("a parked car 20 m ahead with a slight offset", "To which side"),
        ("a parked car 20 m ahead to the left", "to"),
        ("a parked car 20 m ahead on the left side", "on"),
        ("a parked car 20 m ahead in the middle of the lane, slightly to the left", "contradict"),
        ("a parked car 20 m ahead moving at 8 m/s", "stand and move"),
        ("an oncoming car 40 m ahead", "one speed"),
        ("a car 20 m ahead turned by 30 degrees", "turned"),
        ("two parked cars 20 m ahead", "a place each"),
        ("parked cars 20 m ahead", "How many vehicles"),
        ("a parked car 20 m ahead with a spacing of 2 m", "spacing"),
        ("a pedestrian 20 m ahead", "does is not said"),
        ("a pedestrian crosses the road 20 m ahead", "From which side"),
        ("a pedestrian crosses from left to left 20 m ahead", "contradict"),
        ("pedestrians cross from left to right 20 m ahead", "How many pedestrians"),
        ("9 pedestrians cross from left to right 20 m ahead", "from 1 to 6"),
        ("cones 20 m ahead", "How many cones"),
        ("a taper of 400 cones 20 m ahead", "from 1 to 40"),
        ("a construction zone with 2 workers 20 m ahead", "Exactly one worker"),
        ("a worker stands 20 m ahead", "beside cones"),
        ("a ring of 8 cones along the left lane boundary 20 m ahead", "means nothing"),
        ("an accident 20 m ahead", "How many vehicles"),
        ("an accident of 9 cars 20 m ahead", "from 1 to 4"),
        ("a parked car 20 m ahead, partly blocking the lane", "How far it stands in the lane"),
        ("a parked car 20 m ahead on the wrong side of the road", "depends on where it faces"),
        ("a car 20 m ahead, 1 m left of the lane centre, at the right kerb", "contradict"),
        ("a car moves 20 m ahead", "moves"),
        ("12 cones on both sides of the lane, starting 20 m ahead", "on both together"),
        ("7 cones from 20 m to 32 m ahead along the kerb, 5 m apart", "contradict"),
        ("cones every 5 m from 20 m to 32 m ahead along the kerb", "no whole number"),
        ("cones starting 30 m ahead and ending 20 m ahead along the kerb", "end before"),
        ("two crashed cars 20 m ahead, the third one 4 m in front of it", "More than 2"),
        ("a bus and a car have collided 20 m ahead", "different kinds"),
        ("a bus has hit a car 20 m ahead", "different kinds"),
        ("three pedestrians cross from left to right 20 m ahead, the second follows 2 m", "clear"),
        ("remove the parked car 20 m ahead", "only adding"),
        ("move the bus 20 m ahead", "only adding"),
        ("do not add a parked car 20 m ahead", "negations"),
        ("add a parked car 20 m or 30 m ahead", "alternatives"),
    ],
)
def test_a_sentence_is_refused_with_its_reason(text: str, reason: str) -> None:
    with pytest.raises(InstructionNotUnderstood) as refusal:
        parse(text)
    assert reason in refusal.value.reason


def test_a_refusal_tells_what_was_read_and_what_was_not() -> None:
    with pytest.raises(InstructionNotUnderstood) as refusal:
        parse("Add a parked car 20 m ahead of the ego beside the fountain.")
    assert refusal.value.understood == ("a parked car", "20 m ahead of the ego")
    assert refusal.value.ignored == ("beside", "fountain")


def only_intent_or_refusal(text: str) -> None:
    """Any other error of `parse` fails the test that calls this."""
    with suppress(InstructionNotUnderstood):
        assert parse(text).requests


@given(st.text(max_size=200))
def test_any_text_is_read_or_refused(text: str) -> None:
    only_intent_or_refusal(text)


@given(st.lists(st.sampled_from(WORDS), max_size=25))
def test_any_row_of_known_words_is_read_or_refused(words: list[str]) -> None:
    only_intent_or_refusal(" ".join(words))
