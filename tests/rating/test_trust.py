import itertools

import numpy as np
import pytest
import statsmodels.api as sm

from arena.rating.comparisons import Comparison, Comparisons, count_pairs, count_wins
from arena.rating.influence import (
    count_cycles,
    fewest_votes_to_change_first,
    fit_test,
    rank_changes,
    without_each_expert,
)
from arena.rating.leaderboard import Intervals, rate
from arena.rating.logistic import side_bias
from arena.rating.models import ELO_PER_LOGIT
from arena.rating.planning import design_effects
from arena.rating.rules import Unit
from bench.worlds import World
from tests.rating.votes import fit, named, simulated, versus

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


def test_a_side_that_always_wins_has_no_finite_advantage() -> None:
    found = side_bias(named(versus("a", "b", 3, 0, 0) + versus("b", "a", 3, 0, 0)))
    assert found.advantage.value is None
    assert found.left.value == 1.0


# --- Single experts and votes ------------------------------------------------------------------


def test_leaving_an_expert_out_is_a_fit_of_the_others() -> None:
    votes = simulated(PAPERS, 1500, 1)
    strengths = fit(votes)
    without = without_each_expert(votes, strengths)
    kept = votes.expert != 4
    others = Comparisons(
        names=votes.names,
        first=votes.first[kept],
        second=votes.second[kept],
        score=votes.score[kept],
        expert=votes.expert[kept],
        scenario=votes.scenario[kept],
    )
    assert without[4] == pytest.approx(fit(others), abs=1e-9)


def test_an_expert_without_whom_nothing_is_determined_is_said_to_be_so() -> None:
    def vote(expert: str, first: str, second: str) -> list[Comparison]:
        return [
            Comparison(first=first, second=second, score=score, expert=expert, scenario="s")
            for score in (1.0, 0.0, 1.0)
        ]

    votes = named(vote("e", "a", "b") + vote("f", "b", "c") + vote("g", "a", "b"))
    strengths = fit(votes)
    assert rank_changes(strengths, without_each_expert(votes, strengths)) == [0, None, 0]


def test_rank_changes_count_places() -> None:
    strengths = np.array([2.0, 1.0, 0.0])
    without = np.array([[2.0, 1.0, 0.5], [1.0, 2.0, 0.0], [0.0, 1.0, 2.0]])
    assert rank_changes(strengths, without) == [0, 1, 2]


@pytest.mark.parametrize(("wins", "losses", "answer"), [(8, 5, 4), (6, 5, 2), (20, 3, 18)])
def test_between_two_the_lead_ends_when_its_wins_are_gone(
    wins: int, losses: int, answer: int
) -> None:
    votes = named(versus("a", "b", wins, 2, losses))
    found = fewest_votes_to_change_first(votes, fit(votes))
    assert found is not None
    assert (found.votes, found.exact, found.rival) == (answer, True, 1)


def test_equals_at_the_top_have_no_lead_to_end() -> None:
    votes = named(versus("a", "b", 3, 1, 3))
    assert fewest_votes_to_change_first(votes, fit(votes)) is None


def test_the_number_found_does_it_and_is_called_a_bound() -> None:
    votes = simulated(PAPERS, 5760, 1, ties=0.55)
    strengths = fit(votes)
    found = fewest_votes_to_change_first(votes, strengths)
    assert found is not None
    assert not found.exact
    assert 2 < found.votes < 100
    assert found.rival != int(np.argmax(strengths))


# --- Fit ---------------------------------------------------------------------------------------


def test_x2_of_a_table_worked_out_by_hand() -> None:
    # A circle of three, each 8 to 2 against the next: all are rated alike, so every pair's score
    # is 8 where 5 is foreseen with a variance of 10 / 4: 3 x 9 / 2.5.
    votes = named(
        versus("a", "b", 8, 0, 2) + versus("b", "c", 8, 0, 2) + versus("c", "a", 8, 0, 2)
    )
    found = fit_test(votes, fit(votes), rounds=200, seed=1)
    assert found.statistic == pytest.approx(10.8)
    assert found.freedom == 1
    assert found.p_value is not None
    assert found.p_value < 0.02


def test_votes_of_the_model_itself_fit_it() -> None:
    p_values = []
    for seed in range(20):
        votes = simulated(PAPERS, 2000, seed, ties=0.4)
        found = fit_test(votes, fit(votes), rounds=99, seed=seed)
        assert found.freedom == 28
        p_values.append(found.p_value or 0.0)
    assert 0.3 < np.mean(p_values) < 0.7
    assert min(p_values) > 0.001


def test_two_contestants_leave_nothing_to_test() -> None:
    votes = named(versus("a", "b", 3, 0, 1))
    assert fit_test(votes, fit(votes), rounds=10, seed=1).p_value is None


@pytest.mark.parametrize(("expert_sd", "least", "most"), [(0.0, 0.8, 1.4), (80.0, 2.5, 6.0)])
def test_a_design_effect_is_one_where_votes_are_independent(
    expert_sd: float, least: float, most: float
) -> None:
    """It was 2.8 by two-way resamples of independent votes of 12 experts."""
    world = World(
        ratings=np.linspace(940.0, 1060.0, 9),
        expert_sd=expert_sd,
        experts=12,
        votes_per_expert=200,
    )
    votes = world.votes(np.random.default_rng(3))
    alone = rate(votes, unit=Unit.VOTE, intervals=Intervals.CLOSED_FORM, rounds=50)
    effects = design_effects(rate(votes, rounds=50), alone)
    assert least < float(np.median(effects)) < most


# --- Pairs -------------------------------------------------------------------------------------


def test_wins_and_ties_count_both_ways() -> None:
    votes = named(versus("a", "b", 3, 1, 2) + versus("b", "a", 1, 0, 0), "a", "b", "c")
    wins, ties = count_wins(votes)
    assert wins.tolist() == [[0, 3, 0], [3, 0, 0], [0, 0, 0]]
    assert ties.tolist() == [[0, 1, 0], [1, 0, 0], [0, 0, 0]]


# --- Cycles ------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(10))
def test_cycles_are_counted_by_trying_every_three(seed: int) -> None:
    votes = simulated([1000.0] * 6, 40, seed)
    counts = count_pairs(votes)
    lead = np.zeros((6, 6))
    lead[counts.low, counts.high] = counts.scores - 0.5 * counts.games
    lead -= lead.T
    cycles = triples = 0
    for a, b, c in itertools.combinations(range(6), 3):
        ends = [lead[a, b], lead[b, c], lead[c, a]]
        triples += all(ends)
        cycles += all(one > 0 for one in ends) or all(one < 0 for one in ends)
    found = count_cycles(counts, 6, counts.scores[None])
    assert (found[0].tolist(), found[1].tolist()) == ([cycles], [triples])


def test_a_test_of_fit_has_the_cycles_and_what_chance_gives() -> None:
    votes = named(
        versus("a", "b", 30, 0, 10) + versus("b", "c", 30, 0, 10) + versus("c", "a", 30, 0, 10)
    )
    found = fit_test(votes, fit(votes), rounds=200, seed=1)
    assert (found.cycles, found.triples, found.cyclic_share) == (1, 1, 1.0)
    # Of three fair coins two of eight falls make a cycle.
    assert found.cycles_foreseen == pytest.approx(0.25, abs=0.1)
