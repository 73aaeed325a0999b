"""Whether one number a contestant is enough to say who wins against whom.

Pearson's X2 compares the score of every pair with what the ratings foresee. Its distribution is
simulated from the fitted ratings, for independent votes: where experts or scenarios differ, votes
are not independent, and a small p-value may come from that.

Notation: B rounds, C contestants, P pairs.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.special import expit

from arena.rating import bradley_terry
from arena.rating.chains import are_determined
from arena.rating.comparisons import Comparisons, FloatArray, PairCounts, count_pairs


@dataclass(frozen=True, slots=True, kw_only=True)
class FitTest:
    """Pearson's test of fit.

    Attributes:
        statistic: X2 over all pairs that met.
        freedom: Pairs minus contestants plus one; 0 leaves nothing to test.
        p_value: The share of simulated X2 that are as large, None without freedom.
        rounds: Simulated votings that determined ratings.
        cycles: Of three contestants of whom each beat the next: how many there are.
        triples: Of three contestants who all met without an even score.
        cycles_foreseen: The mean number of cycles in simulated votings, by chance alone.
    """

    statistic: float
    freedom: int
    p_value: float | None
    rounds: int
    cycles: int | None = field(default=None, metadata={"since": 3})
    triples: int | None = field(default=None, metadata={"since": 3})
    cycles_foreseen: float | None = field(default=None, metadata={"since": 3})

    @property
    def cyclic_share(self) -> float | None:
        """The share of triples that are cycles."""
        return self.cycles / self.triples if self.triples and self.cycles is not None else None


def fit_test(votes: Comparisons, strengths: FloatArray, *, rounds: int, seed: int) -> FitTest:
    """The test of fit of Bradley-Terry to the scores of the pairs.

    Args:
        votes: They must determine the ratings.
        strengths: (C,) by them.
        rounds: Of the parametric bootstrap; each is fitted anew.
        seed: Of its draws.
    """
    counts = count_pairs(votes)
    games, scores = counts.games, counts.scores
    tie_share = _tie_share(counts, strengths)
    statistic = float(_pearson(counts, games[None], scores[None], strengths[None], tie_share)[0])
    freedom = len(counts.low) - len(strengths) + 1
    cycles, triples = count_cycles(counts, len(strengths), scores[None])
    seen_cycles = {"cycles": int(cycles[0]), "triples": int(triples[0])}
    if freedom <= 0:
        return FitTest(statistic=statistic, freedom=0, p_value=None, rounds=0, **seen_cycles)
    drawn = _simulated(counts, strengths, tie_share, rounds, np.random.default_rng(seed))
    all_games = np.broadcast_to(games, drawn.shape)
    fine = are_determined(
        contestants=len(strengths),
        low=counts.low,
        high=counts.high,
        games=all_games.T,
        scores=drawn.T,
    )
    fitted = bradley_terry.fit(
        contestants=len(strengths),
        low=counts.low,
        high=counts.high,
        games=all_games[fine],
        scores=drawn[fine],
        start=strengths,
    )
    seen = _pearson(counts, all_games[fine], drawn[fine], fitted, tie_share)
    above = int((seen >= statistic).sum())
    return FitTest(
        statistic=statistic,
        freedom=freedom,
        p_value=(1 + above) / (1 + len(seen)),
        rounds=len(seen),
        cycles_foreseen=float(count_cycles(counts, len(strengths), drawn)[0].mean()),
        **seen_cycles,
    )


def count_cycles(
    counts: PairCounts, contestants: int, scores: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(B,), (B,): intransitive triples, and all triples in which no pair is even or missing.

    Args:
        counts: Who met, and how often.
        contestants: C.
        scores: (B, P) what `low` scored.
    """
    cycles, triples = np.zeros((2, len(scores)))
    half = 0.5 * counts.games
    for number, score in enumerate(scores):
        beats = np.zeros((contestants, contestants))
        beats[counts.low, counts.high] = score > half
        beats[counts.high, counts.low] = score < half
        decided = beats + beats.T
        cycles[number] = ((beats @ beats) * beats.T).sum() / 3.0
        triples[number] = ((decided @ decided) * decided).sum() / 6.0
    return np.rint(cycles), np.rint(triples)


# --- Private -----------------------------------------------------------------------------------


def _tie_share(counts: PairCounts, strengths: FloatArray) -> float:
    """t: pairs tie with probability 2 t min(p, 1 - p), which gives as many ties as were seen."""
    expected = expit(strengths[counts.low] - strengths[counts.high])
    room = float((counts.games * 2.0 * np.minimum(expected, 1.0 - expected)).sum())
    return min(float(counts.outcomes[:, 1].sum()) / room, 1.0)


def _chances(
    counts: PairCounts, strengths: FloatArray, tie_share: float
) -> tuple[FloatArray, FloatArray]:
    """(..., P) the expected score of `low`, and the chance of a tie."""
    expected = expit(strengths[..., counts.low] - strengths[..., counts.high])
    return expected, 2.0 * tie_share * np.minimum(expected, 1.0 - expected)


def _simulated(
    counts: PairCounts,
    strengths: FloatArray,
    tie_share: float,
    rounds: int,
    rng: np.random.Generator,
) -> FloatArray:
    """(B, P) what `low` scores in votings of the same size."""
    expected, tie = _chances(counts, strengths, tie_share)
    chances = np.stack([expected - tie / 2, tie, 1.0 - expected - tie / 2], axis=1)
    chances = np.clip(chances, 0.0, 1.0)
    chances /= chances.sum(axis=1, keepdims=True)
    games = counts.games.astype(np.int64)
    drawn = rng.multinomial(games, chances, size=(rounds, len(games)))
    return np.asarray(drawn[:, :, 0] + 0.5 * drawn[:, :, 1])


def _pearson(
    counts: PairCounts,
    games: FloatArray,
    scores: FloatArray,
    strengths: FloatArray,
    tie_share: float,
) -> FloatArray:
    """(B,): squared surprise over its variance. A tie takes a quarter of its chance from it."""
    expected, tie = _chances(counts, strengths, tie_share)
    variance = games * (expected * (1.0 - expected) - tie / 4.0)
    return np.asarray(((scores - games * expected) ** 2 / np.maximum(variance, 1e-12)).sum(axis=1))
