"""Who is where after t0: what was recorded, walked, held or stood."""

import random
from dataclasses import replace
from itertools import chain, pairwise, repeat
from typing import Any

import numpy as np
import pytest

from augment.scene.density import fit_boxes, keep_clear, spawn_traffic, usual_size_m
from augment.scene.entities import (
    InterplanRules,
    Modification,
    Scene,
    SceneOptions,
    TrafficAgent,
    TrafficDensity,
)
from augment.scene.motion import MotionSource, find_motion
from tests.formats.cells import recorded_street
from tests.scenes import EGO, curve, junction, lane, lanes, pedestrian, scene, vehicle


def test_without_a_recording_people_hold_their_speed_along_the_lane() -> None:
    motion = find_motion(curve())
    assert motion.ego.source is MotionSource.HELD_SPEED
    turned = motion.ego.states[60]  # 48 m on: 10 m straight, then 38 m of a circle of 40 m
    assert turned[2] == pytest.approx(38.0 / 40.0, abs=0.02)
    assert turned[:2] == pytest.approx(
        (10.0 + 40.0 * np.sin(38.0 / 40.0), 40.0 * (1.0 - np.cos(38.0 / 40.0))), abs=0.05
    )


def test_past_the_map_the_ego_stands_and_others_are_gone() -> None:
    ahead = vehicle("Agent2", 60.0, 0.0, speed_mps=10.0, lane_id="Lane2")
    motion = find_motion(replace(junction(), agents=(ahead,)))
    assert motion.others[0].is_present.tolist() == [True] * 41 + [False] * 110
    assert motion.ego.is_present.all()
    assert motion.ego.states[-1, 3] == 0.0


def test_whoever_was_recorded_does_what_was_recorded_unless_moved() -> None:
    before, recording = recorded_street()
    kept = find_motion(before, recording=recording, with_later=True)
    assert [one.agent.id for one in kept.others] == ["Agent2", "Agent3"]
    assert kept.others[0].states[10, 0] == pytest.approx(30.0)
    moved = find_motion(before, recording=recording.without({"Agent2"}))
    assert [one.source for one in moved.others] == [MotionSource.HELD_SPEED]


def test_uneven_times_are_read_between_two_that_were_recorded() -> None:
    before, recording = recorded_street()
    thin = replace(
        recording,
        times_s=recording.times_s[::2],
        ego=recording.ego[::2],
        tracks=tuple(replace(one, states=one.states[::2]) for one in recording.tracks),
    )
    motion = find_motion(before, recording=thin)
    assert motion.ego.states[:, 0] == pytest.approx(8.0 * motion.times_s)
    assert motion.others[0].is_present.tolist() == [True] * 19 + [False] * 12


def test_a_walk_starts_when_the_ego_is_near_and_ends_where_it_should() -> None:
    near = pedestrian("Agent2", 10.0, -3.0, (10.0, 6.0))
    far = pedestrian("Agent3", 90.0, -3.0, (90.0, 6.0), speed_mps=1.5)
    motion = find_motion(scene(agents=(near, far)))
    walk = motion.others[0].states
    assert walk[0].tolist()[:2] == [10.0, -3.0]
    assert walk[150, :2] == pytest.approx((10.0, 6.0))
    later = motion.others[1].states
    assert np.flatnonzero(later[:, 3])[0] == 51  # the ego is 40.8 m on, at 8 m/s
    assert later[111, :2] == pytest.approx((90.0, 6.0))
    assert (later[111:, 3] == 0.0).all()


def test_nobody_sets_out_where_the_ego_never_comes() -> None:
    before = replace(scene(), ego=replace(scene().ego, speed_mps=0.0))
    far = pedestrian("Agent3", 90.0, -3.0, (90.0, 6.0))
    assert find_motion(replace(before, agents=(far,))).others[0].stands


def two_way(speed_mps: float = 8.0) -> Scene:
    """Lane1 (the ego's) and Lane2 side by side along x, Lane3 towards them, 400 m long."""
    ways = lanes(0.0, 3.5, oncoming_m=(7.0,), ends_m=(-100.0, 300.0), speed_limit_mps=10.0)
    return scene(ego=replace(EGO, speed_mps=speed_mps), areas=(), lanes=ways)


def spawned(
    density: TrafficDensity, seed: str, before: Scene | None = None, **more: Any
) -> tuple[TrafficAgent, ...]:
    rng = random.Random(seed)
    return spawn_traffic(before or two_way(), density, rng=rng, **more).agents


