from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest

from augment.geometry.polyline import Polyline
from augment.scene.density import ExtraAgent, spawn_traffic
from augment.scene.entities import Lane, Scene, TrafficDensity
from tests.scenes import EGO, scene, vehicle


def two_way(speed_mps: float = 8.0) -> Scene:
    """Lane1 (the ego's) and Lane2 side by side along x, Lane3 towards them, 400 m long."""
    lines = [[(-100.0, y), (300.0, y)] for y in (0.0, 3.5)] + [[(300.0, 7.0), (-100.0, 7.0)]]
    beside = [("Lane2", None), (None, "Lane1"), (None, None)]
    return scene(
        ego=replace(EGO, speed_mps=speed_mps),
        areas=(),
        lanes=tuple(
            Lane(
                id=f"Lane{number}",
                centerline=Polyline(line),
                width_m=3.5,
                speed_limit_mps=10.0,
                left_neighbor=left,
                right_neighbor=right,
            )
            for number, (line, (left, right)) in enumerate(
                zip(lines, beside, strict=True), start=1
            )
        ),
    )


@pytest.mark.parametrize(
    ("density", "widest_m"),
    [(TrafficDensity.HIGH, 33), (TrafficDensity.MEDIUM, 50), (TrafficDensity.LOW, 100)],
)
def test_gaps_on_each_lane_of_the_roadblock_are_as_wide_as_the_density_says(
    density: TrafficDensity, widest_m: int
) -> None:
    for seed in range(20):
        spawned = spawn_traffic(two_way(), density, seed=str(seed))
        assert {one.lane_id for one in spawned} <= {"Lane1", "Lane2"}, "the other way is no part"
        beside = sorted(one.x_m for one in spawned if one.lane_id == "Lane2")
        ahead = [0.0, *sorted(one.x_m for one in spawned if one.lane_id == "Lane1")]
        gaps = [b - a for xs in (beside, sorted(ahead)) for a, b in pairwise(xs)]
        assert all(10.0 <= gap <= widest_m + 10.0 for gap in gaps)


def test_nothing_is_spawned_without_a_density_and_the_same_for_the_same_seed() -> None:
    high = TrafficDensity.HIGH
    assert spawn_traffic(two_way(), TrafficDensity.NONE, seed="a") == ()
    first, again, other = (spawn_traffic(two_way(), high, seed=seed) for seed in "aab")
    assert first == again != other
    assert [one.id for one in first] == [f"Agent{101 + n}" for n in range(len(first))]


def test_further_roadblocks_and_extra_agents_are_filled_as_named() -> None:
    spawned = spawn_traffic(two_way(), TrafficDensity.HIGH, seed="a", roadblocks_m=[(50.0, 7.2)])
    assert {one.lane_id for one in spawned} == {"Lane1", "Lane2", "Lane3"}
    extra = ExtraAgent(x_m=-80.0, y_m=1.0, speed_mps=3.0)
    low = spawn_traffic(two_way(), TrafficDensity.LOW, seed="a", extras=[extra])
    assert any((one.x_m, one.y_m, one.speed_mps) == (-80.0, 0.0, 3.0) for one in low)


def test_spawned_traffic_drives_as_fast_as_the_ego_up_to_the_limit() -> None:
    for ego_mps, wanted_mps in ((8.0, 8.0), (14.0, 10.0)):
        spawned = spawn_traffic(two_way(ego_mps), TrafficDensity.HIGH, seed="a")
        assert {one.speed_mps for one in spawned} == {wanted_mps}
    standing = spawn_traffic(two_way(0.0), TrafficDensity.HIGH, seed="a")
    assert all(0.0 < one.speed_mps <= 10.0 for one in standing)


def test_nobody_is_spawned_who_would_run_into_the_change_within_two_seconds() -> None:
    parked = vehicle("Agent2", 40.0, 0.0)
    for seed in range(20):
        spawned = spawn_traffic(two_way(), TrafficDensity.HIGH, seed=str(seed), clear_of=[parked])
        reach_m = 40.0 - 4.8 - 2.0 * 8.0
        assert not [o for o in spawned if o.lane_id == "Lane1" and reach_m < o.x_m < 44.8]
