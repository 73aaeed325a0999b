"""Types and sides against contestants: statistics by statsmodels, errors by brute force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import statsmodels.api as sm
from scipy.stats import t

from arena.rating.bradley_terry import ELO_PER_LOGIT
from arena.rating.comparisons import Comparisons, FloatArray, IntArray, select_votes
from arena.rating.moderated import LEAST
from arena.rating.side_interaction import side_interaction
from arena.rating.type_interaction import type_interaction
from tests.rating.votes import fit, simulated

TYPES = ("nudge", "overtake", "cut in")
EQUALS = [1050.0, 1010, 990, 950]


def a_study(votes: int = 900, seed: int = 3) -> tuple[Comparisons, IntArray]:
    """Thirty scenarios, ten of each type."""
    found = simulated(EQUALS, votes, seed, ties=0.3, experts=8, scenarios=30)
    return found, found.scenario % 3


def design(votes: Comparisons) -> FloatArray:
    """(V, C - 1): the first contestant's strength is zero."""
    columns = np.zeros((len(votes), len(votes.names)))
    rows = np.arange(len(votes))
    columns[rows, votes.first] = 1.0
    columns[rows, votes.second] -= 1.0
    return columns[:, 1:]


def with_a_favourite(votes: Comparisons, type_of: IntArray) -> Comparisons:
    """In the first type contestant 3 wins whatever it is in."""
    mine = (type_of == 0) & ((votes.first == 3) | (votes.second == 3))
    return replace(votes, score=np.where(mine, np.where(votes.first == 3, 1.0, 0.0), votes.score))


def test_the_statistic_by_type_is_raos_score_by_statsmodels() -> None:
    votes, type_of = a_study()
    columns = design(votes)
    model = sm.GLM(votes.score, columns, family=sm.families.Binomial())
    null = model.fit(tol=1e-12)
    extra = np.hstack([columns * (type_of == number)[:, None] for number in (1, 2)])
    theirs = model.score_test(
        null.params, k_constraints=extra.shape[1], exog_extra=extra, observed=False
    )
    found = type_interaction(votes, type_of, TYPES, fit(votes), rounds=19, seed=0)
    assert found is not None
    # Theirs divides by a scale that is one for votes.
    assert found.statistic == pytest.approx(float(np.squeeze(theirs[0])), rel=1e-6)
    assert found.freedom == 6


def test_equals_in_all_types_are_told_apart_as_often_as_chance_says() -> None:
    p_values = []
    for seed in range(40):
        votes, type_of = a_study(300, seed)
        found = type_interaction(votes, type_of, TYPES, fit(votes), rounds=99, seed=seed)
        assert found is not None
        p_values.append(found.p_value)
    few = sum(p is not None and p <= 0.05 for p in p_values)
    assert few <= 6  # of 40 at 5 %: more would come about once in 100 times
    assert 0.3 < np.mean([p for p in p_values if p is not None]) < 0.7


def test_a_favourite_of_one_type_is_found_and_named() -> None:
    votes, type_of = a_study()
    votes = with_a_favourite(votes, type_of)
    # A win of all would have no finite rating there: one loss against each.
    first_loss = [
        np.flatnonzero((type_of == 0) & (votes.first == 3) & (votes.second == one))[0]
        for one in range(3)
    ]
    score = votes.score.copy()
    score[first_loss] = 0.0
    found = type_interaction(
        replace(votes, score=score), type_of, TYPES, fit(votes), rounds=99, seed=1
    )
    assert found is not None
    assert found.p_value == pytest.approx(0.01)
    cell = next(one for one in found.cells if (one.contestant, one.condition) == ("c3", "nudge"))
    assert (cell.effect.value or 0.0) > 150.0
    assert (cell.p_value or 1.0) < 0.01
    assert cell.votes == int(((type_of == 0) & ((votes.first == 3) | (votes.second == 3))).sum())


