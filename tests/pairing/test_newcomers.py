"""What a newcomer judges: what is planned least, spread over pairs and scenarios, by lot."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arena.pairing.later import choose_for_newcomer as choose_units
from arena.pairing.rules import Entry, Grid, make_grid

NAMES = ("ann", "bob", "cid", "dot")


def grid(scenarios: int = 5, missing: tuple[tuple[int, str], ...] = ()) -> Grid:
    return make_grid(
        tuple(
            Entry(scenario=f"place-{place}", contestant=name, picture=f"{place}-{name}")
            for place in range(scenarios)
            for name in NAMES
            if (place, name) not in missing
        )
    )


def nobody(of: Grid) -> np.ndarray:
    return np.zeros(of.showable.shape, dtype=np.int64)


def test_with_nothing_planned_every_pair_comes_once_before_any_comes_twice() -> None:
    units = choose_units(grid(), nobody(grid()), 12, np.random.default_rng(1))
    assert set(Counter(unit.pair for unit in units).values()) == {2}
    assert len({(unit.pair, unit.scenario) for unit in units}) == 12


def test_what_is_planned_least_comes_first() -> None:
    judges = nobody(grid()) + 3
    judges[2] = 0
    judges[2, 4] = 1
    (first,) = choose_units(grid(), judges, 1, np.random.default_rng(1))
    assert first.pair == 2
    assert first.scenario != 4


def test_all_units_are_given_where_more_are_asked_for() -> None:
    of = grid(scenarios=2, missing=((0, "ann"),))
    units = choose_units(of, nobody(of), 100, np.random.default_rng(1))
    assert len(units) == int(of.showable.sum()) == 9


@pytest.mark.slow
@given(st.integers(1, 40), st.integers(0, 2**32), st.integers(1, 12))
def test_voters_after_each_other_keep_all_units_equal(quota: int, seed: int, voters: int) -> None:
    of = grid()
    judges = nobody(of)
    for voter in range(voters):
        for unit in choose_units(of, judges, quota, np.random.default_rng([seed, voter])):
            judges[unit.pair, unit.scenario] += 1
    pairs = judges.sum(axis=1)
    assert pairs.sum() == voters * min(quota, judges.size)
    assert pairs.max() - pairs.min() <= 1 + (quota > judges.size)
    assert max(row.max() - row.min() for row in judges) <= 1


@given(st.integers(0, 2**32))
@pytest.mark.slow
def test_scenarios_stay_equal_too_and_hardly_come_twice_to_one_voter(seed: int) -> None:
    of = grid(scenarios=20)
    judges = nobody(of)
    for voter in range(30):
        units = choose_units(of, judges, 10, np.random.default_rng([seed, voter]))
        assert max(Counter(unit.scenario for unit in units).values()) <= 2
        for unit in units:
            judges[unit.pair, unit.scenario] += 1
    scenarios = judges.sum(axis=0)
    assert scenarios.max() - scenarios.min() <= 2
