"""The stopping rule: looks, their levels, and what they promise."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ndtri
from scipy.stats import multivariate_normal

from arena.rating.bootstrap import Unit
from arena.rating.leaderboard import rate
from arena.rating.stopping import StoppingRule, look_levels, spent, widest_half_width
from tests.benchmarks.worlds import World, paper_ratings


def test_five_looks_have_the_published_limits() -> None:
    """DeMets and Lan 1994: spending of Pocock's kind, two-sided 5 %, five equal looks."""
    limits = [-ndtri(level / 2.0) for level in look_levels([0.2, 0.4, 0.6, 0.8, 1.0])]
    assert [round(limit, 2) for limit in limits] == [2.44, 2.43, 2.41, 2.40, 2.39]


def test_a_single_look_has_all_of_the_error() -> None:
    assert look_levels([1.0]) == pytest.approx([0.05])


@given(st.lists(st.floats(0.05, 1.0), min_size=2, max_size=3, unique=True))
def test_all_looks_together_err_as_often_as_was_spent(shares: list[float]) -> None:
    """Against the normal distribution of all looks at once."""
    shares = sorted(shares)
    if min(np.diff(shares)) < 0.02:
        return
    limits = np.array([-ndtri(level / 2.0) for level in look_levels(shares)])
    t = np.array(shares)
    covariance = np.sqrt(np.minimum.outer(t, t) / np.maximum.outer(t, t))
    together = multivariate_normal(mean=np.zeros(len(t)), cov=covariance)
    inside = together.cdf(limits, lower_limit=-limits)
    assert 1.0 - inside == pytest.approx(spent(shares[-1]), abs=2e-4)


@pytest.mark.parametrize("shares", [[0.0, 1.0], [0.5, 0.5], [0.6, 0.4], [0.5, 1.1]])
def test_shares_that_do_not_rise_are_refused(shares: list[float]) -> None:
    with pytest.raises(ValueError, match="shares rise"):
        look_levels(shares)


@pytest.mark.parametrize(
    ("rule", "planned", "points"),
    [
        (StoppingRule(half_width=25.0, votes=2000), 5760, (400, 800, 1200, 1600, 2000)),
        (StoppingRule(half_width=25.0, votes=9000), 18, (4, 8, 11, 15, 18)),
        (StoppingRule(half_width=25.0, looks=3), 100, (34, 67, 100)),
        (StoppingRule(half_width=25.0, looks=5), 3, (1, 2, 3)),
        (StoppingRule(votes=2000), 5760, (2000,)),
    ],
)
def test_looks_are_fixed_by_the_rule_and_the_plan(
    rule: StoppingRule, planned: int, points: tuple[int, ...]
) -> None:
    assert rule.look_votes(planned) == points


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({}, "needs a half-width or a number of votes"),
        ({"half_width": 0.0}, "more than 0"),
        ({"votes": 0}, "1 or more"),
        ({"votes": 5, "looks": 21}, "1 to 20"),
        ({"votes": 5, "looks": 0}, "1 to 20"),
    ],
)
def test_a_rule_that_can_not_be_is_refused(wrong: dict[str, float], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        StoppingRule(**wrong)  # type: ignore[arg-type]


def test_the_widest_interval_at_the_usual_level_is_the_widest_of_the_table() -> None:
    world = World(ratings=paper_ratings(), expert_sd=40.0, votes_per_expert=60)
    board = rate(world.votes(np.random.default_rng(1)), unit=Unit.TWO_WAY, rounds=300)
    widest = max(((line.upper or 0) - (line.lower or 0)) / 2.0 for line in board.lines)
    assert widest_half_width(board, 0.05) == pytest.approx(widest, rel=1e-6)
    stricter = widest_half_width(board, 0.01)
    assert stricter is not None
    assert stricter > 1.3 * widest


def test_an_open_interval_is_never_narrow_enough() -> None:
    world = World(ratings=paper_ratings() + np.arange(9) * 600.0, votes_per_expert=20)
    board = rate(world.votes(np.random.default_rng(1)), unit=Unit.TWO_WAY, rounds=300)
    assert widest_half_width(board, 0.05) is None
