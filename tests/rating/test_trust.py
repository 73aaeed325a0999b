from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import pytest
import scipy.stats
import statsmodels.api as sm

from arena.rating.comparisons import Comparisons, count_wins, select_votes
from arena.rating.influence import (
    bradley_terry,
    rank_changes,
    votes_behind_first,
    without_each_expert,
)
from arena.rating.models import ELO_PER_LOGIT
from arena.rating.side import ALIKE, ONE_EXPERT, ONE_SIDED, UNDETERMINED, side_bias
from bench.claims import measure_sides, side_worlds
from tests.rating.votes import Comparison, fit, named, simulated, versus

PAPERS = [1042.0, 1039, 1025, 1011, 1003, 998, 984, 953, 941]


# --- The side ----------------------------------------------------------------------------------


def test_three_of_four_wins_for_the_left_are_191_points() -> None:
    # Between equals, each side equally often, odds of 3 for the left: 400 log10(3).
    left = versus("a", "b", 3, 0, 1) + versus("b", "a", 3, 0, 1)
    found = side_bias(named(left))
    assert found.advantage.value == pytest.approx(190.8485, abs=1e-3)
    assert found.left.value == 0.75


def test_the_advantage_and_its_clustered_error_agree_with_statsmodels() -> None:
    votes = simulated([1050.0, 1010, 990, 950], 1200, 3, ties=0.3)
    design = np.zeros((len(votes), 4))
    rows = np.arange(len(votes))
    for side, sign in ((votes.first, 1.0), (votes.second, -1.0)):
        there = side > 0
        design[rows[there], side[there] - 1] += sign
    design[:, -1] = 1.0
    family = sm.families.Binomial()
    theirs = sm.GLM(votes.score, design, family=family).fit(
        cov_type="cluster", cov_kwds={"groups": votes.expert, "use_correction": False}, tol=1e-12
    )
    found = side_bias(votes)
    assert found.advantage.value == pytest.approx(theirs.params[-1] * ELO_PER_LOGIT, abs=1e-5)
    groups = found.clusters
    error = theirs.bse[-1] * ELO_PER_LOGIT * np.sqrt(groups / (groups - 1))
    assert found.standard_error == pytest.approx(error, rel=1e-6)
    scale, degrees = _bell_mccaffrey(theirs, np.eye(groups)[votes.expert])
    half = scipy.stats.t.ppf(0.975, degrees) * theirs.bse[-1] * np.sqrt(scale) * ELO_PER_LOGIT
    upper = theirs.params[-1] * ELO_PER_LOGIT + half
    assert found.advantage.upper == pytest.approx(upper, rel=1e-5)


def _bell_mccaffrey(found: Any, of_expert: np.ndarray) -> tuple[float, float]:
    """By whole matrices of experts: the factor of the variance, and degrees of freedom."""
    design, expected = found.model.exog, found.fittedvalues
    certain = expected * (1.0 - expected)
    back = design @ np.linalg.inv(design.T @ (design * certain[:, None]))[-1]
    pulls = (found.model.endog - expected) * back
    weights, squares = of_expert.T @ (certain * back), of_expert.T @ pulls**2
    left = np.diag(weights) - np.outer(weights, weights)
    by_votes = np.trace(left @ np.diag(squares / weights**2) @ left.T)
    effect = ((of_expert.T @ pulls) ** 2).sum() - by_votes
    variance = np.diag(max(effect / np.trace(left @ left.T), 0.0) + squares / weights**2)
    form = left @ variance @ left.T
    scale = weights @ variance @ weights / np.trace(form)
    return scale, np.trace(form) ** 2 / np.trace(form @ form)


TURNED = versus("a", "b", 3, 0, 1) + versus("b", "a", 3, 0, 1)


def test_a_side_without_an_interval_says_why() -> None:
    for votes, reason in (
        (versus("a", "b", 3, 0, 0) + versus("b", "a", 3, 0, 0), ONE_SIDED),
        (versus("a", "b", 3, 0, 0) + versus("b", "a", 0, 0, 3), UNDETERMINED),
        (TURNED, ONE_EXPERT),
        ([replace(one, expert=who) for one in TURNED for who in "ef"], ALIKE),
        ([replace(one, expert=who) for one, who in zip(TURNED, "efgefgef", strict=True)], ""),
    ):
        found = side_bias(named(votes))
        assert found.reason == reason
        assert (found.advantage.lower is None) == bool(reason)
        assert (found.advantage.value is None) == (reason in (ONE_SIDED, UNDETERMINED))


