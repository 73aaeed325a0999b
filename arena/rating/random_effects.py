"""Quantiles of studentised ratings by a bootstrap with random effects; docs/rating.md derives it.

Resamples of experts times scenarios vary by V(experts) + V(scenarios) + V(cells), where the truth
has a minus: no percentiles of them can hold. Here a round is drawn from what the closed form
finds. Each expert and each scenario gets a normal effect about each contestant, with the moderated
variance of such effects; it acts through the information of the votes of each cell (one expert on
one scenario). What cells pull in the data comes on top with random signs. One Newton step gives
the ratings of the round, and the pulls that are left give their moderated two-way standard errors
as those of the data do. The interval is rating +- quantile * standard error, the quantile that of
95 % of the rounds' |rating| / error.

Notation: C contestants, E and S clusters of the first and second kind, B rounds of a block.
Ratings and effects in points, ratings of rounds around 0; (E, S, C, B) may be flat.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from arena.rating.comparisons import LEVEL, BoolArray, Comparisons, FloatArray, t_quantile
from arena.rating.models import ELO_PER_LOGIT
from arena.rating.rules import Unit
from arena.rating.sandwich import (
    LEAST,
    MOST_PRIOR,
    ClusterShares,
    Pulls,
    Spread,
    estimate_spread,
    number_clusters,
)

SingleArray = NDArray[np.float32]

_MOST_NUMBERS = 20_000
"""Cells times contestants of a round; of more, clusters are dealt into groups."""
_FEWEST_GROUPS = 10
_NUMBERS_AT_ONCE = 300_000
"""Cells times contestants times rounds of a block: for memory and caches alone."""


def find_quantiles(
    pulls: Pulls, spread: Spread, unit: Unit, reference: BoolArray, *, rounds: int, seed: int
) -> FloatArray:
    """(C,) by what standard errors are multiplied for 95 % intervals.

    Args:
        pulls: What each row pulls at its contestants.
        spread: Of the ratings by these pulls.
        unit: The clusters of votes, of which there are two of one kind at least.
        reference: (C,) those whose mean is fixed.
        rounds: How many are drawn.
        seed: Of the draws.
    """
    votes = _deal_clusters(pulls.votes, unit)
    degrees = spread.degrees
    if votes is not pulls.votes:
        pulls = replace(pulls, votes=votes)
        degrees = estimate_spread(pulls, unit, reference).degrees
    cells = _Cells.of_pulls(pulls.relative_to(reference), unit, reference)
    rng = np.random.default_rng(seed)
    at_once = max(1, _NUMBERS_AT_ONCE // cells.influence.size)
    drawn = np.hstack(
        [cells.draw(rng, min(at_once, rounds - first)) for first in range(0, rounds, at_once)]
    )
    # The data count as one more round.
    place = min(int(np.ceil(LEVEL * (rounds + 1))), rounds) - 1
    quantiles = np.partition(drawn, place, axis=1)[:, place]
    # Squares of groups' sums have the mean of those of clusters, with fewer degrees of freedom.
    return np.asarray(quantiles * t_quantile(spread.degrees) / t_quantile(degrees))


def _deal_clusters(votes: Comparisons, unit: Unit) -> Comparisons:
    """Return votes whose clusters are so few, be it groups of them, that a round stays small."""
    sizes = [clusters for clusters, _ in number_clusters(votes, unit)]
    cells = max(_MOST_NUMBERS // len(votes.names), _FEWEST_GROUPS**2)
    even = int(np.sqrt(cells))
    most = max(even, cells // min(even, *sizes)) if len(sizes) > 1 else even
    for kind in unit.kinds:
        codes, of_row = np.unique(getattr(votes, kind), return_inverse=True)
        if len(codes) > most:
            # The largest ones go to different groups.
            order = np.argsort(-np.bincount(of_row, weights=votes.count), kind="stable")
            group = np.empty(len(codes), dtype=np.int64)
            group[order] = np.arange(len(codes)) % most
            changed: dict[str, Any] = {kind: group[of_row]}
            votes = replace(votes, **changed)
    return votes


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Cells:
    """What the data say of cells, for rounds.

    Attributes:
        influence: (E, S, C) by what each cell's pulls move each rating.
        own: (E * S * C, E * S * C) sparse, a block a cell: the information of its votes.
        joint: (E * S * C, C) the same blocks below each other.
        back: (C, C) from slopes to ratings.
        shares: Of contestants' information, for each kind of clusters.
        effect_sds: (C, 1) standard deviations of effects, likewise.
        base: (C, 1) the variance by independent cells, or votes.
    """

    influence: SingleArray
    own: Any
    joint: Any
    back: SingleArray
    shares: Sequence[ClusterShares]
    effect_sds: Sequence[SingleArray]
    base: FloatArray

    @classmethod
    def of_pulls(cls, pulls: Pulls, unit: Unit, reference: BoolArray) -> Self:
        """Return those of pulls around the mean of a reference (C,)."""
        from scipy.sparse import csr_array  # slow to load

        votes, size = pulls.votes, len(pulls.votes.names)
        kinds = number_clusters(votes, unit)
        rows = np.arange(len(votes))
        by_row = pulls.by_row()
        # Votes that are clustered one way only are independent within: any cells will do.
        dealt = (_FEWEST_GROUPS, rows % _FEWEST_GROUPS)
        (first, of_first), (second, of_second) = (*kinds, dealt)[:2]
        number, cell_of = first * second, of_first * second + of_second
        is_crossed = len(kinds) > 1
        base = (pulls.by_cluster(cell_of, number) if is_crossed else by_row).diagonal()[:, None]
        shares, effect_sds = [], []
        for clusters, of_row in kinds:
            of_kind = ClusterShares.of_pulls(pulls, clusters, of_row, by_row.diagonal(), reference)
            raw = pulls.by_cluster(of_row, clusters).diagonal()[:, None]
            shares.append(of_kind)
            effect_sds.append(_estimate_effects(of_kind, raw, base))
        # n equal votes of a row pull n times what one does, independent ones sqrt(n) times.
        times = votes.count if is_crossed else np.sqrt(votes.count)
        members = csr_array((times, (cell_of, rows)), shape=(number, len(rows)))
        influence = (members @ pulls.slopes) @ (ELO_PER_LOGIT * pulls.back.T)
        # (E * S * C, C): w at both ends of a vote, -w between them.
        ends = np.concatenate([votes.first, votes.second])
        weight = np.tile((pulls.information * votes.count).astype(np.float32), 2)
        places = np.tile(cell_of, 2) * size + ends
        others = np.concatenate([votes.second, votes.first])
        joint = csr_array(
            (
                np.concatenate([weight, -weight]),
                (np.tile(places, 2), np.concatenate([ends, others])),
            ),
            shape=(number * size, size),
        )
        begins = np.repeat(np.arange(number * size) // size * size, np.diff(joint.indptr))
        blocks = (joint.data, joint.indices + begins, joint.indptr)
        return cls(
            influence=influence.astype(np.float32).reshape(first, second, size),
            own=csr_array(blocks, shape=(number * size, number * size)),
            joint=joint,
            back=pulls.back[:, :size].astype(np.float32),
            shares=shares,
            effect_sds=effect_sds,
            base=base,
        )

    def draw(self, rng: np.random.Generator, rounds: int) -> FloatArray:
        """(C, B) sizes of studentised ratings of rounds."""
        first, second, size = self.influence.shape
        # (E, S, C, B), flat: the effects of both kinds in each cell.
        effects = np.zeros((first, second, size, rounds), dtype=np.float32)
        for axis, (effect_sd, clusters) in enumerate(
            zip(self.effect_sds, (first, second), strict=False)
        ):
            drawn = rng.standard_normal((clusters, size, rounds), dtype=np.float32)
            effects += np.expand_dims(drawn * effect_sd, 1 - axis)
        pulled = self.own @ effects.reshape(-1, rounds)
        signs = rng.integers(0, 2, size=(first, second, 1, rounds), dtype=np.int8)
        moved = self.influence[..., None] * (2 * signs - 1).astype(np.float32)
        # One Newton step from the data's ratings: (C, B).
        pull = pulled.reshape(-1, size, rounds).sum(axis=0)
        ratings = moved.sum(axis=(0, 1)) + self.back @ pull
        # What the fit leaves of each cell's pulls, and by what that moves each rating.
        pulled -= self.joint @ ratings
        moved += np.matmul(self.back, pulled.reshape(first, second, size, rounds))
        base = self.base
        if len(self.shares) > 1:
            base = np.einsum("escb,escb->cb", moved, moved).astype(np.float64)
        variance = -(len(self.shares) - 1) * base
        for axis, of_kind in enumerate(self.shares):
            of_clusters = moved.sum(axis=1 - axis)
            raw = np.einsum("gcb,gcb->cb", of_clusters, of_clusters).astype(np.float64)
            common = base + of_kind.estimate_effect(raw, base) * of_kind.effects
            common = np.maximum(common, LEAST * base)
            share, mine, _, _ = of_kind.moderate(raw, base, common)
            variance = variance + mine * raw + (1.0 - share) * common
        least = np.maximum(LEAST * base, 1e-30)
        return np.asarray(np.abs(ratings) / np.sqrt(np.maximum(variance, least)))


def _estimate_effects(shares: ClusterShares, raw: FloatArray, base: FloatArray) -> SingleArray:
    """(C, 1) standard deviations of the effects of clusters whose squares are (C, 1)."""
    common = np.maximum(shares.estimate_effect(raw, base), 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        own = np.where(shares.room > 1e-9, shares.surplus(raw, base) / shares.room, 0.0)
    # Drawn towards what all have in common, as the squares are.
    degrees = shares.left_of_effects / shares.uneven
    share = degrees / (MOST_PRIOR + degrees)
    variance = (1.0 - share) * common + share * np.maximum(own, 0.0)
    return np.sqrt(variance).astype(np.float32)
