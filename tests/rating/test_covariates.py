"""Ratings adjusted for what else was shown: by statsmodels, and what they refuse."""

from dataclasses import replace

import numpy as np
import pytest
import statsmodels.api as sm
from scipy.stats import t

from arena.rating.comparisons import Comparisons, FloatArray
from arena.rating.leaderboard import Intervals, Method, rate
from arena.rating.models import ELO_PER_LOGIT
from arena.rating.rules import Unit
from tests.rating.votes import simulated

RATINGS = [1050.0, 1010, 990, 950]


def adjusted(extra: FloatArray | None = None) -> tuple[Comparisons, Comparisons]:
    """The same votes without and with the side and how many more objects the left one has."""
    votes = simulated(RATINGS, 1200, 3, ties=0.3, experts=12, scenarios=40)
    rng = np.random.default_rng(5)
    more = rng.integers(-3, 4, len(votes)).astype(float)
    won_by_more = (rng.random(len(votes)) < 0.2) & (more != 0)
    votes = replace(votes, score=np.where(won_by_more, np.where(more > 0, 1.0, 0.0), votes.score))
    columns = np.column_stack([np.ones(len(votes)), more]) if extra is None else extra
    return votes, replace(votes, covariates=columns)


def design(votes: Comparisons) -> FloatArray:
    columns = np.zeros((len(votes), len(votes.names)))
    rows = np.arange(len(votes))
    columns[rows, votes.first] = 1.0
    columns[rows, votes.second] -= 1.0
    return np.hstack([columns[:, 1:], votes.covariates])


def test_ratings_and_coefficients_are_those_of_statsmodels() -> None:
    plain, votes = adjusted()
    board = rate(votes)
    glm = sm.GLM(votes.score, design(votes), family=sm.families.Binomial())
    cell = votes.expert * 40 + votes.scenario
    fits = [
        (
            groups,
            glm.fit(
                cov_type="cluster", cov_kwds={"groups": groups, "use_correction": False}, tol=1e-12
            ),
        )
        for groups in (votes.expert, votes.scenario, cell)
    ]
    strengths = np.append(0.0, fits[0][1].params[:3])
    ratings = 1000.0 + ELO_PER_LOGIT * (strengths - strengths.mean())
    assert [line.rating for line in board.lines] == pytest.approx(ratings.tolist(), abs=1e-5)
    covariance = sum(
        sign * found.cov_params() * len(np.unique(groups)) / (len(np.unique(groups)) - 1)
        for sign, (groups, found) in zip((1, 1, -1), fits, strict=True)
    )
    assert isinstance(covariance, np.ndarray)
    for place, one in enumerate(board.coefficients, start=3):
        value = fits[0][1].params[place] * ELO_PER_LOGIT
        error = np.sqrt(covariance[place, place]) * ELO_PER_LOGIT
        assert one.points.value == pytest.approx(value, abs=1e-5)
        assert one.points.upper == pytest.approx(value + t.ppf(0.975, 11) * error, rel=1e-6)
        assert one.p_value == pytest.approx(2 * t.sf(abs(value / error), 11), rel=1e-6)
    more = board.coefficients[1]
    assert (more.points.lower or 0.0) > 0.0, "more objects win in every fifth vote"
    assert board.lines != rate(plain).lines


def test_a_side_by_itself_is_the_advantage_of_the_left() -> None:
    from arena.rating.logistic import side_bias

    plain, votes = adjusted(np.ones((1200, 1)))
    found = rate(votes, unit=Unit.EXPERT).coefficients[0].points
    theirs = side_bias(plain).advantage
    assert (found.value, found.lower) == pytest.approx((theirs.value, theirs.lower), rel=1e-9)


def test_what_says_no_more_than_who_was_shown_is_left_out_and_said() -> None:
    plain, _ = adjusted()
    size = np.array([5.0, 3, 2, 1])  # everybody always shows as many objects
    votes = replace(plain, covariates=(size[plain.first] - size[plain.second])[:, None])
    board = rate(votes)
    assert "do not determine what was to be adjusted for" in board.explanation
    assert board.coefficients == ()
    assert [line.rating for line in board.lines] == [line.rating for line in rate(plain).lines]


@pytest.mark.parametrize(
    "rules", [{"method": Method.DAVIDSON}, {"intervals": Intervals.RESAMPLES}]
)
def test_other_methods_take_no_covariates(rules: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="can be adjusted for covariates"):
        rate(adjusted()[1], **rules)  # type: ignore[arg-type]


def test_single_votes_with_covariates_have_intervals_in_closed_form() -> None:
    assert rate(adjusted()[1], unit=Unit.VOTE).intervals is Intervals.CLOSED_FORM