@pytest.mark.parametrize(
    ("density", "widest_m"),
    [(TrafficDensity.HIGH, 33), (TrafficDensity.MEDIUM, 50), (TrafficDensity.LOW, 100)],
)
def test_gaps_on_each_lane_of_the_roadblock_are_as_wide_as_the_density_says(
    density: TrafficDensity, widest_m: int
) -> None:
    for seed in range(8):
        agents = spawned(density, str(seed))
        assert {one.lane_id for one in agents} <= {"Lane1", "Lane2"}, "the other way is no part"
        beside = sorted(one.x_m for one in agents if one.lane_id == "Lane2")
        ahead = [0.0, *sorted(one.x_m for one in agents if one.lane_id == "Lane1")]
        gaps = [b - a for xs in (beside, sorted(ahead)) for a, b in pairwise(xs)]
        assert all(10.0 <= gap <= widest_m + 10.0 for gap in gaps)


def test_nothing_is_spawned_without_a_density_and_the_same_for_the_same_seed() -> None:
    assert spawned(TrafficDensity.NONE, "a") == ()
    first, again, other = (spawned(TrafficDensity.HIGH, seed) for seed in "aab")
    assert first == again != other
    assert [one.id for one in first] == [f"Agent{101 + n}" for n in range(len(first))]


def test_further_roadblocks_and_extra_agents_are_filled_as_named() -> None:
    high = spawned(TrafficDensity.HIGH, "a", roadblocks_m=[(50.0, 7.2)])
    assert {one.lane_id for one in high} == {"Lane1", "Lane2", "Lane3"}
    low = spawned(TrafficDensity.LOW, "a", extras=[(-80.0, 1.0, 3.0)])
    assert any((one.x_m, one.y_m, one.speed_mps) == (-80.0, 0.0, 8.0) for one in low)


def test_spawned_traffic_drives_as_fast_as_the_ego_was_and_a_standing_ego_gets_a_speed() -> None:
    for ego_mps, wanted_mps in ((8.0, 8.0), (14.0, 14.0)):
        agents = spawned(TrafficDensity.HIGH, "a", two_way(ego_mps))
        assert {one.speed_mps for one in agents} == {wanted_mps}
    assert all(
        0.0 < one.speed_mps <= 10.0 for one in spawned(TrafficDensity.HIGH, "a", two_way(0))
    )
    rng = random.Random("a")
    given_mps = spawn_traffic(two_way(0.0), TrafficDensity.HIGH, rng=rng).ego_mps
    assert 0.0 < given_mps <= 10.0


def test_lanes_are_lengthened_while_less_than_50_m_remain_from_the_ego() -> None:
    """Lane1 ends 40 m ahead of the ego, Lane2 follows it: filled to its end, but not beyond."""
    chained = (
        lane("Lane1", [(-100.0, 0.0), (40.0, 0.0)], successors=("Lane2",)),
        lane("Lane2", [(40.0, 0.0), (90.0, 0.0)], successors=("Lane3",)),
        lane("Lane3", [(90.0, 0.0), (300.0, 0.0)]),
    )
    for seed in range(8):
        agents = spawned(TrafficDensity.HIGH, str(seed), scene(areas=(), lanes=chained))
        assert all(one.x_m <= 80.0 for one in agents)
    assert any(one.lane_id == "Lane2" for one in agents)


def test_boxes_are_taken_one_after_the_other_and_a_change_gets_what_is_left() -> None:
    boxes = iter([(5.4, 2.1), (4.2, 1.8), (9.0, 2.5)])
    agents = spawned(TrafficDensity.HIGH, "a", boxes_m=chain(boxes, repeat((5.176, 2.297))))
    assert {(5.4, 2.1), (4.2, 1.8), (5.176, 2.297)} <= {one.size_m for one in agents}
    options = SceneOptions(interplan=InterplanRules(boxes_m=((9.0, 2.5), (4.2, 1.8))))
    before = replace(two_way(), options=options)
    added = (vehicle("Agent2", 9.0, 0.0), vehicle("Agent3", 20.0, 0.0), vehicle("Agent4", 30.0, 0))
    long = vehicle("Agent5", 40.0, 0.0, length_m=12.0)
    fitted = fit_boxes(before, Modification(added=(long, *added)))
    wanted = [(7.456, 2.079), (9.0, 2.5), (4.2, 1.8), before.ego.size_m]
    assert [one.size_m for one in fitted.added] == wanted
    assert fit_boxes(before, fitted) == fitted
    assert fit_boxes(two_way(), Modification(added=added)).added == added
    sizes_m = [usual_size_m(one, added[0].type) for one in (before, two_way())]
    assert sizes_m == [(9.0, 2.5), (4.8, 2.0)]


def test_nobody_is_spawned_who_would_run_into_the_change_within_two_seconds() -> None:
    parked = vehicle("Agent2", 40.0, 0.0)
    for seed in range(8):
        agents = keep_clear(spawned(TrafficDensity.HIGH, str(seed)), [parked])
        reach_m = 40.0 - 4.8 - 2.0 * 8.0
        assert not [o for o in agents if o.lane_id == "Lane1" and reach_m < o.x_m < 44.8]
