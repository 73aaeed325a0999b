"""Purposes measured in small worlds: the numbers in the comments are worked out by hand."""

import math
from dataclasses import replace
from typing import Any

import pytest

from augment.checks import Ground
from augment.checks.ground import ChangedScene
from augment.checks.purpose import check_drive, measure_passage, measure_sight
from augment.scene.entities import Modification, TrafficAgent
from augment.scene.intent import Intent, Length, Purpose
from augment.scene.intent_parts import Amount
from tests.checks.worlds import faults_against
from tests.scenes import cone, pedestrian, scene, vehicle
from tests.simulation.worlds import street


def changed(*added: TrafficAgent) -> ChangedScene:
    return ChangedScene.of(Ground.of(street()), Modification(added=added))


SCREEN = vehicle("Van", 20.0, 1.2)
"""From 17.6 to 22.4 m ahead, its right side 0.2 m left of the middle of the ego's lane."""
WALKER = pedestrian("Walker", 30.0, 1.5)
"""(0.791 + 2.297) / 2 = 1.544 m: just in the ego's way. Its corner is at (30.45, 1.1045)."""


def test_sight() -> None:
    for added, seen_m in (
        # The line from (x, 0) to the corner is above 0.2 m at 22.4 m up to x = 20.62 m; at 8 m/s
        # the ego is past that after 2.6 s, at 20.8 m, hypot(9.2, 1.5) m away.
        ((SCREEN, WALKER), {"Walker": 9.3215}),
        ((SCREEN, replace(WALKER, y_m=1.6)), {}),  # not in the way
        ((WALKER,), {}),  # in sight at t0
        ((replace(SCREEN, x_m=40.0), WALKER), {}),  # behind the walker
        ((cone("Cone", 29.0, 1.2), WALKER), {}),  # nobody hides behind a cone
        # Nobody stands there for 15 s, or 120 m: the ego sees nothing before it has passed.
        ((replace(SCREEN, x_m=140.0), replace(WALKER, x_m=150.0)), {}),
    ):
        assert measure_sight(changed(*added)) == pytest.approx(seen_m, abs=1e-3)


def test_passage() -> None:
    for added, passage_m in (
        ((), 7.0),  # two lanes of 3.5 m
        ((vehicle("A", 30.0, 0.0),), 4.25),  # 5.25 - 1
        ((vehicle("A", 30.0, 0.0), vehicle("B", 30.0, 3.5)), 1.5),  # 2.5 - 1
        # On the slant between the corners (32.4, 1) and (37.6, 2.5): 1.5 across and 5.2 along,
        # so it is the 2.75 m to either edge that counts: 5.25 - 1 and 2.5 + 1.75.
        ((vehicle("A", 30.0, 0.0), vehicle("B", 40.0, 3.5)), 4.25),
        ((vehicle("A", 30.0, 0.0), vehicle("B", 36.0, 3.5)), 1.9209),  # hypot(1.2, 1.5)
        ((cone("A", 30.0, 1.0), cone("B", 30.0, 3.0)), 2.5),  # 0.75 + 1.75
        ((vehicle("A", 30.0, 0.0, speed_mps=5.0),), 7.0),  # it drives
        ((vehicle("A", 30.0, 1.75, width_m=7.0),), 0.0),
    ):
        assert measure_passage(changed(*added)) == pytest.approx(passage_m, abs=0.02)


def test_off_the_map_nothing_is_measured() -> None:
    off = replace(scene(), lanes=(), connectors=())
    situation = ChangedScene.of(Ground.of(off), Modification())
    assert (measure_sight(situation), measure_passage(situation)) == ({}, 0.0)


WIDE = Intent(purpose=Purpose(passage=Length(low_m=2.0, high_m=4.3)))
EXACT = Intent(purpose=Purpose(passage=Length(low_m=4.25, high_m=4.25)))
HIDDEN = Intent(purpose=Purpose(sight=Length(low_m=9.0, high_m=10.0)))
ACROSS = vehicle("A", 30.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("intent", "added", "words"),
    [
        (WIDE, [vehicle("A", 30.0, 0.0)], []),
        (EXACT, [vehicle("A", 30.0, 0.0)], []),
        (WIDE, [], ["past is 7.00 m; 2 to 4.3 m is asked for."]),
        (WIDE, [vehicle("A", 30.0, -1.0)], ["past is 5.25 m; 2 to 4.3 m is asked for."]),
        (WIDE, [ACROSS], []),  # that it stands across is nobody's fault: nothing forbids it
        (HIDDEN, [SCREEN, WALKER], []),
        (HIDDEN, [WALKER], ["is hidden from it at first."]),
        (replace(HIDDEN, purpose=Purpose(sight=Length(low_m=2.0, high_m=9.0))), [SCREEN, WALKER],
         ["first sees the pedestrian is 9.32 m; 2 to 9 m is asked for."]),
    ],
)  # fmt: skip
def test_the_effect_alone_is_held_against_a_purpose(
    intent: Intent, added: list[TrafficAgent], words: list[str]
) -> None:
    found = faults_against(street(), Modification(added=tuple(added)), intent)
    faults = [one.sentence() for one in found]
    assert len(faults) == len(words), faults
    assert all(said.endswith(end) for said, end in zip(faults, words, strict=True)), faults


def test_moving_and_removing_may_serve_a_purpose() -> None:
    scene = replace(street(), agents=(vehicle("A", 30.0, 0.0), vehicle("B", 50.0, 0.0)))
    moved = replace(scene.agents[0], x_m=35.0)
    change = Modification(moved=(moved,), removed=("B",))
    assert faults_against(scene, change, WIDE) == []


@pytest.mark.parametrize(
    ("drive", "faults"),
    [
        ({"braking_mps2": 4.0, "ttc_s": 1.5, "crashes": False}, 0),
        ({"braking_mps2": 8.1, "ttc_s": 1.5, "crashes": False}, 1),
        ({"braking_mps2": 2.9, "ttc_s": math.inf, "crashes": False}, 2),
        ({"braking_mps2": 4.0, "ttc_s": 1.5, "crashes": True}, 1),
    ],
)
def test_a_drive_is_held_against_what_a_purpose_says(drive: dict[str, Any], faults: int) -> None:
    purpose = Purpose(braking_mps2=Amount(low=3.0, high=8.0), ttc_s=Amount(low=1.0, high=2.5))
    assert sum(one.is_fault for one in check_drive(purpose, "idm", **drive)) == faults
    assert list(check_drive(Purpose(passage=Length(low_m=3.0, high_m=3.0)), "idm", **drive)) == []
