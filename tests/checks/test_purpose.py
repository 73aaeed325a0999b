"""Purposes measured in small worlds: the numbers in the comments are worked out by hand."""

from collections.abc import Sequence
from dataclasses import replace

import pytest

from augment.checks import Ground
from augment.checks.ground import ChangedScene
from augment.checks.purpose import measure_passage, measure_sight
from augment.scene.entities import Modification, TrafficAgent
from tests.scenes import cone, pedestrian, scene, vehicle
from tests.simulation.worlds import street


def changed(*added: TrafficAgent) -> ChangedScene:
    return ChangedScene.of(Ground.of(street()), Modification(added=added))


SCREEN = vehicle("Van", 20.0, 1.2)
"""From 17.6 to 22.4 m ahead, its right side 0.2 m left of the middle of the ego's lane."""
WALKER = pedestrian("Walker", 30.0, 1.5)
"""(0.791 + 2.297) / 2 = 1.544 m: just in the ego's way. Its corner is at (30.45, 1.1045)."""


@pytest.mark.parametrize(
    ("added", "seen_m"),
    [
        # The line from (x, 0) to the corner is above 0.2 m at 22.4 m up to x = 20.62 m; at 8 m/s
        # the ego is past that after 2.6 s, at 20.8 m, hypot(9.2, 1.5) m away.
        ((SCREEN, WALKER), {"Walker": 9.3215}),
        ((SCREEN, replace(WALKER, y_m=1.6)), {}),  # not in the way
        ((WALKER,), {}),  # in sight at t0
        ((replace(SCREEN, x_m=40.0), WALKER), {}),  # behind the walker
        ((cone("Cone", 29.0, 1.2), WALKER), {}),  # nobody hides behind a cone
        # Nobody stands there for 15 s, or 120 m: the ego sees nothing before it has passed.
        ((replace(SCREEN, x_m=140.0), replace(WALKER, x_m=150.0)), {}),
    ],
)
def test_sight(added: Sequence[TrafficAgent], seen_m: dict[str, float]) -> None:
    assert measure_sight(changed(*added)) == pytest.approx(seen_m, abs=1e-3)


@pytest.mark.parametrize(
    ("added", "passage_m"),
    [
        ((), 7.0),  # two lanes of 3.5 m
        ((vehicle("A", 30.0, 0.0),), 4.25),  # 5.25 - 1
        ((vehicle("A", 30.0, 0.0), vehicle("B", 30.0, 3.5)), 1.5),  # 2.5 - 1
        # On the slant between the corners (32.4, 1) and (37.6, 2.5): 1.5 across and 5.2 along,
        # so it is the 2.75 m to either edge that counts: 5.25 - 1 and 2.5 + 1.75.
        ((vehicle("A", 30.0, 0.0), vehicle("B", 40.0, 3.5)), 4.25),
        ((vehicle("A", 30.0, 0.0), vehicle("B", 36.0, 3.5)), 1.9209),  # hypot(1.2, 1.5)
        ((cone("A", 30.0, 1.0), cone("B", 30.0, 3.0)), 2.5),  # 0.75 + 1.75
        ((replace(vehicle("A", 30.0, 0.0), speed_mps=5.0),), 7.0),  # it drives
        ((replace(vehicle("A", 30.0, 1.75), width_m=7.0),), 0.0),
    ],
)
def test_passage(added: Sequence[TrafficAgent], passage_m: float) -> None:
    assert measure_passage(changed(*added)) == pytest.approx(passage_m, abs=0.02)


def test_off_the_map_nothing_is_measured() -> None:
    off = replace(scene(), lanes=(), connectors=())
    situation = ChangedScene.of(Ground.of(off), Modification())
    assert (measure_sight(situation), measure_passage(situation)) == ({}, 0.0)
