"""The checks name what was done wrong on purpose, and nothing where all is right."""

import inspect
import math

import pytest

from augment.checks.finding import FaultClass
from augment.checks.registry import check_against_intent
from augment.metrics.fault_guess import first_guess
from augment.scene.entities import Modification, TrafficAgent
from bench.faults import MAKERS
from bench.injected_faults import Tally, measure, shifted_share
from tests.checks.worlds import findings
from tests.scenes import scene, vehicle

COUNT = 105


@pytest.fixture(scope="module")
def tally() -> Tally:
    return measure(COUNT, seed=20)


@pytest.mark.parametrize("fault", list(FaultClass))
def test_precision_and_recall_are_above_nine_in_ten(tally: Tally, fault: FaultClass) -> None:
    assert tally.hits[fault] >= COUNT / 5
    assert tally.precision(fault) > 0.9
    assert tally.recall(fault) > 0.9


def test_every_kind_takes_part(tally: Tally) -> None:
    assert tally.kinds == set(MAKERS)


@pytest.mark.slow
def test_right_placements_are_left_alone(tally: Tally) -> None:
    assert tally.right == COUNT
    assert tally.clean >= 0.98 * COUNT


@pytest.mark.slow
def test_a_shift_is_called_a_fault_beyond_the_tolerance_and_not_before() -> None:
    assert shifted_share(1.0) == 0.0
    assert shifted_share(4.0) >= 0.98


def test_the_checks_are_given_neither_reference_nor_label() -> None:
    given = ["ground", "modification", "intent", "tolerances"]
    assert list(inspect.signature(check_against_intent).parameters) == given


@pytest.mark.parametrize(
    ("placed", "classes"),
    [
        ((vehicle("Agent2", 20.0, 0.0),), set()),
        ((vehicle("Agent2", 20.0, 30.0),), {FaultClass.POSITION}),
        ((vehicle("Agent2", 20.0, 0.0, math.pi / 2),), {FaultClass.HEADING}),
        ((vehicle("Agent2", 20.0, 0.0), vehicle("Agent3", 20.1, 0.0)), {FaultClass.LOGIC}),
    ],
    ids=["parked well", "in the field", "across the lane", "on top of each other"],
)
def test_each_class_is_guessed_from_what_was_measured(
    placed: tuple[TrafficAgent, ...], classes: set[FaultClass]
) -> None:
    found = findings(scene(), Modification(added=placed))
    assert first_guess(found) == classes
