"""Planners told apart: intervals over scenes, paired differences, sets."""

from itertools import combinations

import numpy as np
import pytest
import statsmodels.api as sm

from augment.metrics.planners import (
    ClusteredMean,
    PlannerDifference,
    Scores,
    compare_planners,
    estimate_score,
    find_sets,
)
from bench.planner_coverage import WORLDS, cover


def test_differences_are_those_of_a_regression_clustered_by_scene() -> None:
    drives = WORLDS[2].drives(np.random.default_rng(3))
    (differences,) = compare_planners([drives])
    for one in differences:
        keys = list(drives[one.first])
        values = np.array([drives[one.first][k][1] - drives[one.second][k][1] for k in keys])
        scenes = [drives[one.first][key][0] for key in keys]
        model = sm.OLS(values, np.ones(len(values)))
        how = {"groups": scenes, "df_correction": True, "use_correction": False}
        fitted = model.fit(cov_type="cluster", cov_kwds=how, use_t=True)
        g = len(set(scenes))
        se = fitted.bse[0] * np.sqrt(g / (g - 1))
        assert one.estimate.mean == pytest.approx(fitted.params[0])
        assert one.estimate.low is not None
        assert (one.estimate.mean - one.estimate.low) / se == pytest.approx(
            2.262, abs=1e-3
        )  # t with 9


@pytest.mark.parametrize("place", [6, 19, 25])
def test_intervals_hold(place: int) -> None:
    means, differences, false = cover(WORLDS[place], 150)
    assert 0.92 <= means <= 0.98
    assert 0.92 <= differences <= 0.98
    assert false <= 0.08


def test_without_spread_an_interval_is_that_of_so_many_successes() -> None:
    alike = estimate_score({n: (n, 1.0) for n in range(12)})
    assert alike.high == 1.0
    assert alike.low is not None
    assert alike.low == pytest.approx(12 / (12 + 2.201**2), abs=1e-3)  # Wilson, t with 11
    assert estimate_score(dict.fromkeys(range(9), (0, 0.5))).low is None


def test_too_few_scenes_that_differ_tell_nothing_apart() -> None:
    first: Scores = {n: (n, float(n < 5)) for n in range(40)}
    second: Scores = {n: (n, 0.0) for n in range(40)}
    ((one,),) = compare_planners([{"a": first, "b": second}])
    assert (one.estimate.p, one.p_holm, one.is_apart) == (None, None, False)


@pytest.mark.parametrize(
    ("apart", "sets"),
    [
        ("", ["abcd"]),
        ("ad", ["abc", "bcd"]),
        ("ab ac ad bc bd cd", ["a", "b", "c", "d"]),
        ("ac ad bd", ["ab", "bc", "cd"]),
    ],
)
def test_sets_are_the_largest_without_a_pair_told_apart(apart: str, sets: list[str]) -> None:
    estimate = ClusteredMean(mean=0, low=None, high=None, p=None, drives=9, scenes=9)
    differences = [
        PlannerDifference(
            first=a, second=b, estimate=estimate, p_holm=0.01 if a + b in apart else 1
        )
        for a, b in combinations("abcd", 2)
    ]
    assert ["".join(sorted(part)) for part in find_sets("abcd", differences)] == sets
