"""Sparse results of many teams in leagues: an interval for everybody whom they determine.

Made up in the shape of football: 316 teams in 16 leagues, each plays in its own league and now and
then in another one. Some teams scored against others hardly ever, or in each of a few matches.
"""

import numpy as np
import pytest
import statsmodels.api as sm

from arena.rating.comparisons import Comparisons, FloatArray, IntArray
from arena.rating.leaderboard import Intervals, Leaderboard, Line, rate
from arena.rating.models import ELO_PER_LOGIT
from arena.rating.rules import Unit

TEAMS, LEAGUES = 316, 16
MATCHES = 3400
WEAK = {300: 1, 301: 2, 302: 5, 303: 8}
"""Teams that lost all of 16 matches but so many, in which they drew."""
CHAMPION, LAST, FEW = 304, 305, 7
"""Won, and lost, all of seven matches."""


def results() -> Comparisons:
    """Each league's teams meet; one match of ten is between two leagues."""
    rng = np.random.default_rng(8)
    usual = min(WEAK)
    strength = rng.normal(0.0, 0.5, usual)
    first = rng.integers(0, usual, MATCHES)
    mates = (first + LEAGUES * rng.integers(1, usual // LEAGUES, MATCHES)) % usual
    others = (first + rng.integers(1, usual, MATCHES)) % usual
    second = np.where(rng.random(MATCHES) < 0.9, mates, others)
    first, second = first[first != second], second[first != second]
    chance = 1.0 / (1.0 + np.exp(strength[second] - strength[first]))
    drawn = rng.random(len(first))
    score = np.where(drawn < chance - 0.1, 1.0, np.where(drawn < chance + 0.1, 0.5, 0.0))
    rows = [np.stack([first, second, score], axis=1)]
    for team, draws in WEAK.items():
        rivals = rng.choice(usual, 16, replace=False)
        rows.append(np.stack([np.full(16, team), rivals, 0.5 * (np.arange(16) < draws)], axis=1))
    for team, points in ((CHAMPION, 1.0), (LAST, 0.0)):
        rivals = rng.choice(usual, FEW, replace=False)
        rows.append(np.stack([np.full(FEW, team), rivals, np.full(FEW, points)], axis=1))
    table = np.concatenate(rows)
    nobody: IntArray = np.zeros(len(table), dtype=np.int64)
    return Comparisons(
        names=tuple(f"team {number}" for number in range(TEAMS)),
        first=table[:, 0].astype(np.int64),
        second=table[:, 1].astype(np.int64),
        score=table[:, 2].copy(),
        expert=nobody,
        scenario=nobody.copy(),
    )


@pytest.fixture(scope="module")
def played() -> Comparisons:
    return results()


@pytest.fixture(scope="module")
def board(played: Comparisons) -> Leaderboard:
    return rate(played, unit=Unit.VOTE, intervals=Intervals.CLOSED_FORM, rounds=400)


def ends(line: Line) -> tuple[bool, bool]:
    return line.lower is not None, line.upper is not None


def firm_lines(board: Leaderboard) -> list[Line]:
    """Of usual teams with six matches in which they scored, and six in which others did."""
    usual = board.lines[: min(WEAK)]
    return [line for line in usual if min(line.wins, line.losses) + line.ties >= 6]


def test_everybody_whom_the_results_determine_has_an_interval(board: Leaderboard) -> None:
    assert all(line.rating is not None for line in board.lines[:CHAMPION])
    assert all(any(ends(line)) for line in board.lines[:CHAMPION])
    assert len(firm_lines(board)) > 280
    assert {ends(line) for line in firm_lines(board)} == {(True, True)}


@pytest.mark.parametrize(
    ("team", "bounds"),
    [(300, (False, True)), (301, (False, True)), (302, (True, True)), (303, (True, True))],
)
def test_a_weak_team_has_a_lower_bound_where_its_points_hardly_ever_go_missing(
    board: Leaderboard, team: int, bounds: tuple[bool, bool]
) -> None:
    """All of k drawn matches are missing from exp(-k) of the resamples, of which 2.5 % may be."""
    assert (np.exp(-WEAK[team]) < 0.025) == bounds[0]
    assert board.lines[team].rating is not None
    assert ends(board.lines[team]) == bounds


def test_who_won_or_lost_all_or_did_not_play_lacks_a_number_and_nobody_else(
    board: Leaderboard,
) -> None:
    bare = [line.name for line in board.lines if ends(line) == (False, False)]
    assert bare == [f"team {number}" for number in range(CHAMPION, TEAMS)]


def test_ratings_and_widths_are_those_of_a_logistic_regression(
    played: Comparisons, board: Leaderboard
) -> None:
    """statsmodels: strengths as coefficients, errors robust (HC0), the mean of all taken off."""
    inside = (np.maximum(played.first, played.second) < CHAMPION).nonzero()[0]
    design = np.zeros((len(inside), CHAMPION))
    design[np.arange(len(inside)), played.first[inside]] = 1.0
    design[np.arange(len(inside)), played.second[inside]] -= 1.0
    found = sm.GLM(played.score[inside], design[:, 1:], family=sm.families.Binomial()).fit(
        cov_type="HC0"
    )
    strengths = np.concatenate([[0.0], found.params])
    covariance: FloatArray = np.zeros((CHAMPION, CHAMPION))
    covariance[1:, 1:] = found.cov_params()
    # What the closed form calls the mean is that of those whom resamples determine.
    centre = np.eye(CHAMPION) - np.where(np.arange(CHAMPION) < min(WEAK), 1.0 / min(WEAK), 0.0)
    errors = np.sqrt((centre @ covariance @ centre.T).diagonal())
    rating = np.array([line.rating for line in board.lines[:CHAMPION]])
    wanted = strengths * ELO_PER_LOGIT
    assert rating - rating.mean() == pytest.approx(wanted - wanted.mean(), abs=1e-3)
    for line in firm_lines(board):
        assert line.lower is not None
        assert line.upper is not None
        expected = 1.959964 * ELO_PER_LOGIT * errors[board.lines.index(line)]
        assert (line.upper - line.lower) / 2.0 == pytest.approx(expected, rel=0.01)
