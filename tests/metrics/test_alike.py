"""Alike is what differs by no more than 15 cm and 2 degrees in every object."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from augment.metrics.displacement import are_alike
from augment.scene.entities import AgentType, Modification
from tests.scenes import cone, pedestrian, vehicle

CAR = vehicle("New1", 20.0, 0.0)
WALKER = pedestrian("New2", 10.0, -4.0, (10.0, 4.0))


@pytest.mark.parametrize(
    ("changed", "alike"),
    [
        (CAR, True),
        (replace(CAR, id="New9"), True),
        (replace(CAR, x_m=20.15), True),
        (replace(CAR, x_m=20.16), False),
        (replace(CAR, x_m=20.12, y_m=0.12), False),
        (replace(CAR, heading_rad=math.radians(2.0)), True),
        (replace(CAR, heading_rad=math.radians(-2.1)), False),
        (replace(CAR, heading_rad=math.pi), False),
        (replace(CAR, length_m=5.0), False),
        (replace(CAR, speed_mps=0.2), False),
        (replace(CAR, type=AgentType.BUS), False),
    ],
)
def test_one_object_against_the_tolerance(changed: object, alike: bool) -> None:
    one, other = Modification(added=(CAR,)), Modification(added=(changed,))  # type: ignore[arg-type]
    assert are_alike(one, other) is alike
    assert are_alike(other, one) is alike


def test_every_object_is_matched_once() -> None:
    row = [cone(f"New{n}", 10.0 + 0.14 * n, 0.0) for n in range(3)]
    assert are_alike(Modification(added=tuple(row)), Modification(added=tuple(reversed(row))))
    assert not are_alike(Modification(added=tuple(row)), Modification(added=tuple(row[:2])))
    doubled = Modification(added=(row[0], replace(row[0], id="New8"), row[2]))
    apart = Modification(added=(row[0], replace(row[2], id="New8"), row[2]))
    assert not are_alike(doubled, apart)
    assert are_alike(Modification(), Modification())


def test_walks_cones_and_what_is_gone() -> None:
    far = replace(WALKER, walk_to_m=(10.0, 4.2))
    assert not are_alike(Modification(added=(WALKER,)), Modification(added=(far,)))
    turned = replace(cone("New1", 5.0, 0.0), heading_rad=1.0)
    assert are_alike(Modification(added=(cone("New1", 5.0, 0.0),)), Modification(added=(turned,)))
    assert not are_alike(Modification(removed=("Agent2",)), Modification())
    assert not are_alike(Modification(moved=(CAR,)), Modification(added=(CAR,)))
