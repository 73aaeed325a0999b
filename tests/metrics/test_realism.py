"""The realism of a change: by hand on small histograms, and its order on the catalogue."""

import math
from dataclasses import replace
from statistics import median

import numpy as np
import pytest

from augment.checks import Ground
from augment.metrics.displacement import CLASS_OF, ObjectClass
from augment.metrics.realism import (
    LEAST_RECORDED,
    Feature,
    PlacedObject,
    RecordedCounts,
    count_recorded,
    judge,
    measure_change,
    measure_recorded,
    place_at_random,
)
from augment.scene.entities import AgentType, Modification
from tests.fixtures.shelf import (
    HARD_SCENES,
    HARD_SLUGS,
    SCENES,
    SLUGS,
    entry,
    shown_scene,
    whole_scene,
)
from tests.scenes import cone, pedestrian, scene, vehicle

CAR = ObjectClass.VEHICLE


def car(*, speed: int = 0, heading: int = 0, collides: bool = False) -> PlacedObject:
    bins = {Feature.SPEED: speed, Feature.HEADING: heading}
    return PlacedObject(object_class=CAR, bins=bins, collides=collides)


RECORDED = count_recorded([car()] * 15 + [car(speed=3)] * 5)
"""20 cars: 11 bins of speed, so p(0) = 16/31 and p(3) = 6/31; of heading p(0) = 21/30."""


def test_a_score_is_the_geometric_mean_of_the_shares_of_the_bins() -> None:
    found = judge([car(), car(speed=3), car(speed=10, heading=9)], RECORDED)
    assert found.scores == pytest.approx(
        {
            "speed": (16 / 31 * 6 / 31 * 1 / 31) ** (1 / 3),
            "heading": (21 / 30 * 21 / 30 * 1 / 30) ** (1 / 3),
            "collision": 1.0,
        }
    )
    assert found.mean == pytest.approx(sum(found.scores.values()) / 3)
    assert found.judged == 3


def test_a_collision_lowers_the_mean_by_its_share_of_the_objects() -> None:
    apart, crashed = (judge([car(), car(collides=one)], RECORDED) for one in (False, True))
    assert crashed.scores["collision"] == 0.5
    assert apart.mean == pytest.approx((crashed.mean or 0.0) + 0.5 / 3)


def test_classes_of_which_too_little_was_recorded_are_not_judged() -> None:
    enough, fewer = (
        RECORDED - RecordedCounts({(CAR, Feature.SPEED, 0): 20 - left}) for left in (10, 9)
    )
    assert LEAST_RECORDED == 10
    assert judge([car()], enough).mean is not None
    found = judge([car()], fewer)
    assert (found.mean, found.scores, found.judged) == (None, {}, 0)


STREET = Ground.of(scene())
"""Its road lies between y = -1.75 and 5.25 m; Lane2 comes towards the ego. The ego's front is at
x = 2.588 m."""


def bins_of(*agents: object) -> list[tuple[int, ...]]:
    placed = measure_change(STREET, Modification(added=agents))  # type: ignore[arg-type]
    return [tuple(one.bins[feature] for feature in Feature) for one in placed]


def test_features_of_cars_on_a_street_measured_by_hand() -> None:
    with_lane = replace(vehicle("a", 20.0, 0.0), speed_mps=9.0)  # gap 15.01 m, edge 1.75 m
    against = vehicle("b", 60.0, 3.5, math.radians(12.0))  # 168 degrees to Lane2
    assert bins_of(with_lane, against) == [(5, 0, 6, 5), (0, 7, 8, 5)]


@pytest.mark.parametrize(
    ("y_m", "edge"), [(-0.76, 4), (-0.74, 5), (-1.74, 4), (-1.76, 3), (-2.76, 2), (-5.8, 0)]
)
def test_the_distance_to_the_road_s_edge_is_negative_off_it(y_m: float, edge: int) -> None:
    assert bins_of(cone("c", 20.0, y_m))[0][3] == edge


@pytest.mark.parametrize(("front_m", "gap"), [(0.24, 0), (0.26, 1), (15.9, 6), (16.1, 7)])
def test_the_gap_goes_from_box_to_box(front_m: float, gap: int) -> None:
    assert bins_of(vehicle("a", 2.588 + front_m + 2.4, 0.0))[0][2] == gap


def test_who_stands_in_the_ego_collides() -> None:
    into, beside = (
        measure_change(STREET, Modification(added=(vehicle("a", x_m, 0.0),)))
        for x_m in (3.0, 20.0)
    )
    assert (into[0].collides, beside[0].collides) == (True, False)
    assert measure_change(STREET, Modification()) == []


def test_random_placement_keeps_what_is_placed_and_follows_its_seed() -> None:
    walker = replace(pedestrian("w", 20.0, -4.0, (20.0, 4.0)), speed_mps=1.2)
    change = Modification(added=(walker, cone("c", 30.0, 0.0)))
    first, again, other = (
        place_at_random(STREET, change, np.random.default_rng(seed)) for seed in (1, 1, 2)
    )
    assert first == again != other
    assert [agent.type for agent in first.added] == [AgentType.PEDESTRIAN, AgentType.TRAFFIC_CONE]
    assert first.added[1].speed_mps == 0.0  # nothing lends a cone wheels


@pytest.mark.slow
@pytest.mark.parametrize("slugs", [SLUGS, HARD_SLUGS], ids=["paper", "hard"])
def test_recorded_traffic_is_above_references_and_these_above_chance(slugs: list[str]) -> None:
    scenes = [*SCENES, *HARD_SCENES]
    recorded = {name: measure_recorded(Ground.of(whole_scene(name))) for name in scenes}
    counts = {name: count_recorded(objects) for name, objects in recorded.items()}
    means: dict[str, list[float]] = {"recording": [], "reference": [], "random": []}
    for slug in slugs:
        one, ground = entry(slug), Ground.of(shown_scene(slug))
        learned = sum((counts[name] for name in counts if name != one.scene), RecordedCounts())
        classes = {CLASS_OF[agent.type] for agent in one.reference.changed}
        thrown = place_at_random(ground, one.reference, np.random.default_rng(7))
        rows = {
            "recording": [each for each in recorded[one.scene] if each.object_class in classes],
            "reference": measure_change(ground, one.reference),
            "random": measure_change(ground, thrown),
        }
        for name, objects in rows.items():
            mean = judge(objects, learned).mean
            means[name] += [] if mean is None else [mean]
    middle = {name: median(values) for name, values in means.items()}
    assert middle["recording"] >= middle["reference"] >= middle["random"]
