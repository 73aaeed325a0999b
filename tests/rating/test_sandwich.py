"""Closed-form covariances, against formulas, packages and the bootstrap."""

import json
from pathlib import Path

import numpy as np
import pytest
import scipy.stats
import statsmodels.api as sm

from arena.rating.comparisons import Comparisons, FloatArray, t_above, t_quantile
from arena.rating.leaderboard import rate
from arena.rating.models import ELO_PER_LOGIT, to_elo
from arena.rating.rules import Unit
from arena.rating.sandwich import estimate_spread, remaining_share
from bench.worlds import World
from tests.rating.votes import fit, pulls_of, simulated

ARENA_RANK = json.loads((Path(__file__).parent / "arena_rank.json").read_text())
TRUTH = [1060.0, 1020.0, 1000.0, 980.0, 940.0]


def covariance(votes: Comparisons, unit: Unit) -> FloatArray:
    pulls = pulls_of(votes)
    if unit is Unit.VOTE:
        return pulls.by_row()
    codes, of_row = np.unique(getattr(votes, unit.value), return_inverse=True)
    return pulls.by_cluster(of_row, len(codes)) * len(codes) / (len(codes) - 1)


def half_widths(votes: Comparisons, unit: Unit) -> FloatArray:
    return np.asarray(1.959964 * np.sqrt(covariance(votes, unit).diagonal()))


@pytest.mark.parametrize("degrees", [1.0, 1.3, 2.0, 3.0, 8.0, 19.0, 57.4, 4000.0, 1e6])
def test_students_t_is_scipys(degrees: float) -> None:
    theirs = scipy.stats.t(degrees)
    assert t_quantile(degrees) == pytest.approx(theirs.ppf(0.975), rel=1e-6)
    values = np.array([0.0, 0.3, 1.0, 2.5, 6.0])
    assert t_above(values, degrees) == pytest.approx(theirs.sf(values), rel=1e-5, abs=1e-100)


@pytest.mark.parametrize("unit", [Unit.EXPERT, Unit.SCENARIO])
def test_one_way_clusters_are_statsmodels(unit: Unit) -> None:
    votes = simulated(TRUTH, 1500, 2, ties=0.0)
    design = np.zeros((len(votes), len(TRUTH)))
    rows = np.arange(len(votes))
    design[rows, votes.first], design[rows, votes.second] = 1.0, -1.0
    groups = votes.expert if unit is Unit.EXPERT else votes.scenario
    fitted = sm.GLM(votes.score, design[:, 1:], family=sm.families.Binomial()).fit(
        cov_type="cluster", cov_kwds={"groups": groups, "use_correction": False}
    )
    # Theirs hold the first at zero; differences of the others must have the same variance.
    theirs = ELO_PER_LOGIT**2 * fitted.cov_params()
    clusters = len(np.unique(groups))
    ours = covariance(votes, unit)[1:, 1:] * (clusters - 1) / clusters
    for one in range(3):
        contrast = np.zeros(4)
        contrast[one], contrast[one + 1] = 1.0, -1.0
        assert contrast @ ours @ contrast == pytest.approx(contrast @ theirs @ contrast, rel=1e-4)


@pytest.mark.parametrize("unit", [Unit.VOTE, Unit.EXPERT, Unit.SCENARIO])
def test_the_bootstrap_agrees_where_clusters_are_many(unit: Unit) -> None:
    votes = simulated(TRUTH, 4000, 3, experts=60, scenarios=200)
    lines = rate(votes, unit=unit, rounds=4000).lines
    for line, half in zip(lines, half_widths(votes, unit), strict=True):
        assert line.lower == pytest.approx(line.rating - half, abs=1.5)
        assert line.upper == pytest.approx(line.rating + half, abs=1.5)


