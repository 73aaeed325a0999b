"""How much a table hangs on single experts and votes, and whether one number a contestant fits.

Notation: C contestants, P pairs that met, E experts, V votes, B rounds. Strengths are natural
logarithms of odds; "first" is the contestant with the highest rating.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.special import expit

from arena.rating.chains import are_determined
from arena.rating.comparisons import Comparisons, FloatArray, IntArray, PairCounts, count_pairs
from arena.rating.models import Meetings, fit, inverse_curvature

MOST_RIVALS = 12
"""So many of the next contestants are tried as the new first one."""

_EQUAL = 1e-9
_AT_ONCE = 48


def without_each_expert(votes: Comparisons, start: FloatArray) -> FloatArray:
    """(E, C) strengths by the votes of all experts but one; not a number where undetermined.

    Args:
        votes: Of everybody, experts numbered from 0 without gaps.
        start: (C,) strengths by all votes, to begin at.
    """
    counts = count_pairs(votes)
    experts = int(votes.expert.max(initial=-1)) + 1
    shape = (experts, len(counts.low))
    place = votes.expert * shape[1] + counts.pair_of
    games = np.bincount(place, minlength=shape[0] * shape[1]).reshape(shape)
    score = 1.0 - 0.5 * counts.outcome_of
    scores = np.bincount(place, weights=score, minlength=shape[0] * shape[1]).reshape(shape)
    return _fits(counts, counts.games - games, counts.scores - scores, start)


def rank_changes(strengths: FloatArray, without: FloatArray) -> list[int | None]:
    """By expert the largest change of a place in the order when their votes are left out.

    Args:
        strengths: (C,) by all votes.
        without: (E, C) by all votes but one expert's; None comes of rows that are not numbers.
    """
    changes = np.abs(_places(without) - _places(strengths[None])).max(axis=1, initial=0)
    unknown = set(np.flatnonzero(np.isnan(without).any(axis=1)).tolist())
    return [None if expert in unknown else int(change) for expert, change in enumerate(changes)]


def _places(strengths: FloatArray) -> IntArray:
    """(n, C) places in the order of strengths, 0 the highest."""
    return np.asarray(np.argsort(np.argsort(-strengths, axis=1, kind="stable"), axis=1))


def _fits(
    counts: PairCounts, games: FloatArray, scores: FloatArray, start: FloatArray
) -> FloatArray:
    """(n, C) strengths of each row of counts (n, P), not a number where it determines none."""
    met = Meetings(len(start), counts)
    fine = are_determined(met, games.T, scores.T)
    strengths = np.full((len(games), len(start)), np.nan)
    strengths[fine] = fit(met, games[fine].T, scores[fine].T, start=start).T
    return strengths


# --- Single votes --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Removal:
    """The fewest votes whose removal puts somebody else first.

    Attributes:
        votes: How many.
        exact: Whether fewer are proved not to do; else it is an upper bound, found by removing
            the votes with the greatest influence.
        rival: Who comes first then, as an index.
    """

    votes: int
    exact: bool
    rival: int


def fewest_votes_to_change_first(votes: Comparisons, strengths: FloatArray) -> Removal | None:
    """The fewest votes whose removal gives another contestant the highest rating.

    Votes of one pair and outcome are alike, so what is searched are counts of such kinds. Every
    single vote is tried; beyond that kinds are removed in the order of their first-order
    influence on the difference to each rival, and the smallest number that does it is an upper
    bound. With two contestants that is exact.

    Args:
        votes: They must determine the ratings.
        strengths: (C,) by all of them.

    Returns:
        None if the two highest are equal already, or no number of votes found does it.
    """
    order = np.argsort(-strengths, kind="stable").tolist()
    if len(order) < 2 or strengths[order[0]] - strengths[order[1]] < _EQUAL:
        return None
    counts = count_pairs(votes)
    leader = order[0]
    singles = np.eye(counts.outcomes.size)[np.flatnonzero(counts.outcomes.ravel())]
    best = _first_that_does(counts, strengths, leader, singles)
    if best is not None:
        return Removal(votes=1, exact=True, rival=best[1])
    found = [
        enough
        for rival in order[1 : MOST_RIVALS + 1]
        if (enough := _remove_by_influence(counts, strengths, leader, rival)) is not None
    ]
    if not found:
        return None
    number, rival = min(found)
    return Removal(votes=number, exact=number == 2 or len(order) == 2, rival=rival)


def _remove_by_influence(
    counts: PairCounts, strengths: FloatArray, leader: int, rival: int
) -> tuple[int, int] | None:
    """How many votes for the leader have to go, and who is first then; None if none do it."""
    sequence = _by_influence(counts, strengths, leader, rival)
    low, high = 0, len(sequence)
    first = None
    while high - low > (0 if first is None else 1):
        numbers = np.unique(np.linspace(low + 1, high, min(_AT_ONCE, high - low)).astype(int))
        size = counts.outcomes.size
        taken = np.stack([np.bincount(sequence[:number], minlength=size) for number in numbers])
        found = _first_that_does(counts, strengths, leader, taken.astype(np.float64))
        if found is None:
            return None
        place, first = found
        low, high = (int(numbers[place - 1]) if place else low), int(numbers[place])
    return None if first is None else (high, first)


def _by_influence(counts: PairCounts, strengths: FloatArray, leader: int, rival: int) -> IntArray:
    """(n,) kinds of votes, one entry a vote, those first that hold the leader up the most."""
    met = Meetings(len(strengths), counts)
    inverse = inverse_curvature(met, counts.games, strengths)
    lift = inverse[leader] - inverse[rival]
    expected = expit(strengths[counts.low] - strengths[counts.high])
    surprise = np.array([1.0, 0.5, 0.0])[None, :] - expected[:, None]
    held = ((lift[counts.low] - lift[counts.high])[:, None] * surprise).ravel()
    order = np.argsort(-held, kind="stable")
    order = order[held[order] > 0.0]
    return np.asarray(np.repeat(order, counts.outcomes.ravel()[order]))


def _first_that_does(
    counts: PairCounts, strengths: FloatArray, leader: int, taken: FloatArray
) -> tuple[int, int] | None:
    """(row, who is first then) of the first row of `taken` (n, 3P) that ends the lead."""
    kept = (counts.outcomes.ravel()[None] - taken).reshape(len(taken), -1, 3)
    fitted = _fits(counts, kept.sum(axis=2), kept[:, :, 0] + 0.5 * kept[:, :, 1], strengths)
    others = np.where(np.arange(len(strengths)) == leader, -np.inf, fitted)
    with np.errstate(invalid="ignore"):
        ended = others.max(axis=1, initial=-np.inf) - fitted[:, leader] > _EQUAL
    rows = np.flatnonzero(ended)
    return (int(rows[0]), int(np.argmax(others[rows[0]]))) if len(rows) else None


# --- Whether one number a contestant is enough ---------------------------------------------------


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

    Pearson's X2 compares the score of every pair with what the ratings foresee. Its distribution
    is simulated from the fitted ratings, for independent votes: where experts or scenarios
    differ, votes are not independent, and a small p-value may come from that.

    Args:
        votes: They must determine the ratings.
        strengths: (C,) by them.
        rounds: Of the parametric bootstrap; each is fitted anew.
        seed: Of its draws.
    """
    counts = count_pairs(votes)
    expected = expit(strengths[counts.low] - strengths[counts.high])
    # Pairs tie with probability 2 t min(p, 1 - p), which gives as many ties as were seen.
    room = float((counts.games * 2.0 * np.minimum(expected, 1.0 - expected)).sum())
    tie_share = min(float(counts.outcomes[:, 1].sum()) / room, 1.0)
    statistic = float(_pearson(counts, counts.scores[None], strengths[None], tie_share)[0])
    freedom = len(counts.low) - len(strengths) + 1
    cycles, triples = count_cycles(counts, len(strengths), counts.scores[None])
    seen_cycles = {"cycles": int(cycles[0]), "triples": int(triples[0])}
    if freedom <= 0:
        return FitTest(statistic=statistic, freedom=0, p_value=None, rounds=0, **seen_cycles)
    tie = 2.0 * tie_share * np.minimum(expected, 1.0 - expected)
    chances = np.stack([expected - tie / 2, tie, 1.0 - expected - tie / 2], axis=1)
    chances = np.clip(chances, 0.0, 1.0)
    chances /= chances.sum(axis=1, keepdims=True)
    games = counts.games.astype(np.int64)
    rng = np.random.default_rng(seed)
    outcomes = rng.multinomial(games, chances, size=(rounds, len(games)))
    drawn = outcomes[:, :, 0] + 0.5 * outcomes[:, :, 1]
    fitted = _fits(counts, np.broadcast_to(counts.games, drawn.shape), drawn, strengths)
    fine = ~np.isnan(fitted).any(axis=1)
    seen = _pearson(counts, drawn[fine], fitted[fine], tie_share)
    return FitTest(
        statistic=statistic,
        freedom=freedom,
        p_value=(1 + int((seen >= statistic).sum())) / (1 + len(seen)),
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


def _pearson(
    counts: PairCounts, scores: FloatArray, strengths: FloatArray, tie_share: float
) -> FloatArray:
    """(B,): squared surprise over its variance. A tie takes a quarter of its chance from it."""
    expected = expit(strengths[..., counts.low] - strengths[..., counts.high])
    tie = 2.0 * tie_share * np.minimum(expected, 1.0 - expected)
    variance = counts.games * (expected * (1.0 - expected) - tie / 4.0)
    surprise = scores - counts.games * expected
    return np.asarray((surprise**2 / np.maximum(variance, 1e-12)).sum(axis=1))
