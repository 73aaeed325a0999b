"""The bootstrap with random effects, held against plain loops over experts and scenarios."""

from dataclasses import replace

import numpy as np
import pytest

from arena.rating.comparisons import Comparisons, FloatArray, t_quantile
from arena.rating.leaderboard import Method, rate
from arena.rating.models import ELO_PER_LOGIT
from arena.rating.random_effects import find_quantiles
from arena.rating.rules import Unit
from arena.rating.sandwich import estimate_spread
from bench.worlds import World
from tests.rating.votes import pulls_of, simulated

TRUTH = [1080.0, 1020.0, 980.0, 920.0]
SMALL = World(
    ratings=np.array(TRUTH), scenario_sd=100.0, expert_sd=60.0, experts=4, scenarios=6,
    votes_per_expert=36,
)  # fmt: skip


def quantiles(votes: Comparisons, *, rounds: int, seed: int = 1) -> tuple[FloatArray, FloatArray]:
    """(C,) of the bootstrap, and (C,) of Student's t."""
    pulls = pulls_of(votes)
    everybody = np.ones(len(votes.names), dtype=np.bool_)
    spread = estimate_spread(pulls, Unit.TWO_WAY)
    found = find_quantiles(pulls, spread, Unit.TWO_WAY, everybody, rounds=rounds, seed=seed)
    return found, t_quantile(spread.degrees)


def moderated(raw: FloatArray, base: FloatArray, single: FloatArray, w: FloatArray) -> FloatArray:
    """(C,) a square of clusters whose shares of information are w (G, C); docs/rating.md."""
    s2, s3 = (w**2).sum(axis=0), (w**3).sum(axis=0)
    left = np.maximum(1 - 2 * s3 / s2 + s2, 0.5 * (1 - s2))
    room = s2 * (1 - 2 / len(s2)) + s2.mean() / len(s2)
    t2 = ((raw - base * (1 - s2)) / single**2).sum() / (room * left / single**2).sum()
    common = np.maximum(base + t2 * room, 0.6 * base)
    noise = np.minimum(base / common, 1)
    left = noise * (1 - s2) + (1 - noise) * left
    degrees, ratio = left / s2, raw / left / common
    surplus = (degrees * ((ratio - 1) ** 2 - 2 / degrees)).sum() / degrees.sum()
    surplus /= 1 + 2 / degrees.mean()
    prior = 24 if surplus <= 0 else min(24, 4 + 2 / surplus)
    return np.asarray((prior * common + degrees * raw / left) / (prior + degrees))


def plain_quantiles(votes: Comparisons, rounds: int) -> FloatArray:
    size, rng = len(votes.names), np.random.default_rng(5)
    pulls = pulls_of(votes)
    back = pulls.back[:, :size] - pulls.back[:, :size].mean(axis=0)
    experts, scenarios = votes.expert.max() + 1, votes.scenario.max() + 1
    score = np.zeros((experts, scenarios, size))
    inner = np.zeros((experts, scenarios, size, size))
    slopes, single = pulls.slopes.toarray(), np.zeros(size)
    for row in range(len(votes)):
        place, ends = (votes.expert[row], votes.scenario[row]), np.zeros(size)
        ends[votes.first[row]], ends[votes.second[row]] = 1.0, -1.0
        score[place] += slopes[row]
        inner[place] += pulls.information[row] * np.outer(ends, ends)
        single += (ELO_PER_LOGIT * back @ slopes[row]) ** 2

    def squares(pulled: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        moved = pulled @ back.T
        kinds = (moved.sum(axis=1), moved.sum(axis=0), moved.reshape(-1, size))
        return tuple((kind**2).sum(axis=0) for kind in kinds)

    *raws, base = squares(ELO_PER_LOGIT * score)
    weights, deviations = [], []
    for axis, raw in enumerate(raws):
        w = inner.sum(axis=1 - axis).diagonal(axis1=1, axis2=2)
        w = w / w.sum(axis=0)
        s2, s3 = (w**2).sum(axis=0), (w**3).sum(axis=0)
        left = np.maximum(1 - 2 * s3 / s2 + s2, 0.5 * (1 - s2))
        room = (s2 * (1 - 2 / size) + s2.mean() / size) * left
        surplus = raw - base * (1 - s2)
        t2 = max((surplus / single**2).sum() / (room / single**2).sum(), 0)
        share = (left / s2) / (24 + left / s2)
        variance = (1 - share) * t2 + share * np.maximum(surplus / room, 0)
        weights.append(w)
        deviations.append(np.sqrt(variance))
    drawn = []
    for _ in range(rounds):
        of_experts = rng.normal(size=(experts, 1, size)) * deviations[0]
        of_scenarios = rng.normal(size=(1, scenarios, size)) * deviations[1]
        pulled = ELO_PER_LOGIT * score * rng.choice([-1.0, 1.0], (experts, scenarios, 1))
        pulled = pulled + np.einsum("escd,esd->esc", inner, of_experts + of_scenarios)
        rating = back @ pulled.sum(axis=(0, 1))
        *own, cells = squares(pulled - inner @ rating)
        variance = sum(
            moderated(raw, cells, single, w) for raw, w in zip(own, weights, strict=True)
        )
        drawn.append(np.abs(rating) / np.sqrt(np.maximum(variance - cells, 0.6 * cells)))
    return np.asarray(np.quantile(drawn, 0.95, axis=0))


def test_quantiles_are_those_of_plain_loops() -> None:
    votes = SMALL.votes(np.random.default_rng(2))
    found, _ = quantiles(votes, rounds=20_000)
    assert found == pytest.approx(plain_quantiles(votes, 4000), rel=0.08)


def test_ends_of_intervals_hardly_move_from_seed_to_seed() -> None:
    votes = World(ratings=np.linspace(950.0, 1050.0, 9), scenario_sd=80.0, expert_sd=40.0).votes(
        np.random.default_rng(3)
    )
    lines = [rate(votes, seed=seed).lines for seed in (1, 2)]
    moved = [
        abs(one.upper - other.upper) / (one.upper - one.lower)
        for one, other in zip(*lines, strict=True)
    ]
    assert np.median(moved) < 0.02
    assert max(moved) < 0.05


def test_many_clusters_are_dealt_into_groups_that_leave_quantiles() -> None:
    votes = simulated(TRUTH, 30_000, 4, experts=600, scenarios=300)
    found, of_t = quantiles(votes, rounds=4000)
    assert found == pytest.approx(of_t, rel=0.06)


@pytest.mark.parametrize("method", [Method.BRADLEY_TERRY, Method.DAVIDSON])
def test_rows_of_several_votes_count_as_so_many(method: Method) -> None:
    """As effects grow the copies of a vote say nothing new; intervals stay symmetric."""
    votes = SMALL.votes(np.random.default_rng(6))
    twice = replace(votes, count=2 * votes.count)
    for line, other in zip(
        rate(votes, method=method, rounds=4000).lines,
        rate(twice, method=method, rounds=4000).lines,
        strict=True,
    ):
        assert line.interval_text.startswith("±")
        assert other.rating == pytest.approx(line.rating, abs=1e-6)
        assert other.upper == pytest.approx(line.upper, rel=0.02)