def test_the_advantage_of_uneven_experts_is_inside_its_interval() -> None:
    """By the spread of experts who count alike 78 to 82 % were."""
    assert measure_sides(side_worlds()[-1], studies=60)["advantage"] >= 0.9


# --- Single experts and votes ------------------------------------------------------------------


def test_leaving_an_expert_out_is_a_fit_of_the_others() -> None:
    votes = simulated(PAPERS, 1500, 1)
    strengths = fit(votes)
    without = without_each_expert(votes, strengths)
    others = fit(select_votes(votes, votes.expert != 4))
    assert without[4] == pytest.approx(others, abs=1e-9)


def test_a_slight_preference_can_weigh_three_quarters_of_a_win() -> None:
    # 0.75 + 0.75 + 1 + 0 are 2.5 of 4 votes: 400 log10(2.5 / 1.5).
    strengths = bradley_terry(
        named(versus("a", "b", 3, 0, 1)), np.array([True, True, False, False])
    )
    gap = (strengths[0] - strengths[1]) * ELO_PER_LOGIT
    assert gap == pytest.approx(88.739, abs=1e-3)


def test_an_expert_without_whom_nothing_is_determined_is_said_to_be_so() -> None:
    votes = named(
        [
            Comparison(first=first, second=second, score=score, expert=expert, scenario="s")
            for expert, first, second in (("e", "a", "b"), ("f", "b", "c"), ("g", "a", "b"))
            for score in (1.0, 0.0, 1.0)
        ]
    )
    strengths = fit(votes)
    assert rank_changes(strengths, without_each_expert(votes, strengths)) == [0, None, 0]


def test_strengths_are_given_only_where_all_are_determined() -> None:
    votes = named(versus("a", "b", 3, 1, 1))
    assert bradley_terry(votes) == pytest.approx(fit(votes))
    assert bradley_terry(named(versus("a", "b", 3, 0, 0))) is None


def test_rank_changes_count_places() -> None:
    strengths = np.array([2.0, 1.0, 0.0])
    without = np.array([[2.0, 1.0, 0.5], [1.0, 2.0, 0.0], [0.0, 1.0, 2.0]])
    assert rank_changes(strengths, without) == [0, 1, 2]


# --- Pairs -------------------------------------------------------------------------------------


def test_wins_and_ties_count_both_ways() -> None:
    votes = named(versus("a", "b", 3, 1, 2) + versus("b", "a", 1, 0, 0), "a", "b", "c")
    wins, ties = count_wins(votes)
    assert wins.tolist() == [[0, 3, 0], [3, 0, 0], [0, 0, 0]]
    assert ties.tolist() == [[0, 1, 0], [1, 0, 0], [0, 0, 0]]


# --- Single votes ------------------------------------------------------------------------------


def first_of(votes: Comparisons, rows: Sequence[int]) -> str | None:
    """Who is ahead of all others, None for nobody."""
    strengths = bradley_terry(select_votes(votes, np.array(rows, dtype=np.int64)))
    if strengths is None or np.ptp(np.sort(strengths)[-2:]) < 1e-9:
        return None
    return votes.names[int(strengths.argmax())]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_no_much_smaller_set_of_votes_changes_the_first_place_and_that_one_does(seed: int) -> None:
    votes = simulated([1030.0, 1000, 970], 16, seed, ties=0.2)
    everybody = np.ones(len(votes), dtype=np.bool_)
    found, first = votes_behind_first(votes, everybody), first_of(votes, range(len(votes)))
    fewest = next(
        size
        for size in range(1, 5)
        for dropped in combinations(range(len(votes)), size)
        if first_of(votes, [*{*range(len(votes))} - {*dropped}]) not in (None, first)
    )
    # As few as any, or one more: influence orders votes one by one, not together.
    assert fewest <= found.votes <= fewest + 1


def test_ties_that_nobody_cast_are_never_dropped() -> None:
    votes = simulated([1030.0, 1000, 970], 60, 1, ties=0.2)
    assert votes_behind_first(votes, np.zeros(60, dtype=np.bool_)) is None
    found = votes_behind_first(votes, np.ones(60, dtype=np.bool_))
    assert found.cast == 60
