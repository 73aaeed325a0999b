"""What a driver expects of a scenario, rule by rule, on a straight street and at a junction.

The street has lanes of 3.5 m, the ego's in the middle of x; the junction of mill-junction lies
between 30.65 m and 53.35 m ahead.
"""

import math
from dataclasses import replace

import pytest

from augment.scene.codec import CatalogueEntry
from augment.scene.entities import AgentType, Modification, ScenarioType, Scene, TrafficAgent
from augment.scene.intent import Intent, Setting, Side
from augment.services.scenarios.catalogue_check import (
    StagedScenario,
    find_apart,
    find_sparse,
    find_unguarded,
    find_unhidden,
    find_unnamed_junction,
    has_oncoming,
    has_traffic,
    is_hidden,
)
from tests import scenes
from tests.fixtures.shelf import whole_scene
from tests.intents import parked, walk
from tests.scenes import cone, pedestrian, vehicle

CRASH, WORKS = ScenarioType.ACCIDENT_SITE, ScenarioType.CONSTRUCTION_ZONE
JAYWALKER, OVERTAKE = ScenarioType.JAYWALKER, ScenarioType.OVERTAKE


def staged(
    kind: ScenarioType,
    *added: TrafficAgent,
    scene: Scene | None = None,
    intent: Intent | None = None,
    says: str = "x",
) -> StagedScenario:
    shown = scenes.scene() if scene is None else scene
    entry = CatalogueEntry(
        slug="one",
        scene=shown.name,
        type=kind,
        instruction=says,
        keep_traffic=True,
        provenance="made for a test",
        notes="",
        reference=Modification(added=added),
        intent=intent,
    )
    return StagedScenario(entry=entry, scene=shown)


def moving(name: str, x_m: float, y_m: float, heading_rad: float = 0.0) -> TrafficAgent:
    return replace(vehicle(name, x_m, y_m, heading_rad), speed_mps=8.0)


@pytest.mark.parametrize(
    ("gap_m", "apart"), [(0.0, False), (0.099, False), (0.11, True), (1.0, True)]
)
def test_crashed_cars_touch(gap_m: float, apart: bool) -> None:
    cars = vehicle("A", 20.0, 0.0), vehicle("B", 24.8 + gap_m, 0.0)
    assert bool([*find_apart(staged(CRASH, *cars))]) is apart
    assert not [*find_apart(staged(OVERTAKE, *cars))]


def works(
    *, sign_m: float = 12.0, worker_m: float = 31.0, lefts: tuple[float, ...] = (-1.5, 0.0, 1.5)
) -> list[TrafficAgent]:
    cones = [cone(f"C{n}", 20.0 + 2.5 * n, left_m) for n, left_m in enumerate(lefts)]
    barrier = replace(vehicle("B", 29.0, 0.0, math.pi / 2.0), type=AgentType.BARRIER)
    sign = replace(cone("S", sign_m, -2.2), type=AgentType.CONSTRUCTION_SIGN)
    return [*cones, pedestrian("W", worker_m, 0.0), barrier, sign]


OFF_EDGE = "its first cone stands 1.1 m off the lane centre, not at an edge"


@pytest.mark.parametrize(
    ("added", "reasons"),
    [
        (works(), []),
        (works(sign_m=19.9), []),
        (works(sign_m=20.1), ["its sign stands behind its first cone"]),
        (works(worker_m=29.1), []),
        (works(worker_m=28.9), ["its worker stands before the barrier"]),
        (works(lefts=(-1.5, -1.5, -1.5)), []),
        (works(lefts=(-1.16, 0.0, 1.5)), []),
        (works(lefts=(-1.14, 0.0, 1.5)), [OFF_EDGE]),
        (works(lefts=(-1.5, 0.0, -1.5)), ["its cones lead to both sides"]),
        (works()[:-1], ["its roadworks have no sign"]),
        (works()[:3], ["its roadworks have no sign, no barrier, no worker"]),
    ],
)
def test_roadworks_guard_their_worker(added: list[TrafficAgent], reasons: list[str]) -> None:
    assert [*find_unguarded(staged(WORKS, *added))] == reasons


