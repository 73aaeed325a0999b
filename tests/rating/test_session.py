"""Change within sessions: by statsmodels with a level of its own for every session."""

from __future__ import annotations

import numpy as np
import pytest
import statsmodels.api as sm
from scipy.stats import t

from arena.rating.session import PAUSE_S, drifts, number_sessions


def test_a_long_pause_begins_a_session_and_another_expert_does_too() -> None:
    expert = np.array([0, 1, 0, 0, 1, 0])
    at = np.array([0.0, 5.0, PAUSE_S, 2 * PAUSE_S + 1.0, 6.0, 10.0])
    session, place = number_sessions(expert, at, np.arange(6.0))
    assert session.tolist() == [0, 2, 0, 1, 2, 0]
    assert place.tolist() == [0, 0, 2, 0, 1, 1]


def test_without_times_an_experts_votes_are_one_session_in_their_own_order() -> None:
    unknown = np.full(4, np.nan)
    session, place = number_sessions(np.array([0, 0, 1, 0]), unknown, np.array([3.0, 1, 1, 2]))
    assert session.tolist() == [0, 0, 1, 0]
    assert place.tolist() == [2, 0, 0, 1]


def test_the_slope_and_its_error_are_those_of_statsmodels() -> None:
    rng = np.random.default_rng(4)
    expert = np.repeat(np.arange(6), 80)
    session = expert * 2 + np.tile(np.repeat([0, 1], 40), 6)
    place = np.tile(np.arange(40), 12)
    values = rng.random(480) + 0.002 * place + 0.3 * session
    levels = (session[:, None] == np.arange(12)).astype(float)
    theirs = sm.OLS(values, np.column_stack([levels, place / 100.0])).fit(
        cov_type="cluster", cov_kwds={"groups": expert, "use_correction": False}, use_t=True
    )
    (found,) = drifts(expert, session, place, {"seconds": values})
    assert found.slope.value == pytest.approx(theirs.params[-1], rel=1e-9)
    error = theirs.bse[-1] * np.sqrt(6 / 5)
    assert found.slope.upper == pytest.approx(
        theirs.params[-1] + t.ppf(0.975, 5) * error, rel=1e-9
    )
    assert found.p_value == pytest.approx(2 * t.sf(abs(theirs.params[-1] / error), 5), rel=1e-9)
    assert (found.votes, found.sessions, found.experts) == (480, 12, 6)
    quarter = np.isin(place, range(10))
    assert found.early == pytest.approx(values[quarter].mean())
    assert found.late == pytest.approx(values[place >= 30].mean())


def test_levels_of_sessions_are_no_change() -> None:
    session = np.repeat([0, 1], 50)
    place = np.tile(np.arange(50), 2)
    (found,) = drifts(session, session, place, {"ties": session.astype(float)})
    assert found.slope.value == pytest.approx(0.0, abs=1e-12)


def test_votes_without_a_value_and_sessions_of_one_are_left_out() -> None:
    session = np.array([0, 0, 0, 1])
    values = np.array([1.0, np.nan, 2.0, 5.0])
    (found,) = drifts(session, session, np.array([0, 1, 2, 0]), {"agreement": values})
    assert (found.votes, found.sessions) == (2, 1)
    assert found.slope.value == pytest.approx(50.0)  # one more over two places, for a hundred
    assert (found.slope.lower, found.p_value) == (None, None)


def test_no_votes_have_no_change() -> None:
    nothing = np.empty(0, dtype=np.int64)
    (found,) = drifts(nothing, nothing, nothing, {"ties": np.empty(0)})
    assert (found.votes, found.slope.value, found.early) == (0, None, None)
