"""Multinomial counts for many rounds at once.

Votes of one kind are alike, so resampling votes is drawing how often each kind occurs. Two facts
make that fast and leave it exact. Independent Poisson counts, given their sum, are multinomial; so
a round takes Poisson counts for slightly fewer votes than there are and draws the missing ones
singly (a round that got too many is drawn again: how many votes came the first way says nothing
about which). And a Poisson number of known mean is one lookup in an alias table (Walker 1977).

Notation: K kinds of votes, B rounds, D different Poisson means, M columns of an alias table.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arena.rating.comparisons import FloatArray, IntArray

_SHORT_SIGMAS = 2.0
"""By how many standard deviations Poisson draws fall short: 2 in 100 rounds get too many."""

_TAIL_SIGMAS = 7.5
"""Where tables end; beyond lie less than 1e-12 of the draws."""

_LARGEST_TABLES = 4_000_000


class Multinomial:
    """Draws of as many votes as there are, each kind as likely as it was seen.

    Args:
        counts: (K,) how often each kind was seen, all above zero.
    """

    def __init__(self, counts: IntArray) -> None:
        self._counts = counts
        self._total = int(counts.sum())
        self._kind_of = np.repeat(np.arange(len(counts)), counts)
        fewer = min(1.0, _SHORT_SIGMAS / np.sqrt(self._total))
        different, which = np.unique(counts, return_inverse=True)
        self._tables = poisson_tables(different * (1.0 - fewer))
        self._which = which

    def draw(self, rng: np.random.Generator, rounds: int) -> FloatArray:
        """(K, B) how often each kind was drawn in each round, whole numbers."""
        if self._tables is None:
            shares = self._counts / self._total
            return rng.multinomial(self._total, shares, size=rounds).T.astype(np.float64)
        drawn = self._tables.draw(rng, self._which, rounds)
        missing = self._total - drawn.sum(axis=0).astype(np.int64)
        while (over := np.flatnonzero(missing < 0)).size:
            again = self._tables.draw(rng, self._which, len(over))
            drawn[:, over] = again
            missing[over] = self._total - again.sum(axis=0).astype(np.int64)
        singly = self._kind_of[rng.integers(0, self._total, size=int(missing.sum()))]
        place = singly * rounds + np.repeat(np.arange(rounds), missing)
        np.add.at(drawn.reshape(-1), place, 1.0)
        return drawn


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AliasTables:
    """One alias table for each of D distributions; M is a power of two.

    A column is drawn evenly; below its limit it stands for its own value, above for its alias.

    Attributes:
        limit: (D * M,) of 2^64, the lowest bits zero.
        value: (D * M * 2,) what a column gives above its limit, then below it.
        columns: M.
    """

    limit: NDArray[np.uint64]
    value: FloatArray
    columns: int

    def draw(self, rng: np.random.Generator, which: IntArray, rounds: int) -> FloatArray:
        """(K, B) draws from the distributions `which` (K,)."""
        bits = rng.integers(0, 2**64, size=(len(which), rounds), dtype=np.uint64)
        column = (bits & np.uint64(self.columns - 1)).view(np.int64)
        column += (which * self.columns)[:, None]
        below = bits < self.limit.take(column)
        column *= 2
        column += below
        return self.value.take(column)


def poisson_tables(means: FloatArray) -> AliasTables | None:
    """Tables for Poisson numbers of the means (D,), or None where they would be too large."""
    spread = _TAIL_SIGMAS * np.sqrt(means)
    first = np.floor(np.maximum(means - spread - 10.0, 0.0)).astype(np.int64)
    last = np.ceil(means + spread + 20.0).astype(np.int64)
    columns = 1 << int((last - first).max()).bit_length()
    if columns * len(means) > _LARGEST_TABLES or columns + last.max() > _LARGEST_TABLES:
        return None
    values = first[:, None] + np.arange(columns)
    log_factorial = np.concatenate([[0.0], np.cumsum(np.log(np.arange(1.0, values.max() + 1)))])
    rate = np.maximum(means, 1e-300)[:, None]  # a mean of zero gives zero
    chance = np.exp(values * np.log(rate) - rate - log_factorial[values])
    chance[values > last[:, None]] = 0.0
    chance /= chance.sum(axis=1, keepdims=True)
    return alias_tables(values.astype(np.float64), chance)


def alias_tables(values: FloatArray, chances: FloatArray) -> AliasTables:
    """Tables of distributions over `values` (D, M) with `chances` (D, M).

    Columns that have less than an even share are filled up, in order, from those that have more,
    in order; one that gave too much is filled up by the next. Who fills whom follows from the
    running sums of what is lacking and what is left over.
    """
    rows, columns = chances.shape
    share = chances * columns
    lacks = np.cumsum(np.maximum(1.0 - share, 0.0), axis=1)
    spare = np.cumsum(np.maximum(share - 1.0, 0.0), axis=1)
    limit, alias = share.copy(), np.tile(np.arange(columns), (rows, 1))
    for row in range(rows):
        light = np.flatnonzero(share[row] < 1.0)
        heavy = np.flatnonzero(share[row] > 1.0)
        if not len(heavy):
            continue
        lacking, left = lacks[row, light], spare[row, heavy]
        before = lacking - (1.0 - share[row, light])
        giver = np.searchsorted(left, before, side="right")
        alias[row, light] = heavy[np.minimum(giver, len(heavy) - 1)]
        # A heavy column ends where the lacking ones have taken more than it and all before had.
        ends = np.searchsorted(lacking, left)
        reached = ends < len(lacking)
        overdrawn = lacking[np.minimum(ends, len(lacking) - 1)] - left
        limit[row, heavy] = np.where(reached, 1.0 - overdrawn, 1.0)
        alias[row, heavy] = np.append(heavy[1:], heavy[-1])
    limit = np.clip(limit, 0.0, 1.0)
    full = limit >= 1.0
    alias[full] = np.broadcast_to(np.arange(columns), alias.shape)[full]
    value = np.stack([np.take_along_axis(values, alias, axis=1), values], axis=2)
    steps = 2.0**64 / columns
    whole = np.minimum(np.rint(limit * steps), steps - 1.0).astype(np.uint64)
    return AliasTables(
        limit=(whole * np.uint64(columns)).reshape(-1),
        value=value.reshape(-1),
        columns=columns,
    )