@pytest.mark.parametrize(
    ("ahead_m", "setting", "says", "reasons"),
    [
        (18.0, None, "a car", 0),
        (18.3, None, "a car", 2),
        (28.0, Setting.BEFORE_INTERSECTION, "a car before the junction", 0),
        (28.5, Setting.BEFORE_INTERSECTION, "a car before the junction", 1),
        (40.0, Setting.IN_INTERSECTION, "a car in the junction", 0),
        (40.0, Setting.AT_INTERSECTION, "a car from the side street", 0),
        (40.0, Setting.AT_INTERSECTION, "a car", 1),
        (55.0, Setting.AFTER_INTERSECTION, "a car past the junction", 1),
        (56.0, Setting.AFTER_INTERSECTION, "a car past the junction", 0),
    ],
)
def test_a_place_at_a_junction_is_named(
    ahead_m: float, setting: Setting | None, says: str, reasons: int
) -> None:
    scene = whole_scene("mill-junction")
    request = parked(ahead_m).requests[0]
    given = () if setting is None else (setting,)
    intent = Intent(requests=(replace(request, spot=replace(request.spot, settings=given)),))
    one = staged(OVERTAKE, vehicle("A", ahead_m, 0.0), scene=scene, intent=intent, says=says)
    assert len([*find_unnamed_junction(one)]) == reasons


@pytest.mark.parametrize(
    ("parked_m", "hidden"), [((14.0, -3.0), True), ((14.0, -5.6), False), ((23.0, -3.0), False)]
)
def test_a_walker_is_hidden_by_what_stands_between(
    parked_m: tuple[float, float], hidden: bool
) -> None:
    scene = scenes.scene(agents=(vehicle("Agent2", *parked_m),))
    between = walk(18.0, Side.RIGHT, Setting.BY_PARKED_RIGHT)
    walker = pedestrian("W", 18.0, -4.3, (18.0, 6.0))
    one = staged(JAYWALKER, walker, scene=scene, intent=between)
    assert is_hidden(one) is hidden
    assert bool([*find_unhidden(one)]) is not hidden
    plain = staged(JAYWALKER, walker, scene=scene, intent=walk(18.0, Side.RIGHT))
    assert not [*find_unhidden(plain)]


@pytest.mark.parametrize(
    ("others", "oncoming", "traffic"),
    [
        ([moving("Agent2", 12.0, 3.5, math.pi)], True, False),
        ([vehicle("Agent2", 12.0, 3.5, math.pi)], False, False),
        ([moving("Agent2", 12.0, 0.0)], False, False),
        ([moving("Agent2", 95.0, 3.5, math.pi)], False, False),
        ([moving(f"Agent{n}", 6.0 * n, 3.5, math.pi) for n in (1, 2, 3)], True, True),
        ([vehicle(f"Agent{n}", 6.0 * n, 3.5, math.pi) for n in (1, 2, 3)], False, False),
    ],
)
def test_traffic_is_what_the_picture_shows(
    others: list[TrafficAgent], oncoming: bool, traffic: bool
) -> None:
    numbered = tuple(replace(one, id=f"Agent{n}") for n, one in enumerate(others, start=2))
    one = staged(OVERTAKE, vehicle("A", 25.0, 0.0), scene=scenes.scene(agents=numbered))
    assert has_oncoming(one) is oncoming
    assert has_traffic(one) is traffic


@pytest.mark.parametrize(("busy", "reasons"), [(6, 2), (7, 0), (10, 0)])
def test_seven_of_ten_overtakes_meet_oncoming_traffic(busy: int, reasons: int) -> None:
    others = tuple(moving(f"Agent{n}", 6.0 * n - 6.0, 3.5, math.pi) for n in (2, 3, 4))
    full = staged(OVERTAKE, vehicle("A", 25.0, 0.0), scene=scenes.scene(agents=others))
    empty = staged(OVERTAKE, vehicle("A", 25.0, 0.0))
    assert len([*find_sparse([full] * busy + [empty] * (10 - busy))]) == reasons
