"""Whether something stands where a pedestrian is to walk."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from augment.checks import FindingKind, Severity
from augment.checks.finding import FaultClass
from augment.metrics.fault_guess import first_guess
from augment.scene.entities import AgentType, TrafficAgent
from tests.checks.worlds import found_in, of_kind
from tests.scenes import cone, pedestrian, scene, vehicle

WALKER = pedestrian("Agent2", 30.0, -4.0, (30.0, 6.0))
PARKED = vehicle("Agent3", 31.0, -1.0)


@pytest.mark.parametrize(
    ("other", "inside_m"),
    [
        (PARKED, 2.0),
        (vehicle("Agent3", 32.3, -1.0), 2.0),
        (vehicle("Agent3", 32.5, -1.0), None),  # he walks past its bumper
        (vehicle("Agent3", 30.0, -1.0, math.radians(45.0)), 2.0 * math.sqrt(2.0)),
        # The corner of a box turned by 45 degrees, 0.02 and 0.07 m past his way.
        (vehicle("Agent3", 32.38, -1.0, math.radians(45.0)), None),
        (vehicle("Agent3", 32.33, -1.0, math.radians(45.0)), 0.148),
        (replace(PARKED, speed_mps=3.0), None),  # it will be gone
        (cone("Agent3", 30.2, 3.0), 0.5),
        (pedestrian("Agent3", 30.0, 2.0), None),
        (vehicle("Agent3", 30.0, 8.0), None),  # beyond where he stops
        (vehicle("Agent3", 30.0, -6.0), None),  # behind him
    ],
)
def test_a_walk_leads_through_nothing_that_stands(
    other: TrafficAgent, inside_m: float | None
) -> None:
    found = of_kind(found_in(scene(agents=(other,)), WALKER), FindingKind.WALK_BLOCKED)
    assert [one.severity for one in found] == [Severity.DOUBTFUL] * (inside_m is not None)
    for one in found:
        assert one.agents == ("Agent2", "Agent3")
        assert one.measured["inside_m"] == pytest.approx(inside_m, abs=0.001)
        assert one.sentence() == f"The walk of Agent2 leads {inside_m:.1f} m through Agent3."


def test_what_is_added_stands_in_the_way_as_well() -> None:
    bus = replace(PARKED, type=AgentType.BUS)
    assert of_kind(found_in(scene(), bus, WALKER), FindingKind.WALK_BLOCKED)


def test_a_blocked_walk_is_a_fault_of_logic_unless_it_follows_from_a_heading() -> None:
    blocked = found_in(scene(agents=(PARKED,)), WALKER)
    assert first_guess(blocked) == {FaultClass.LOGIC}
    backwards = replace(WALKER, heading_rad=-math.pi / 2.0)
    turned = found_in(scene(agents=(PARKED,)), backwards)
    assert first_guess(turned) == {FaultClass.HEADING}