def test_cells_are_the_ratings_of_each_type_and_their_errors_clustered() -> None:
    votes, type_of = a_study(1500)
    found = type_interaction(votes, type_of, TYPES, fit(votes), rounds=1, seed=0)
    assert found is not None
    own = np.array([fit(select_votes(votes, type_of == number)) for number in range(3)])
    effects = (own - own.mean(axis=0)) * ELO_PER_LOGIT
    assert [one.effect.value for one in found.cells] == pytest.approx(effects.ravel().tolist())
    # The error of one cell by hand: what every vote pulls at it, added up by cluster.
    pulls = np.zeros(len(votes))
    for number in range(3):
        rows = type_of == number
        columns = design(select_votes(votes, rows))
        expected = 1.0 / (
            1.0 + np.exp(own[number][votes.second[rows]] - own[number][votes.first[rows]])
        )
        inverse = np.linalg.inv(columns.T @ (columns * (expected * (1 - expected))[:, None]))
        of_all = np.vstack([np.zeros(3), inverse])
        of_all -= of_all.mean(axis=0)
        share = (number == 1) - 1.0 / 3.0
        pulls[rows] = share * (columns @ of_all[2]) * (votes.score[rows] - expected)

    def squares(codes: IntArray) -> float:
        return float((np.bincount(codes, pulls) ** 2).sum())

    scenarios = sum(
        10 / 9 * squares(np.where(type_of == number, votes.scenario, 30))
        - 10 / 9 * float(pulls[type_of != number].sum() ** 2)
        for number in range(3)
    )
    cells = squares(votes.expert * 30 + votes.scenario)
    variance = 8 / 7 * squares(votes.expert) + scenarios - cells
    cell = found.cells[4 + 2].effect
    variance = max(variance, LEAST * cells)
    error = ((cell.upper or 0.0) - (cell.value or 0.0)) / t.ppf(0.975, 7)
    assert error == pytest.approx(np.sqrt(variance) * ELO_PER_LOGIT, rel=1e-6)


def test_one_type_or_one_scenario_each_tells_nothing() -> None:
    votes, type_of = a_study(300)
    assert (
        type_interaction(votes, np.zeros_like(type_of), ("nudge",), fit(votes), rounds=9, seed=0)
        is None
    )
    few = replace(votes, scenario=votes.scenario % 3)
    found = type_interaction(few, few.scenario, TYPES, fit(few), rounds=99, seed=0)
    assert found is not None
    assert (found.p_value, found.rounds) == (None, 0)


def test_the_statistic_by_side_is_walds_by_statsmodels() -> None:
    votes, _ = a_study()
    columns = np.zeros((len(votes), 4))
    rows = np.arange(len(votes))
    columns[rows, votes.first] = columns[rows, votes.second] = 1.0
    shown = votes.expert * 30 + votes.scenario
    cells = len(np.unique(shown))
    theirs = sm.GLM(
        votes.score, np.hstack([design(votes), columns]), family=sm.families.Binomial()
    ).fit(cov_type="cluster", cov_kwds={"groups": shown, "use_correction": False}, tol=1e-12)
    contrast = np.zeros((3, 7))
    contrast[:, 3:] = np.eye(4)[:3] - 0.25
    wald = float(np.squeeze(theirs.wald_test(contrast, scalar=True, use_f=False).statistic))
    found = side_interaction(votes)
    assert found is not None
    assert found.statistic == pytest.approx(wald * (cells - 1) / cells, rel=1e-6)
    assert found.freedom == 3
    sides = theirs.params[3:]
    effects = 2.0 * (sides - sides.mean()) * ELO_PER_LOGIT
    assert [one.effect.value for one in found.cells] == pytest.approx(effects.tolist(), abs=1e-5)


def test_who_wins_on_the_left_alone_is_found() -> None:
    votes, _ = a_study()
    score = votes.score.copy()
    score[(votes.first == 1) & (np.arange(len(votes)) % 10 > 0)] = 1.0
    score[(votes.second == 1) & (np.arange(len(votes)) % 10 > 0)] = 1.0
    found = side_interaction(replace(votes, score=score))
    assert found is not None
    assert (1.0 if found.p_value is None else found.p_value) < 1e-6
    assert max(found.cells, key=lambda cell: cell.effect.value or 0.0).contestant == "c1"


def test_of_two_contestants_neither_gains_more_by_a_side() -> None:
    assert side_interaction(simulated([1000.0, 1000], 100, 1)) is None