@pytest.mark.parametrize("name", [name for name in ARENA_RANK if name != "what"])
def test_ratings_and_intervals_agree_with_arena_rank(name: str) -> None:
    """Its stored answers, by `make bench`; intervals are symmetric and by single votes."""
    answer = ARENA_RANK[name]
    pairs = np.array(answer["pairs"])
    outcome = np.tile([1.0, 0.5, 0.0], len(pairs))
    counts = pairs[:, 2:].ravel()
    seen = counts > 0
    nobody = np.zeros(int(seen.sum()), dtype=np.int64)
    votes = Comparisons(
        names=tuple(f"c{index:03d}" for index in range(len(answer["rating"]))),
        first=np.repeat(pairs[:, 0], 3)[seen],
        second=np.repeat(pairs[:, 1], 3)[seen],
        score=outcome[seen],
        expert=nobody,
        scenario=nobody.copy(),
        count=counts[seen],
    )
    board = rate(votes, unit=Unit.VOTE, rounds=100)
    ratings = np.array([line.rating for line in board.lines], dtype=np.float64)
    half = half_widths(votes, Unit.VOTE)
    assert ratings == pytest.approx(np.array(answer["rating"]), abs=0.05)
    assert ratings - half == pytest.approx(np.array(answer["lower"]), abs=0.1)
    assert ratings + half == pytest.approx(np.array(answer["upper"]), abs=0.1)


# --- Moderated variances ---------------------------------------------------------------------


STUDIES = 120


def test_what_the_fit_leaves_is_that_of_a_weighted_mean() -> None:
    """The residuals w (u - w'u) of effects u with variance 1, over the variance of w'u."""
    for shares, left in (
        ((1.0,), 0.0),
        ((0.5, 0.5), 0.5),  # even clusters: 1 - 1 / G
        ((0.25,) * 4, 0.75),
        ((0.05,) * 20, 0.95),
        ((0.7, 0.3), 0.58 - 2.0 * 0.37 / 0.58 + 1.0),
        ((0.5, 0.2, 0.2, 0.1), None),
        ((0.9, 0.1), 0.5 * 0.18),  # 0.04 without the floor
    ):
        share = np.array(shares)
        residual = np.diag(share) @ (np.eye(len(share)) - np.outer(np.ones(len(share)), share))
        exact = np.trace(residual @ residual.T) / (share @ share)
        found = remaining_share(np.array([share @ share]), np.array([(share**3).sum()]))[0]
        assert found == pytest.approx(exact if left is None else left)
        assert found >= exact - 1e-12


@pytest.mark.slow
@pytest.mark.parametrize(
    "world",
    [
        {"scenarios": 3, "scenario_sd": 100.0, "experts": 9, "votes_per_expert": 90},
        {"experts": 9, "votes_per_expert": 150, "expert_sd": 80.0, "uneven": 1.0},
        {"experts": 9, "votes_per_expert": 100, "expert_sd": 40.0},
        {"experts": 9, "votes_per_expert": 100},
    ],
    ids=["three scenarios", "uneven experts", "even experts", "independent votes"],
)
def test_variances_are_those_of_simulated_ratings(world: dict[str, float]) -> None:
    """Before, three scenarios gave 0.72 of the variance and uneven experts 0.79."""
    ratings, variances = [], []
    for seed in range(STUDIES):
        votes = World(ratings=np.full(9, 1000.0), **world).votes(np.random.default_rng(seed))  # type: ignore[arg-type]
        spread = estimate_spread(pulls_of(votes), Unit.TWO_WAY)
        ratings.append(to_elo(fit(votes)))
        variances.append(spread.covariance.diagonal())
    truth = np.mean(np.square(np.array(ratings) - 1000.0))
    assert 0.92 < np.mean(variances) / truth < 1.08


@pytest.mark.parametrize(("clusters", "contestants"), [(40, 6), (70_000, 40)])
def test_squares_of_clusters_are_those_of_their_sums(clusters: int, contestants: int) -> None:
    votes = simulated([1000.0] * contestants, 3000, 1)
    pulls = pulls_of(votes)
    cluster_of = np.random.default_rng(1).integers(0, clusters, len(votes))
    cluster_of[:900] = 7  # one cluster pulls at nearly all
    sums = np.zeros((clusters, contestants))
    surprise = votes.score - 1.0 / (
        1.0 + np.exp(-np.subtract(*fit(votes)[[votes.first, votes.second]]))
    )
    np.add.at(sums, (cluster_of, votes.first), surprise)
    np.subtract.at(sums, (cluster_of, votes.second), surprise)
    ratings = ELO_PER_LOGIT * sums @ pulls.back.T
    assert pulls.by_cluster(cluster_of, clusters) == pytest.approx(ratings.T @ ratings)
