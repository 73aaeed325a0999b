"""Pairs of contestants, and planners told apart: intervals over scenes, differences, sets."""

from itertools import combinations, product

import numpy as np
import pytest
import statsmodels.api as sm
from scipy.stats import bootstrap
from statsmodels.stats.multitest import multipletests

from augment.metrics.paired import (
    LEVEL,
    ClusteredMean,
    PlannerDifference,
    Scores,
    adjust_holm,
    compare_all,
    compare_planners,
    estimate_score,
    find_p_by_signed_ranks,
    find_sets,
    within_sd,
)
from bench.planner_coverage import WORLDS, cover

DIFFERENCES = (0.9, -0.2, 1.4, 2.2, -0.5, 3.1, 0.7, 1.1)


def p_by_enumeration(differences: tuple[float, ...]) -> float:
    """All sign patterns are alike: how many have a rank sum as far from the middle as this."""
    ranks = np.argsort(np.argsort(np.abs(differences))) + 1
    middle = ranks.sum() / 2.0
    found = abs(sum(r for r, d in zip(ranks, differences, strict=True) if d > 0) - middle)
    sums = [
        sum(r for r, is_up in zip(ranks, signs, strict=True) if is_up)
        for signs in product((True, False), repeat=len(ranks))
    ]
    return float(np.mean([abs(one - middle) >= found - 1e-9 for one in sums]))


def test_the_test_is_the_exact_one_where_there_are_few() -> None:
    found = find_p_by_signed_ranks(np.array([0.0, *DIFFERENCES, 0.0]))
    assert found == pytest.approx(p_by_enumeration(DIFFERENCES))


def test_too_few_unequal_pairs_are_not_tested() -> None:
    assert find_p_by_signed_ranks(np.array([1.0, 2.0, 3.0, 4.0, 5.0, 0.0])) is None
    assert find_p_by_signed_ranks(np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])) == 2 / 2**6


@pytest.mark.slow
@pytest.mark.parametrize(
    "p_values", [(0.01, 0.04, 0.03, 0.5), (0.2, 0.2, 0.9), (0.001,), (0.04, 0.04, 0.04, 0.0001)]
)
def test_holm_is_statsmodels(p_values: tuple[float, ...]) -> None:
    expected = multipletests(p_values, method="holm")[1]
    assert adjust_holm(p_values) == pytest.approx(list(expected))


def test_pairs_are_made_over_shared_scenarios_and_say_which_is_nearer() -> None:
    base = {f"s{n}": 1.0 for n in range(len(DIFFERENCES))}
    far = {f"s{n}": 1.0 + one for n, one in enumerate(DIFFERENCES)} | {"alone": 99.0}
    (found,) = compare_all({"near": base, "far": far}, seed=3)
    assert (found.first, found.second, found.scenarios) == ("far", "near", 8)
    assert found.median_m == pytest.approx(np.median(DIFFERENCES))
    expected = bootstrap(
        (np.array(DIFFERENCES),),
        np.median,
        method="percentile",
        n_resamples=10_000,
        rng=np.random.default_rng(5),
    ).confidence_interval
    assert (found.low_m, found.high_m) == pytest.approx((expected.low, expected.high), abs=0.12)
    assert found.p == found.p_holm == pytest.approx(p_by_enumeration(DIFFERENCES))
    assert compare_all({"near": base, "far": far}, seed=3) == (found,)
    assert compare_all({"near": {"a": 1.0}, "far": {"b": 1.0}}, seed=3) == ()


@pytest.mark.parametrize(("n", "rounds"), [(1, 70), (7, 200), (8, 200), (300, 130), (32_768, 3)])
def test_the_interval_is_that_of_all_resamples_at_once(n: int, rounds: int) -> None:
    differences = np.round(np.random.default_rng(n).normal(size=n), 2)
    far = {f"s{place:06}": float(one) for place, one in enumerate(differences)}
    near = dict.fromkeys(far, 0.0)
    (found,) = compare_all({"far": far, "near": near}, seed=4, rounds=rounds)
    (stream,) = np.random.SeedSequence(4).spawn(1)
    drawn = differences[np.random.default_rng(stream).integers(0, n, size=(rounds, n))]
    tail = 100.0 * (1.0 - LEVEL) / 2.0
    low, high = np.percentile(np.median(drawn, axis=1), (tail, 100.0 - tail))
    assert (found.low_m, found.high_m) == (low, high), "to the last bit"


def test_what_varies_within_groups_is_pooled_over_them() -> None:
    """Two scenarios far apart, each with a variance of 1: (1 + 1 + 1 + 1) / (2 + 2) by hand."""
    assert within_sd([[1.0, 2.0, 3.0], [11.0, 12.0, 13.0], [50.0]]) == pytest.approx(1.0)
    assert within_sd([[1.0], []]) is None


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
    assert alike.low == pytest.approx(12 / (12 + 2.201**2), abs=1e-3)  # Wilson, t with 11
    assert estimate_score(dict.fromkeys(range(9), (0, 0.5))).low is None


def test_too_few_scenes_that_differ_tell_nothing_apart() -> None:
    first: Scores = {n: (n, float(n < 5)) for n in range(40)}
    second: Scores = {n: (n, 0.0) for n in range(40)}
    ((one,),) = compare_planners([{"a": first, "b": second}])
    assert (one.estimate.p, one.p_holm, one.is_apart) == (None, None, False)


def test_sets_are_the_largest_without_a_pair_told_apart() -> None:
    estimate = ClusteredMean(mean=0, low=None, high=None, p=None, drives=9, scenes=9)
    for apart, sets in (
        ("", ["abcd"]),
        ("ad", ["abc", "bcd"]),
        ("ab ac ad bc bd cd", ["a", "b", "c", "d"]),
        ("ac ad bd", ["ab", "bc", "cd"]),
    ):
        differences = [
            PlannerDifference(
                first=a, second=b, estimate=estimate, p_holm=0.01 if a + b in apart else 1
            )
            for a, b in combinations("abcd", 2)
        ]
        assert ["".join(sorted(part)) for part in find_sets("abcd", differences)] == sets
