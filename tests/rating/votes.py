"""Votes for tests of ratings."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from arena.rating import models
from arena.rating.comparisons import LOSS, TIE, WIN, Comparisons, FloatArray, IntArray, count_pairs
from arena.rating.leaderboard import Leaderboard, rate
from arena.rating.models import ELO_PER_LOGIT
from arena.rating.rules import Unit
from arena.rating.sandwich import Pulls, pulls_of_model


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """One vote: what `first` scored against `second`, who judged, and on which scenario."""

    first: str
    second: str
    score: float
    expert: str = ""
    scenario: str = ""


def as_arrays(names: Sequence[str], votes: Sequence[Comparison]) -> Comparisons:
    """A row a vote; experts and scenarios are numbered in the order of their names."""

    def number(known: Iterable[str], wanted: list[str]) -> IntArray:
        order = {name: place for place, name in enumerate(known)}
        return np.array([order[name] for name in wanted], dtype=np.int64)

    experts, scenarios = ([getattr(v, kind) for v in votes] for kind in ("expert", "scenario"))
    return Comparisons(
        names=tuple(names),
        first=number(names, [vote.first for vote in votes]),
        second=number(names, [vote.second for vote in votes]),
        score=np.array([vote.score for vote in votes], dtype=np.float64),
        expert=number(sorted(set(experts)), experts),
        scenario=number(sorted(set(scenarios)), scenarios),
    )


def versus(first: str, second: str, wins: int, ties: int, losses: int) -> list[Comparison]:
    scores = [WIN] * wins + [TIE] * ties + [LOSS] * losses
    return [Comparison(first=first, second=second, score=score) for score in scores]


def simulated(
    elo: list[float],
    votes: int,
    seed: int,
    *,
    ties: float = 0.2,
    experts: int = 9,
    scenarios: int = 50,
) -> Comparisons:
    """Votes whose expected score is exactly logistic, ties included."""
    rng = np.random.default_rng(seed)
    truth = np.array(elo) / ELO_PER_LOGIT
    first = rng.integers(0, len(elo), votes)
    second = (first + rng.integers(1, len(elo), votes)) % len(elo)
    expected = 1.0 / (1.0 + np.exp(truth[second] - truth[first]))
    # A tie scores 1/2; the rest wins so often that the mean stays the expected score.
    tie = ties * np.minimum(1.0, 2.0 * np.minimum(expected, 1.0 - expected))
    drawn = rng.random(votes)
    score = np.where(
        drawn < expected - tie / 2, WIN, np.where(drawn < expected + tie / 2, TIE, LOSS)
    )
    return Comparisons(
        names=tuple(f"c{number}" for number in range(len(elo))),
        first=first,
        second=second,
        score=score,
        expert=rng.integers(0, experts, votes),
        scenario=rng.integers(0, scenarios, votes),
    )


def by_votes(votes: Comparisons, **rules: Any) -> Leaderboard:
    """The paper's mode, unless told otherwise."""
    return rate(votes, **{"unit": Unit.VOTE, "rounds": 1000, **rules})


def fit(votes: Comparisons) -> FloatArray:
    """What Bradley-Terry makes of the votes, in logits."""
    counts = count_pairs(votes)
    met = models.Meetings(len(votes.names), counts)
    return models.fit(met, counts.games[:, None], counts.scores[:, None])[:, 0]


def pulls_of(votes: Comparisons) -> Pulls:
    counts, strengths = count_pairs(votes), fit(votes)
    met = models.Meetings(len(votes.names), counts)
    return pulls_of_model(votes, met, counts.games, strengths)


def named(votes: list[Comparison], *names: str) -> Comparisons:
    """The votes as arrays; names default to all that occur."""
    seen = sorted({name for vote in votes for name in (vote.first, vote.second)})
    return as_arrays(names or tuple(seen), votes)
