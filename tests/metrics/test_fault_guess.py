from __future__ import annotations

import math

import pytest

from augment.checks import findings
from augment.checks.finding import FaultClass
from augment.metrics.fault_guess import first_guess
from augment.scene.entities import Modification, TrafficAgent
from tests.scenes import scene, vehicle


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
