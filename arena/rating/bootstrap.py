"""Resampled votes as counts: whom they determine, and percentile intervals of single votes.

What is drawn with replacement is the unit: votes, whole scenarios, whole experts, or both at
once (a vote counts as often as its expert times its scenario is drawn). Rounds of clusters only
show who is determined; intervals come from `random_effects` or `sandwich` then.

Between contestants who scored against each other through chains both ways the difference is
finite (Ford 1957). Where only one of two did, it grows without limit in the known direction;
where neither did, nothing is known. So a round rates those of its largest component among each
other and puts the others above it, below it or nowhere.

Notation: C contestants, R rows, P pairs, B rounds, which are the last axis.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

from arena.rating.chains import are_determined, chains_in_sets
from arena.rating.comparisons import (
    LEVEL,
    BoolArray,
    Comparisons,
    FloatArray,
    IntArray,
    PairCounts,
    tally,
)
from arena.rating.models import Meetings
from arena.rating.rules import Unit

_NUMBERS_AT_ONCE = 1_000_000
"""How many numbers a block of rounds may hold; more only costs memory."""
# How many truth values of (n, C, C) closures may be held at once.
_NUMBERS_OF_COMPONENTS = 4_000_000
_SHORT_SIGMAS, _TAIL_SIGMAS = 2.0, 7.5
"""How many standard deviations Poisson draws fall short of the votes, so that 2 in 100 rounds get
too many; and where their distributions end."""
_CELLS = 4096
"""Of the table of a distribution, a power of two."""
FEWEST_ROUNDS = 200
# Numbers that all test rounds together may touch before fewer than asked for are drawn.
_WORK = 6_000_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rounds:
    """Some rounds of resampled votes.

    Attributes:
        games: (P, B) comparisons of each pair.
        scores: (P, B) what `low` scored in them, a tie half.
        ties: (B,) ties of all pairs together.
    """

    games: FloatArray
    scores: FloatArray
    ties: FloatArray

    @classmethod
    def of_outcomes(cls, drawn: FloatArray) -> Self:
        """Return those in which low won, neither or high won so often: (3 P, B), overwritten."""
        # Views (P, B) of `drawn`: losses become games and wins the score of low, in place.
        wins, ties, losses = drawn.reshape(3, -1, drawn.shape[1])
        of_all = ties.sum(axis=0)
        losses += wins
        losses += ties
        ties *= 0.5
        wins += ties
        return cls(games=losses, scores=wins, ties=of_all)

    def select(self, rounds: IntArray) -> Self:
        """Some of the rounds, by their numbers."""
        if len(rounds) == len(self.ties):
            return self
        return replace(
            self,
            games=self.games[:, rounds],
            scores=self.scores[:, rounds],
            ties=self.ties[rounds],
        )


def resample(
    votes: Comparisons, counts: PairCounts, *, unit: Unit, rounds: int, seed: int
) -> Iterator[Rounds]:
    """Blocks of rounds, `rounds` in all.

    Args:
        votes: What was voted.
        counts: The same, by pair.
        unit: What is drawn; what it does not name counts once.
        rounds: How many.
        seed: The same seed gives the same rounds.
    """
    if unit is Unit.VOTE:  # votes of one pair and outcome are alike: draw counts of them
        # (3 P,): all pairs' wins of low, then their ties, then their losses.
        seen = counts.outcomes.T.ravel()
        draw_votes = _vote_draws(seen, np.random.default_rng(seed))
        yield from (Rounds.of_outcomes(draw_votes(size)) for size in _blocks(rounds, len(seen)))
        return
    pairs = len(counts.low)
    # (R,) in the order that `of_outcomes` reads: wins of low by pair, then ties, then losses.
    place = counts.outcome_of * pairs + counts.pair_of
    # Sorted by place, the rows of one count are one run, and reduceat adds each run at once.
    order = np.argsort(place, kind="stable")
    outcomes, starts = np.unique(place[order], return_index=True)
    clusters = [(draw, of_row[order]) for draw, of_row in _cluster_draws(votes, unit, seed)]
    for size in _blocks(rounds, len(votes)):
        # (R, B): votes of the row, times how often its expert and its scenario are drawn.
        weight = np.repeat(votes.count[order, None].astype(np.float64), size, axis=1)
        for draw, of_row in clusters:
            weight *= draw(size)[of_row]
        drawn = np.zeros((3 * pairs, size))
        drawn[outcomes] = np.add.reduceat(weight, starts, axis=0)
        yield Rounds.of_outcomes(drawn)


def rounds_to_draw(votes: Comparisons, counts: PairCounts, rounds: int) -> int:
    """Return the number of rounds that test who is determined: 200 at least, fewer if slow."""
    each = max(len(votes) + 3 * len(counts.low), len(votes.names) ** 2, 1)
    return min(rounds, max(FEWEST_ROUNDS, _WORK // each))


def _blocks(rounds: int, width: int) -> Iterator[int]:
    size = max(1, _NUMBERS_AT_ONCE // max(width, 1))
    for start in range(0, rounds, size):
        yield min(size, rounds - start)


def _vote_draws(seen: IntArray, rng: np.random.Generator) -> Callable[[int], FloatArray]:
    """Return a function that draws multinomial counts (K, B) of kinds of votes seen (K,) times.

    Independent Poisson counts, given their sum, are multinomial. So a round takes Poisson counts
    for slightly fewer votes than there are, and draws the missing ones singly; one with too many
    is drawn again, for how many came the first way says nothing about which. A Poisson count is
    one lookup in a table of even cells; where a cell holds several, a second number decides.
    """
    total = int(seen.sum())
    # Kinds that were seen equally often share one of D distributions: (D,), and (K,) which.
    different, row = np.unique(seen, return_inverse=True)
    # The sum of all counts has the deviation sqrt(total): the means fall short by two of them.
    means = different * (1.0 - min(1.0, _SHORT_SIGMAS / np.sqrt(total)))
    spread = _TAIL_SIGMAS * np.sqrt(means) + 20.0
    lowest = np.maximum(means - spread, 0.0).astype(np.int64)
    sizes = (means + spread).astype(np.int64) - lowest
    ends = np.cumsum(sizes)
    # The counts of all D distributions one after the other, from `lowest` of each on.
    values = np.arange(ends[-1]) + np.repeat(lowest - ends + sizes, sizes)
    mean = np.repeat(np.maximum(means, 1e-300), sizes)
    # m^k e^-m / k! by logarithms, as k! and m^k overflow.
    chances = np.exp(values * np.log(mean) - mean - gammaln(values + 1.0))
    # All distributions are one: that of row d goes from d to d + 1.
    below = np.cumsum(chances / np.repeat(np.add.reduceat(chances, ends - sizes), sizes))
    end = np.repeat(np.arange(1.0, len(ends) + 1.0), sizes)
    below = np.clip(below, end - 1.0, end)  # sums are rounded
    below[ends - 1] = end[ends - 1]
    # Cells wholly within one value's interval hold that value and need no search.
    last_cell = np.ceil(below * _CELLS).astype(np.int64)
    value_of_cell = np.repeat(values.astype(np.float64), np.diff(last_cell, prepend=0))
    value_of_cell[last_cell - 1] = -1.0  # where one value ends and the next may begin
    row *= _CELLS
    # (votes,) the kind of each single vote, for those that are drawn singly.
    kind_of = np.repeat(np.arange(len(seen)), seen)

    def draw_poisson(rounds: int) -> FloatArray:
        size = len(row) * rounds  # 16 bits of chance each, four to a number
        bits = rng.bit_generator.random_raw(size // 4 + 1).view(np.uint16)[:size]
        # (K, B): the low bits are an even cell, as _CELLS is a power of two.
        cell = row[:, None] + (bits.reshape(-1, rounds) & (_CELLS - 1))
        drawn = value_of_cell.take(cell)
        is_open = np.flatnonzero(drawn < 0.0)
        # Even within the cell as well: the whole is uniform from d to d + 1.
        exact = (cell.ravel()[is_open] + rng.random(len(is_open))) / _CELLS
        drawn.ravel()[is_open] = values[np.searchsorted(below, exact, side="right")]
        return drawn

    def draw(rounds: int) -> FloatArray:
        drawn = draw_poisson(rounds)
        while len(over := np.flatnonzero((missing := total - drawn.sum(axis=0)) < 0)):
            drawn[:, over] = draw_poisson(len(over))
        missing = missing.astype(np.int64)
        singly = kind_of[rng.integers(0, total, size=missing.sum())]
        # Flat places of (K, B); `add.at`, because one may be drawn several times in a round.
        place = singly * rounds + np.repeat(np.arange(rounds), missing)
        np.add.at(drawn.reshape(-1), place, 1.0)
        return drawn

    return draw


def _cluster_draws(
    votes: Comparisons, unit: Unit, seed: int
) -> Sequence[tuple[Callable[[int], NDArray[np.float32]], IntArray]]:
    """For each kind of cluster what draws further rounds of it, and (R,) which one a row is in."""
    # A stream of its own for each kind: experts are drawn alike with and without scenarios.
    children = dict(zip(Unit.TWO_WAY.kinds, np.random.SeedSequence(seed).spawn(2), strict=True))
    draws = []
    for kind in unit.kinds:
        codes, of_row = np.unique(getattr(votes, kind), return_inverse=True)
        rng = np.random.default_rng(children[kind])
        draws.append((partial(_draw_clusters, rng, len(codes)), of_row))
    return draws


def _draw_clusters(rng: np.random.Generator, clusters: int, rounds: int) -> NDArray[np.float32]:
    """(G, B) how often each cluster is drawn."""
    # Flat places cluster * B + round; round by round, so that no size of blocks changes them.
    place = rng.integers(0, clusters, size=(rounds, clusters)).T * rounds
    place += np.arange(rounds)
    drawn = np.bincount(place.ravel(), minlength=clusters * rounds)
    return drawn.reshape(clusters, rounds).astype(np.float32)


# --- Ratings of rounds ---------------------------------------------------------------------------


MOST_DEGENERATE = (1.0 - LEVEL) / 2.0
"""The largest share of rounds without somebody that still leaves both percentiles to read."""

SideArray = NDArray[np.int8]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RatedRounds:
    """Ratings of rounds, some of which leave differences without a limit.

    Attributes:
        values: (C, B) ratings; only those of one component can be compared, NaN is unknown.
        in_main: (C, B) who is in the round's largest component; nobody where all are single.
        side: (C, B) 1 above that component, -1 below it, 0 unknown or in it.
        side_of_all: (C, B) 1 where somebody is at least level with everybody and above some,
            -1 for the opposite, else 0.
    """

    values: FloatArray
    in_main: BoolArray
    side: SideArray
    side_of_all: SideArray

    @classmethod
    def of_values(cls, values: FloatArray) -> Self:
        """Return rounds that determine everybody, or nobody where the values are NaN."""
        sides = np.zeros(values.shape, dtype=np.int8)
        return cls(values=values, in_main=~np.isnan(values), side=sides, side_of_all=sides)

    @property
    def degenerate(self) -> int:
        """Number of rounds that do not determine everybody."""
        return int((~self.in_main).any(axis=0).sum())


Refit = Callable[[Rounds, BoolArray | None], FloatArray]
"""(C, B) ratings of rounds, within the components (B, C, C) of each where not all are in one."""


def rate_rounds(
    votes: Comparisons, counts: PairCounts, blocks: Iterator[Rounds], refit: Refit
) -> RatedRounds:
    """Rate every round; those that do not determine everybody, component by component.

    Args:
        votes: What was voted.
        counts: The same, by pair.
        blocks: The rounds.
        refit: Rates them.
    """
    size = len(votes.names)
    by_votes = np.argsort(-tally(votes).sum(axis=1), kind="stable")
    met = Meetings(size, counts)
    rated: list[RatedRounds] = []
    for block in blocks:
        is_fine = are_determined(met, block.games, block.scores)
        rated.append(RatedRounds.of_values(refit(block.select(np.flatnonzero(is_fine)), None)))
        left = np.flatnonzero(~is_fine)
        at_once = max(1, _NUMBERS_OF_COMPONENTS // size**2)
        for first in range(0, len(left), at_once):
            rounds = block.select(left[first : first + at_once])
            reached = chains_in_sets(met, rounds.games, rounds.scores)
            together = reached & reached.transpose(0, 2, 1)
            # (P, n): only comparisons within a component have a finite fit (Ford 1957).
            inside = together[:, counts.low, counts.high].T
            inner = replace(rounds, games=rounds.games * inside, scores=rounds.scores * inside)
            rated.append(_place_components(reached, refit(inner, together), by_votes))
    columns = [field.name for field in fields(RatedRounds)]
    return RatedRounds(
        **{name: np.hstack([getattr(some, name) for some in rated]) for name in columns}
    )


def _place_components(reached: BoolArray, values: FloatArray, by_votes: IntArray) -> RatedRounds:
    """Say who is above and below whom in rounds that do not determine everybody.

    Args:
        reached: (N, C, C) whether the row's contestant scored against the column's through a
            chain.
        values: (C, N) ratings fitted within the components; NaN where there are none.
        by_votes: (C,) contestants, most votes first; of components of one size the one with
            whoever has the most votes is the main one.
    """
    # (N, C, C) who are in one component; its row sums (N, C) are the components' sizes.
    mutual = reached & reached.transpose(0, 2, 1)
    size = mutual.sum(axis=2)
    # (N,) somebody of the largest component: argmax takes the first of equals, by votes.
    leader = by_votes[np.argmax(size[:, by_votes], axis=1)]
    every = np.arange(len(reached))
    in_main = mutual[every, leader] & (size[every, leader] > 1)[:, None] & ~np.isnan(values.T)
    # (N, C) who scored against the leader through a chain, and whom the leader scored against.
    above, below = reached[every, :, leader], reached[every, leader, :]
    side = np.where(in_main, 0, above.astype(np.int8) - below.astype(np.int8))
    side[~in_main.any(axis=1)] = 0
    over_all, under_all = reached.all(axis=2), reached.all(axis=1)
    return RatedRounds(
        values=values,
        in_main=in_main.T,
        side=np.asarray(side.T, dtype=np.int8),
        side_of_all=np.asarray(1 * over_all - 1 * under_all, dtype=np.int8).T,
    )


def place_on_one_scale(rating: FloatArray, rounds: RatedRounds) -> tuple[FloatArray, BoolArray]:
    """Put all rounds on one scale: there the mean of the reference stays that of the data.

    Whoever is missing from the largest component in more than a 40th of the rounds is not part of
    the reference, so that a contestant with hardly any votes does not move the others.

    Returns:
        (C, B) points, plus or minus infinity where only the direction is known and NaN where
        nothing is; and (C,) the reference, everybody whom nearly every round determines.
    """
    missing = (~rounds.in_main).sum(axis=1)
    reference = missing <= MOST_DEGENERATE * rounds.values.shape[1]
    if reference.sum() < 2:
        reference = np.ones(len(rating), dtype=bool)
    # (C, B) those by whom a round is laid on the data: one shift a round, by their mean gap.
    joined = rounds.in_main & reference[:, None]
    number = joined.sum(axis=0)
    gap = np.where(joined, rating[:, None] - rounds.values, 0.0).sum(axis=0)
    # Rounds of everybody are on one scale already: what online Elo makes of all has no fixed mean.
    shift = np.where(joined.all(axis=0), 0.0, gap / np.maximum(number, 1))
    side = np.where(number > 1, rounds.side, rounds.side_of_all)
    values = np.where(rounds.in_main & (number > 1), rounds.values + shift, np.nan)
    values[side > 0], values[side < 0] = np.inf, -np.inf
    return values, reference


def percentile_interval(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The 95 % percentile interval (C,), (C,) of values (C, B); a bound that is open is NaN.

    Unknown values count as the worst on each side: a bound is finite only if it is whatever they
    were.
    """
    tail = (1.0 - LEVEL) / 2.0
    unknown = np.isnan(values)
    lower = _quantile(np.where(unknown, -np.inf, values), tail)
    upper = _quantile(np.where(unknown, np.inf, values), 1.0 - tail)
    return lower, upper


def _quantile(values: FloatArray, share: float) -> FloatArray:
    """(C,) as numpy interpolates it; NaN where one of the two neighbours is infinite."""
    place = (values.shape[1] - 1) * share
    first, last = int(np.floor(place)), int(np.ceil(place))
    # Only the two neighbours of the quantile must be in their places: no full sort.
    ordered = np.partition(values, [first, last], axis=1)
    low, high = ordered[:, first], ordered[:, last]
    finite = np.isfinite(low) & np.isfinite(high)
    with np.errstate(invalid="ignore"):
        return np.where(finite, low + (high - low) * (place - first), np.nan)
