"""The simulated contestants: right but for what is labelled, at the rates that were set."""

from __future__ import annotations

import math
import random
from collections import Counter
from dataclasses import replace

import pytest

from augment.baselines.simulated import PRESETS, Rates, rates_of, simulate
from augment.baselines.simulated_faults import FaultKind, inject_fault
from augment.baselines.simulated_format import FormatKind, spoiled_answer
from augment.baselines.simulated_road import (
    ACROSS_M,
    ALONG_M,
    OWN_M,
    Agents,
    jitter,
    new_contacts,
)
from augment.errors import InvalidDocument, ReplyUnreadable
from augment.metrics.displacement import displacement
from augment.prompts.reply import read_reply
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import TrafficAgent
from augment.scene.modification import Modification
from tests.fixtures.shelf import SLUGS, entry, shown_scene
from tests.scenes import curve, junction, pedestrian, scene, vehicle

STREET = EgoRoute.of(scene())
assert STREET is not None
CAR = vehicle("Agent2", 20.0, 1.2)


def tried(kind: FaultKind, *agents: TrafficAgent, road: EgoRoute | None = STREET) -> Agents | None:
    assert road is not None
    return inject_fault(road, agents, kind, random.Random(1))


def made(kind: FaultKind, *agents: TrafficAgent, road: EgoRoute | None = STREET) -> Agents:
    found = tried(kind, *agents, road=road)
    assert found is not None
    return found


def test_the_same_seed_gives_the_same_answer() -> None:
    reference = entry("crash-terrace-row").reference
    scene_ = shown_scene("crash-terrace-row")
    one, again, other = (
        simulate(scene_, reference, PRESETS["high"], seed=seed) for seed in (4, 4, 5)
    )
    assert one == again
    assert one != other


@pytest.mark.parametrize("slug", SLUGS)
def test_a_right_answer_is_near_the_reference_and_touches_nothing_new(slug: str) -> None:
    reference, world = entry(slug).reference, shown_scene(slug)
    road = EgoRoute.of(world)
    assert road is not None
    near = jitter(road, reference, random.Random(slug))
    # A lane moves things on the outside of a bend further than itself.
    most_m = 1.5 * math.hypot(ALONG_M, ACROSS_M) + 2.0 * OWN_M
    assert max(displacement(near, reference).distances_m) <= most_m
    assert not new_contacts(world, reference.added, near.added)


def test_the_rates_are_kept() -> None:
    rates = Rates(position=0.3, logic=0.2, format=0.1)
    reference = Modification(added=(CAR,))
    seen = Counter(
        simulate(scene(), reference, rates, seed=seed).fault_class for seed in range(600)
    )
    assert set(seen) == {"", "position", "logic", "format"}
    for name, share in (("position", 0.3), ("logic", 0.2), ("format", 0.1), ("", 0.4)):
        assert seen[name] / 600 == pytest.approx(share, abs=0.06)


@pytest.mark.parametrize(
    ("written", "problem"),
    [
        ({"position": 1.5}, "1.5 is no share"),
        ({"position": 0.7, "logic": 0.7}, "more than 1"),
        ({"luck": 0.1}, "unknown; allowed: position, heading, logic, format"),
        ({"logic": "often"}, "no number"),
    ],
)
def test_rates_that_are_none_are_refused(written: dict[str, object], problem: str) -> None:
    with pytest.raises(InvalidDocument, match=problem):
        rates_of(written)


def test_each_kind_does_what_its_name_says() -> None:
    (beside,) = made(FaultKind.NEIGHBOUR_LANE, CAR)
    assert abs(beside.y_m - CAR.y_m) == pytest.approx(3.5)
    (further,) = made(FaultKind.ALONG_LANE, CAR)
    assert 5.0 <= abs(further.x_m - CAR.x_m) <= 30.0
    (away,) = made(FaultKind.OFF_ROAD, CAR)
    assert away.y_m < -4.0
    (turned,) = made(FaultKind.FLIPPED, CAR)
    assert abs(turned.heading_rad) == pytest.approx(math.pi)
    (other,) = made(FaultKind.WRONG_SIDE, CAR)
    assert (other.x_m, other.y_m) == pytest.approx((20.0, -1.2))
    (driving,) = made(FaultKind.MOVING, CAR)
    assert driving.speed_mps >= 3.0
    (typed,) = made(FaultKind.WRONG_TYPE, CAR)
    assert typed.type is not CAR.type
    assert made(FaultKind.MISSING, CAR) == ()
    twice = made(FaultKind.OVERLAP, CAR)
    assert [one.x_m for one in twice] == [20.0, 20.0]
    assert len(made(FaultKind.EXTRA, CAR)) == 2


def test_a_pedestrian_looks_away_or_comes_from_the_other_side() -> None:
    walker = pedestrian("Agent2", 20.0, 6.0, (20.0, -3.0))
    (away,) = made(FaultKind.FACING_AWAY, walker)
    assert (away.x_m, away.y_m) == (20.0, 6.0)
    assert math.sin(away.heading_rad) == pytest.approx(1.0)
    (swapped,) = made(FaultKind.WRONG_SIDE, walker)
    assert (swapped.y_m, swapped.walk_to_m) == (-3.0, (20.0, 6.0))


def test_a_bend_and_a_junction_make_a_difference() -> None:
    bend, crossing = EgoRoute.of(curve()), EgoRoute.of(junction())
    x_m, y_m = 10.0 + 40.0 * math.sin(0.8), 40.0 * (1.0 - math.cos(0.8))
    bent = vehicle("Agent2", x_m, y_m, 0.8)
    (straight,) = made(FaultKind.STRAIGHT_LINE, bent, road=bend)
    assert (straight.x_m, straight.y_m) == pytest.approx((42.0, 0.0), abs=0.1)
    (beyond,) = made(FaultKind.BEYOND_JUNCTION, replace(CAR, x_m=10.0), road=crossing)
    assert 38.0 <= beyond.x_m <= 44.0


@pytest.mark.parametrize("kind", list(FormatKind))
@pytest.mark.parametrize("seed", range(5))
def test_fences_are_read_and_all_other_faults_of_form_are_not(kind: FormatKind, seed: int) -> None:
    right = Modification(added=(CAR, pedestrian("Agent3", 30.0, 6.0, (30.0, -3.0))))
    text = spoiled_answer(scene(), right, kind, random.Random(seed))
    if kind is FormatKind.FENCES:
        assert displacement(read_reply(text, scene()).modification, right).mean_m == 0.0
    else:
        with pytest.raises(ReplyUnreadable):
            read_reply(text, scene())
