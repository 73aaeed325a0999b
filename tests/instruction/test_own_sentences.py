"""Our own sentences: how many are read, and that what is read is right."""

from __future__ import annotations

import pytest

from tests.instruction.own_sentences import Sentence, halves, intent_of, sentence_of, wrong_facts

DEVELOPMENT, SECOND = halves()

LATER = [
    sentence_of(line)
    for line in """
Have two cars collide 30 m in front of the ego so that they sit at a 36 degree angle to one another. | what=car count=2 ahead=30 angle=36
In our lane, 20 m ahead, a pair of cars has collided; the angle between the two is 23 degrees. | what=car count=2 ahead=20 angle=23
Two vehicles collided 24 m ahead of the ego vehicle, with 130 degrees between their headings. | what=vehicle count=2 ahead=24 angle=130
I want a crash site about 33 m up ahead with two damaged cars standing nose to tail. | what=car count=2 ahead=33
Someone on foot should cross from the left-hand side to the right-hand side, thirty metres in front of the ego. | what=person count=1 ahead=30 side=left
A pair of pedestrians is walking across the road 17 m in front of our car, coming from the right and going left. | what=person count=2 ahead=17 side=right
Sixteen metres in front of us somebody crosses from left to right, not at the crosswalk. | what=person count=1 ahead=16 side=left
26 m down our lane stands a parked vehicle, a metre to the left of the centre of the lane. | what=vehicle count=1 ahead=26 side=left offset=1
Our lane is blocked 24 m ahead by a van that has stopped 0.5 m to the right of the lane centre. | what=van count=1 ahead=24 side=right offset=0.5
A bus stopped 32 m ahead, with a left offset of 1.1 m from the lane centre. | what=bus count=1 ahead=32 side=left offset=1.1
Bang in the middle of our lane, 43 m ahead, somebody has left a car, which leaves no choice but to overtake. | what=car count=1 ahead=43
A bus is standing 35 m further along in our lane, half a metre to the left of its centre. | what=bus count=1 ahead=35 side=left offset=0.5
Seven cones, 2.5 m from each other, lead from the right-hand edge of the ego's lane across to the left-hand edge, beginning 22 m ahead. | what=cone count=7 ahead=22 side=right spacing=2.5
Three cones side by side, 1.6 m apart, shut our lane 28 m ahead. | what=cone count=3 ahead=28 spacing=1.6
Mark out three cones along the right-hand edge of our lane, one every 2.8 m, from 20 m ahead. | what=cone count=3 ahead=20 side=right spacing=2.8
A worker is surrounded by eight cones in a ring in our lane, 25 m ahead; they are 2.5 m apart. | what=cone count=8 ahead=25 spacing=2.5
""".splitlines()  # noqa: E501
    if line
]
"""Written while the rules were widened."""


def wrong_of(sentences: list[Sentence]) -> tuple[int, list[str]]:
    """How many sentences are read, and the texts of those with a wrong fact."""
    found = [(one, intent_of(one)) for one in sentences]
    read = [(one, intent) for one, intent in found if intent is not None]
    return len(read), [one.text for one, intent in read if wrong_facts(one, intent)]


def test_both_halves_are_of_one_size() -> None:
    assert len(DEVELOPMENT) == len(SECOND) == 60


@pytest.mark.parametrize(("half", "least"), [(DEVELOPMENT, 24), (SECOND, 15)])
def test_what_is_read_is_right(half: list[Sentence], least: int) -> None:
    read, wrong = wrong_of(half)
    assert read >= least
    assert len(wrong) <= 0.02 * read, wrong


@pytest.mark.parametrize("sentence", LATER, ids=lambda one: one.text[:40])
def test_a_later_sentence_is_read_right(sentence: Sentence) -> None:
    intent = intent_of(sentence)
    assert intent is not None
    assert wrong_facts(sentence, intent) == []


def test_a_wrong_fact_is_found() -> None:
    sentence = Sentence(
        text="A van is parked 20 m ahead of us at the right kerb.",
        facts={"what": "bus", "count": "2", "ahead": "21", "side": "left", "offset": "1"},
    )
    intent = intent_of(sentence)
    assert intent is not None
    assert wrong_facts(sentence, intent) == list(sentence.facts)
