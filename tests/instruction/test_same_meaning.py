"""Laws: what changes nothing about a sentence's meaning changes nothing about its intent."""

from __future__ import annotations

import time
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from augment.baselines.rule_placer import place
from augment.errors import InstructionNotUnderstood
from augment.instruction import parse
from augment.instruction.intent import LateralTarget, VehicleRequest, WalkRequest
from augment.instruction.numbers import NUMBER_WORDS
from augment.scene.entities import Scene
from tests.scenes import scene

SENTENCES = (
    "A parked car stands {d} m ahead of the ego, {o} m left of the lane centre.",
    "Place a stopped bus {d} m in front of the ego, {o} m to the left of the lane centre.",
    "{d} m ahead a van is parked, offset {o} m from the lane centre towards the left boundary.",
    "In front of us, at a distance of {d} m, a car has stopped, shifted by {o} m to the left.",
)
sentences = st.sampled_from(SENTENCES)
distances = st.integers(10, 60)
few = settings(max_examples=12)
offsets = st.sampled_from(["0.3", "0.5", "1.0", "1.2"])


def vehicle_of(text: str) -> VehicleRequest:
    (request,) = parse(text).requests
    assert isinstance(request, VehicleRequest)
    return request


def in_words(number: int) -> str:
    by_value = {value: word for word, value in NUMBER_WORDS.items()}
    if number in by_value:
        return by_value[number]
    return f"{by_value[number // 10 * 10]}-{by_value[number % 10]}"


@few
@given(sentences, distances, offsets)
def test_words_are_digits(sentence: str, distance: int, offset: str) -> None:
    digits = vehicle_of(sentence.format(d=distance, o=offset))
    words = vehicle_of(sentence.format(d=in_words(distance), o=offset))
    assert words == digits


@few
@given(sentences, distances, offsets)
def test_case_and_added_politeness_change_nothing(
    sentence: str, distance: int, offset: str
) -> None:
    text = sentence.format(d=distance, o=offset)
    assert vehicle_of(text.upper()) == vehicle_of(text)
    assert vehicle_of(f"Please, {text} The ego has to slow down.") == vehicle_of(text)


@pytest.mark.parametrize(
    "length", ["20 m", "20m", "20-metre", "20 meters", "2000 cm", "0.02 km", "twenty metres"]
)
def test_units_are_one_length(length: str) -> None:
    request = vehicle_of(f"a parked car at a distance of {length} ahead")
    assert request.spot.distance.low_m == pytest.approx(20.0)


def mirrored(text: str) -> str:
    return text.replace("left", "#").replace("right", "left").replace("#", "right")


@few
@given(sentences, distances, offsets)
def test_exchanged_sides_are_mirrored(sentence: str, distance: int, offset: str) -> None:
    text = sentence.format(d=distance, o=offset)
    one, other = vehicle_of(text), vehicle_of(mirrored(text))
    assert one.spot.lateral.target is LateralTarget.LEFT_BOUNDARY
    assert other.spot.lateral.target is LateralTarget.RIGHT_BOUNDARY
    turned = replace(other.spot.lateral, target=LateralTarget.LEFT_BOUNDARY)
    assert replace(other, spot=replace(other.spot, lateral=turned)) == one


def test_exchanged_sides_of_a_walk_are_mirrored() -> None:
    text = "A pedestrian crosses from the left kerb to the right kerb 20 m ahead."
    (one,), (other,) = parse(text).requests, parse(mirrored(text)).requests
    assert isinstance(one, WalkRequest)
    assert isinstance(other, WalkRequest)
    assert one.start is other.start.other


@few
@given(sentences, distances, offsets)
def test_exchanged_sides_are_placed_mirrored(sentence: str, distance: int, offset: str) -> None:
    text = sentence.format(d=distance, o=offset)
    shown: Scene = scene()
    (one,), (other,) = (place(shown, words).modification.added for words in (text, mirrored(text)))
    assert (one.x_m, one.y_m) == (other.x_m, -other.y_m)


@pytest.mark.parametrize(
    "text",
    [
        "the " * 480,
        "at an angle of " * 130,
        "so that the ego, and " * 90,
        "2 m from the first one and " * 70,
        "(((((the the a an" * 110,
        "from left to right of the road " * 60,
    ],
)
def test_long_texts_lead_no_pattern_astray(text: str) -> None:
    """A pattern that tries every way to split a text would take hours; this takes a second."""
    assert len(text) <= 2000
    start = time.process_time()
    with pytest.raises(InstructionNotUnderstood):
        parse(text)
    assert time.process_time() - start < 20.0
