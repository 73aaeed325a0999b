"""Vehicles said in brackets, and what is lost by it."""

import math
from collections import defaultdict
from functools import cache
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.baselines import coarse_grid, rule_placer
from augment.baselines.coarse_grid import Code, Direction, quantise
from augment.baselines.registry import PLACERS
from augment.scene.entities import AgentType
from bench.displacement import made, measured
from tests.fixtures.shelf import SLUGS
from tests.intents import parked
from tests.scenes import scene as street
from tests.scenes import vehicle

PARKED = parked(22.0)
SEEDS = 2


def code_of(x_m: float, y_m: float, heading_rad: float = 0.0, speed_mps: float = 0.0) -> Code:
    return quantise(vehicle("Agent2", x_m, y_m, heading_rad, speed_mps=speed_mps))


@pytest.mark.parametrize(
    ("x_m", "y_m", "number"),
    [(4.9, 0.0, 0), (5.0, 0.0, 1), (30.0, 40.0, 10), (71.9, 0.0, 14), (200.0, 0.0, 14)],
)
def test_bins_are_of_the_straight_line_up_to_72_m(x_m: float, y_m: float, number: int) -> None:
    assert code_of(x_m, y_m).distance_bin == number


def test_directions_are_to_45_degrees() -> None:
    for degrees, direction in (
        *((44, Direction.SAME), (-44, Direction.SAME), (46, Direction.ACROSS_TO_LEFT)),
        *((-134, Direction.ACROSS_TO_RIGHT), (136, Direction.OPPOSITE)),
        (-179, Direction.OPPOSITE),
    ):
        assert code_of(10.0, 0.0, math.radians(degrees)).direction is direction


@given(st.floats(-70.0, 70.0), st.floats(-70.0, 70.0), st.floats(-3.1, 3.1), st.floats(0.0, 19.0))
def test_nothing_finer_than_the_code_gets_through(
    x_m: float, y_m: float, heading_rad: float, speed_mps: float
) -> None:
    code = code_of(x_m, y_m, heading_rad, speed_mps)
    assert 0 <= code.distance_bin <= 14
    assert abs(code.speed_mps - speed_mps) <= 2.5


def test_it_stands_on_a_centreline_within_its_code() -> None:
    scene = street()
    (right,) = rule_placer.place(scene, PARKED, seed=3).modification.added
    placed = coarse_grid.place(scene, PARKED, seed=3)
    (made,) = placed.modification.added
    lane = next(lane for lane in scene.lanes if lane.id == made.lane_id)
    assert lane.centerline.project(made.x_m, made.y_m).distance_m < 0.01
    assert quantise(made) == quantise(right)
    assert (made.length_m, made.width_m, made.type) == (4.8, 2.0, AgentType.VEHICLE)


def test_the_seed_alone_decides_where() -> None:
    def x_m(seed: int) -> float:
        return coarse_grid.place(street(), PARKED, seed=seed).modification.added[0].x_m

    assert x_m(1) == x_m(1)
    assert len({x_m(seed) for seed in range(8)}) > 4
    assert all(20.0 <= x_m(seed) <= 25.0 for seed in range(8))


@cache
def errors_m() -> dict[str, list[float]]:
    """By contestant the distances of all it placed, where both place something."""
    found: defaultdict[str, list[float]] = defaultdict(list)
    for slug, seed in product(SLUGS, range(SEEDS)):
        tried = {}
        for name, placer in PLACERS.items():
            modification = made(placer.place, slug, seed)
            if modification is None:
                break  # what one of them refuses is not compared
            tried[name] = modification
        else:
            for name, modification in tried.items():
                found[name] += measured(slug, modification).distances_m
    return dict(found)


@pytest.mark.slow
def test_brackets_lose_what_none_keeps_over_the_catalogue() -> None:
    found = errors_m()
    assert min(len(values) for values in found.values()) > 15 * SEEDS
    for measure in (np.median, np.mean):
        assert measure(found["rule-placer"]) + 0.5 < measure(found["quantised-5m"]) < 4.0
