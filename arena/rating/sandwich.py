"""Closed-form standard errors of ratings whose votes are clustered by expert and by scenario.

Every vote pulls at its two contestants by how much it surprises. The pulls of a cluster are added
up before they are squared, so that what its votes have in common counts (the sandwich,
H^-1 S H^-1); clustered two ways, the squares by expert and by scenario are added and those of the
cells, which are in both, taken off once (Cameron, Gelbach, Miller 2011).

With few experts such a square is a guess by few numbers, and Student's t makes it twice as wide as
need be. But contestants are many: by how much experts disagree about one says something about the
others. So each contestant's own square is drawn towards what all of them have in common, the less
the more they differ (moderated variances, Smyth 2004), and Student's t gets the degrees of freedom
of what it then rests on (Satterthwaite 1946). docs/rating.md has how often the truth is inside.

Squares of pulls after the fit are too small. Let w be the share of a contestant's information that
comes from each cluster, S2 the sum of w², S3 that of w³, t² the variance of the clusters' effects
and b the variance by single votes. The rating then errs by t² S2 + b, while the pulls r have

    E sum r² = t² S2 (1 - 2 S3/S2 + S2) + b (1 - S2),

so t² = (sum r² - b (1 - S2)) / (S2 - 2 S3 + S2²). The common t² is the mean over contestants,
weighted by 1/b²; where pairs are judged at once, it is at least 0.

Notation: R rows, C contestants, K parameters (C strengths, and what a model has besides), G
clusters. Strengths are logarithms of odds, covariances squared Elo points.
"""

from dataclasses import dataclass, fields, replace
from typing import Any, Self, TypeVar

import numpy as np

from arena.rating.comparisons import TIE, BoolArray, Comparisons, FloatArray, IntArray, t_quantile
from arena.rating.models import ELO_PER_LOGIT, Meetings, chances, inverse_curvature
from arena.rating.rules import Unit

MOST_PRIOR = 24.0
"""The others count at most like so many further clusters, however alike all contestants seem: one
whom experts disagree about more is then still seen."""

LEAST = 0.6
"""No variance is smaller than this share of what single cells would give."""

LEAST_LEFT = 0.5
"""The fit leaves at least this share of the effects of clusters, compared with single votes: one
expert with nearly all votes would make the estimate as large as chance likes."""

_FAR = 1e9
"""Degrees of freedom of what is as good as known."""


# --- What votes pull -----------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pulls:
    """The slope of each vote's likelihood at the fitted parameters, and the way back to ratings.

    Attributes:
        votes: Of contestants who all have votes.
        slopes: (R, K) sparse, of one vote of each row: what `first` scored above what was
            expected, the opposite for `second`, and the slopes by further parameters.
        information: (R,) how much a vote of the row says of the difference of the two.
        back: (C, K) from slopes to strengths.
    """

    votes: Comparisons
    slopes: Any
    information: FloatArray
    back: FloatArray

    def relative_to(self, reference: BoolArray) -> Self:
        """The same for ratings whose mean over a reference (C,) is fixed, not everybody's."""
        if reference.all():
            return self
        # Taking the reference's mean off is linear in the strengths: (C, K) less one row (K,).
        return replace(self, back=self.back - self.back[reference].mean(axis=0))

    def by_row(self) -> FloatArray:
        """(C, C) the sandwich of independent votes."""
        # n equal votes of a row are independent: their squares add up to n times that of one.
        return self._square(self.slopes * np.sqrt(self.votes.count)[:, None])

    def by_cluster(self, cluster_of: IntArray, clusters: int) -> FloatArray:
        """(C, C) the pulls of each of G clusters added up and squared."""
        from scipy.sparse import csr_array

        rows = np.arange(len(cluster_of))
        # (G, R) holding numbers of votes: times slopes (R, K) it sums the pulls by cluster.
        members = csr_array((self.votes.count, (cluster_of, rows)), shape=(clusters, len(rows)))
        return self._square(members @ self.slopes)

    def concentration(self, cluster_of: IntArray, clusters: int) -> tuple[FloatArray, FloatArray]:
        """(C,), (C,) sums of squared and of cubed shares of each contestant's information.

        The first goes from 1 / G for even clusters to 1 for a single one. Only clusters in which a
        contestant has votes count.
        """
        size = len(self.votes.names)
        # (2 R,): a row informs both its contestants, `first` and `second` alike.
        amount = np.tile(self.information * self.votes.count, 2)
        place = np.concatenate([self.votes.first, self.votes.second]) * clusters
        # Contestant and cluster as one number, contestant * G + cluster; only those that occur.
        met, where = np.unique(place + np.tile(cluster_of, 2), return_inverse=True)
        weights = np.bincount(where, weights=amount)
        total = np.bincount(met // clusters, weights=weights, minlength=size)
        # w of the module's notation: they add up to 1 over each contestant's clusters.
        shares = weights / total[met // clusters]
        squares, cubes = (
            np.bincount(met // clusters, weights=shares**power, minlength=size) for power in (2, 3)
        )
        # Rounding must not make 1 - S2 negative.
        return np.minimum(squares, 1.0), cubes.astype(np.float64)

    def _square(self, slopes: Any) -> FloatArray:
        """(C, C) of sums of slopes (G, K), sparse, in squared points."""
        # H^-1 S H^-1, from squared logits to squared points: S (K, K), `back` (C, K).
        squares = (slopes.T @ slopes).toarray()
        return np.asarray(ELO_PER_LOGIT**2 * self.back @ squares @ self.back.T)


def design_matrix(votes: Comparisons, weight: FloatArray, columns: FloatArray) -> Any:
    """(R, C + Q) sparse: a weight (R,) for the first, its opposite for the second, then columns.

    Args:
        votes: R rows on C contestants.
        weight: (R,).
        columns: (R, Q) further ones.
    """
    from scipy.sparse import csr_array, hstack  # slow to load

    # Two entries a row, at the columns of its two contestants: sparse, for up to 2,000 columns.
    rows = np.tile(np.arange(len(votes)), 2)
    places = (rows, np.concatenate([votes.first, votes.second]))
    values = np.concatenate([weight, -weight])
    ends = csr_array((values, places), shape=(len(votes), len(votes.names)))
    return csr_array(hstack([ends, csr_array(columns)])) if columns.size else ends


def pulls_of_model(
    votes: Comparisons, met: Meetings, games: FloatArray, answer: FloatArray
) -> Pulls:
    """Return the pulls of Bradley-Terry or Davidson's model at an answer (K,) of `models.fit`."""
    size = len(votes.names)
    expected, tied = chances(size, answer, votes.first, votes.second)
    surprise = votes.score - expected
    has_ties = len(answer) > size
    # (R, 1) the slope by log v, tied or not less its chance; (R, 0) in Bradley-Terry.
    by_ties = ((votes.score == TIE) - tied)[:, None] if has_ties else np.empty((len(votes), 0))
    return Pulls(
        votes=votes,
        slopes=design_matrix(votes, surprise, by_ties),
        # The variance of a score of 0, 1/2 or 1, for E[s^2] = expected - tied / 4.
        information=expected - 0.25 * tied - expected**2,
        back=inverse_curvature(met, games, answer)[:size],
    )


def without_negative_parts(matrix: FloatArray) -> FloatArray:
    """Few clusters can make a difference of sums negative in some direction: that is cut off."""
    # `eigh` reads one triangle alone: rounding may not make the two differ.
    matrix = 0.5 * (matrix + matrix.T)
    values, directions = np.linalg.eigh(matrix)
    if values[0] >= 0.0:
        return matrix
    return np.asarray((directions * np.maximum(values, 0.0)) @ directions.T)


# --- Moderated variances -------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Component:
    """Contribution of clusters of one kind to the covariance of the ratings.

    Attributes:
        covariance: (C, C) moderated.
        common: (C, C) what it would be if all contestants were disagreed about alike.
        own_share: (C,) the weight of a contestant's own square, 0 to 1.
        own_degrees: (C,) degrees of freedom of that square: effective clusters less one.
        degrees: (C,) those of the moderated one.
    """

    covariance: FloatArray
    common: FloatArray
    own_share: FloatArray
    own_degrees: FloatArray
    degrees: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Spread:
    """Standard errors and covariance of ratings.

    Attributes:
        covariance: (C, C) in squared points, around the mean of the reference.
        degrees: (C,) of Student's t for a rating.
        common: (C, C) the covariance if contestants were disagreed about alike, at least `base`.
        base: (C, C) that of independent cells, or votes.
        components: By kind of cluster; none for votes that count as independent.
        fewest: Clusters of the kind that has the fewest.
    """

    covariance: FloatArray
    degrees: FloatArray
    common: FloatArray
    base: FloatArray
    components: tuple[Component, ...]
    fewest: float = np.inf

    def among(self, members: IntArray) -> "Spread":
        """The same for some of the contestants alone."""
        components = tuple(_restrict(component, members) for component in self.components)
        return replace(_restrict(self, members), components=components)

    def half_widths(self) -> FloatArray:
        """(C,) of the 95 % intervals, in points."""
        return np.asarray(t_quantile(self.degrees) * np.sqrt(self.covariance.diagonal()))


_Arrays = TypeVar("_Arrays", Component, Spread)


def _restrict(value: _Arrays, members: IntArray) -> _Arrays:
    """Return the rows, and columns, of members in every array."""
    arrays: dict[str, Any] = {
        column.name: array[np.ix_(*[members] * array.ndim)]
        for column in fields(value)
        if isinstance(array := getattr(value, column.name), np.ndarray)
    }
    return replace(value, **arrays)


def estimate_spread(pulls: Pulls, unit: Unit, reference: BoolArray | None = None) -> Spread:
    """The spread of ratings by votes clustered as the unit says.

    Args:
        pulls: What each row pulls at its contestants.
        unit: The clusters of votes. Where all votes are of one expert, or on one scenario, that
            side says nothing and is left out.
        reference: (C,) those whose mean is fixed, by default everybody. Only they say what
            contestants have in common: who has hardly any votes widens nobody else's interval.
    """
    if reference is None:
        reference = np.ones(len(pulls.votes.names), dtype=np.bool_)
    pulls = pulls.relative_to(reference)
    kinds = number_clusters(pulls.votes, unit)
    base = pulls.by_row()
    single = base.diagonal()
    if len(kinds) > 1:
        # A cell is one expert on one scenario: votes of a cell are in both clusters.
        cells, cell_of = np.unique(kinds[0][1] * kinds[1][0] + kinds[1][1], return_inverse=True)
        base = pulls.by_cluster(cell_of, len(cells))
    components = tuple(
        _component(pulls, base, single, clusters, of_row, reference) for clusters, of_row in kinds
    )
    if not components:
        if unit is not Unit.VOTE:
            base = np.zeros_like(base)  # there is but one of what differs: nothing can be said
        degrees = np.full(len(base), _FAR)
        return Spread(covariance=base, degrees=degrees, common=base, base=base, components=())
    # V(experts) + V(scenarios) - V(cells) (Cameron, Gelbach, Miller 2011).
    covariance = np.asarray(sum(component.covariance for component in components))
    # What clusters add is never negative: equals drawn with less would be told apart too often.
    added = (part.common - base for part in components if part.common.trace() > base.trace())
    if len(components) > 1:
        covariance = covariance - base
    # Cutting off negative directions widens the diagonal, which is therefore set back.
    least = np.maximum(covariance.diagonal(), LEAST * base.diagonal())
    covariance = _with_variances(without_negative_parts(covariance), least)
    return Spread(
        covariance=covariance,
        degrees=satterthwaite(covariance.diagonal(), components),
        common=sum(added, base),
        base=base,
        components=components,
        fewest=min(clusters for clusters, _ in kinds),
    )


def satterthwaite(variance: FloatArray, components: tuple[Component, ...]) -> FloatArray:
    """(C,) degrees of freedom of variances (C,) that are sums of the components'."""
    # (sum of variances)^2 / sum of (variance^2 / degrees) (Satterthwaite 1946).
    of_parts = sum(
        component.covariance.diagonal() ** 2 / component.degrees for component in components
    )
    return np.asarray(variance**2 / np.maximum(of_parts, 1e-300))


def number_clusters(votes: Comparisons, unit: Unit) -> list[tuple[int, IntArray]]:
    """The number of clusters of each kind that the unit names, from two on, and (R,) whose."""
    kinds = [np.unique(getattr(votes, kind), return_inverse=True) for kind in unit.kinds]
    return [(len(codes), of_row) for codes, of_row in kinds if len(codes) > 1]


def remaining_share(uneven: FloatArray, cubes: FloatArray) -> FloatArray:
    """Return the share of the variance of cluster effects that the fit leaves in the pulls.

    Args:
        uneven: (C,) sums of squared shares of a contestant's information by cluster, at most 1.
        cubes: (C,) sums of cubed shares.
    """
    return np.maximum(1.0 - 2.0 * cubes / uneven + uneven, LEAST_LEFT * (1.0 - uneven))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClusterShares:
    """Distribution of contestants' information over clusters of one kind; arrays (C, 1).

    Attributes:
        uneven: S2.
        left_of_votes, left_of_effects: Shares of both variances that the fit leaves in the pulls.
        effects: Variances that effects of variance 1 give the ratings around the reference's mean.
        weight: Of contestants in what they have in common; 0 outside of the reference.
        reference: Whose mean is fixed.
    """

    uneven: FloatArray
    left_of_votes: FloatArray
    left_of_effects: FloatArray
    effects: FloatArray
    weight: FloatArray
    reference: BoolArray

    @classmethod
    def of_pulls(
        cls,
        pulls: Pulls,
        clusters: int,
        of_row: IntArray,
        single: FloatArray,
        reference: BoolArray,
    ) -> Self:
        """Return those of G clusters, R rows being in `of_row`; `single` (C,) by single votes."""
        uneven, cubes = pulls.concentration(of_row, clusters)
        # Single votes, as cells contain the effect: weights by these would prefer where it is
        # small.
        weight = np.where(reference, 1.0 / np.maximum(single, 1e-9) ** 2, 0.0)
        columns = {
            "uneven": uneven,
            "left_of_votes": 1.0 - uneven,
            "left_of_effects": remaining_share(uneven, cubes),
            "effects": _centre(uneven, reference).diagonal(),
            "weight": weight,
            "reference": reference,
        }
        return cls(**{name: column[:, None] for name, column in columns.items()})

    @property
    def room(self) -> FloatArray:
        """(C, 1) what effects of variance 1 add to the squares."""
        return self.effects * self.left_of_effects

    def surplus(self, raw: FloatArray, base: FloatArray) -> FloatArray:
        """(C, B) squares (C, B) beyond what cells (C, 1) or votes leave in them."""
        return raw - base * self.left_of_votes

    def estimate_effect(self, raw: FloatArray, base: FloatArray) -> FloatArray:
        """(B,) the variance of effects that all contestants have in common."""
        # t^2 = surplus / room: sum r^2 - b (1 - S2), over S2 (1 - 2 S3 / S2 + S2).
        surplus = (self.weight * self.surplus(raw, base)).sum(axis=0)
        # Chance makes this as often too small as too large: cut off at zero it would be too large.
        return np.asarray(surplus / np.maximum((self.weight * self.room).sum(axis=0), 1e-300))

    def moderate(
        self, raw: FloatArray, base: FloatArray, common: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Draw own squares (C, B) towards common ones (C, B) (Smyth 2004).

        Returns:
            (C, B) the weight of the own squares, and what raw ones are multiplied by for it; (C,
            B) degrees of freedom of own squares; (1, B) those of the prior.
        """
        # (C, B) the share of single votes in the common variance: what the fit left of both.
        of_votes = np.minimum(base / np.maximum(common, 1e-300), 1.0)
        left = of_votes * self.left_of_votes + (1.0 - of_votes) * self.left_of_effects
        # G even clusters have S2 = 1 / G and S3 = 1 / G^2, which makes this G - 1.
        degrees = left / self.uneven
        with np.errstate(invalid="ignore", divide="ignore"):
            own = np.where(left > 0.0, raw / left, 0.0)
        prior = _prior_degrees(own, common, degrees, self.reference)
        # Moderated: (d own + d0 common) / (d + d0), d0 the prior's degrees: the second is
        # share * own, without a division by `left`, which can be 0.
        return degrees / (prior + degrees), 1.0 / (prior * self.uneven + left), degrees, prior


def _component(
    pulls: Pulls,
    base: FloatArray,
    single: FloatArray,
    clusters: int,
    of_row: IntArray,
    reference: BoolArray,
) -> Component:
    """Return the contribution of clusters of one kind; docs/rating.md derives it.

    Args:
        pulls: What each row pulls at its contestants.
        base: (C, C) the sandwich of independent cells, or votes.
        single: (C,) variances by independent votes.
        clusters: G.
        of_row: (R,) the cluster of each row.
        reference: (C,) whose mean is fixed.
    """
    raw = pulls.by_cluster(of_row, clusters)
    shares = ClusterShares.of_pulls(pulls, clusters, of_row, single, reference)
    own, of_base = raw.diagonal()[:, None], base.diagonal()[:, None]
    effect = float(shares.estimate_effect(own, of_base)[0])
    # (C, C) of independent effects of variance S2 each, around the reference's mean.
    common = base + effect * _centre(shares.uneven[:, 0], reference)
    if effect < 0.0:
        common = without_negative_parts(common)
        least = np.maximum(common.diagonal(), LEAST * base.diagonal())
        common = _with_variances(common, least)
    share, mine, degrees, prior = (
        part[:, 0] for part in shares.moderate(own, of_base, common.diagonal()[:, None])
    )
    factor, others = np.sqrt(mine), np.sqrt(1.0 - share)
    # No moderated square rests on more than all squares together, less one contestant's.
    everybody = float(degrees[reference].sum()) * (1.0 - 1.0 / reference.sum())
    return Component(
        covariance=factor[:, None] * raw * factor + others[:, None] * common * others,
        common=common,
        own_share=share,
        own_degrees=degrees,
        degrees=np.maximum(np.minimum(prior + degrees, everybody), 1.0),
    )


def _prior_degrees(
    own: FloatArray, common: FloatArray, degrees: FloatArray, reference: BoolArray
) -> FloatArray:
    """(1, B) the prior's weight in clusters: few where contestants differ.

    The spread of own squares (C, B) around the common ones (C, B), less what chance alone gives
    with so many degrees of freedom (C, B), as moments of a scaled F distribution; the reference
    (C, 1) alone.
    """
    is_usable = reference & (degrees > 0.5) & (common > 0.0)
    weight = np.where(is_usable, degrees, 0.0)
    number, total = is_usable.sum(axis=0), np.maximum(weight.sum(axis=0), 1e-300)
    with np.errstate(invalid="ignore", divide="ignore"):
        # F with d and d0 degrees, scaled to the mean 1, has the variance
        # 2/d + (1 + 2/d) 2/(d0 - 4); this and the following lines solve it for d0.
        excess = np.where(is_usable, weight * ((own / common - 1.0) ** 2 - 2.0 / weight), 0.0)
        surplus = excess.sum(axis=0) / total / (1.0 + 2.0 * number / total)
        prior = np.minimum(MOST_PRIOR, 4.0 + 2.0 / surplus)
    return np.where((number < 3) | (surplus <= 0.0), MOST_PRIOR, prior)[None]


def _centre(values: FloatArray, reference: BoolArray) -> FloatArray:
    """(C, C) covariance of independent numbers with these variances (C,), around a mean."""
    number = reference.sum()
    of_mean = np.where(reference, values, 0.0)
    # cov(x_i - m, x_j - m) = [i = j] v_i - v_i/n - v_j/n + sum v/n^2, m the mean of n members.
    centred = np.diag(values) - (of_mean[:, None] + of_mean) / number
    return np.asarray(centred + of_mean.sum() / number**2)


def _with_variances(covariance: FloatArray, variances: FloatArray) -> FloatArray:
    """The covariance with these variances (C,) where they are positive.

    Many contestants have more directions than there are clusters. What is cut off in negative ones
    would widen everybody's interval, by a tenth among a thousand.
    """
    now = np.maximum(covariance.diagonal(), 1e-300)
    # D covariance D with a diagonal D: correlations stay as they are.
    change = np.sqrt(np.where(variances > 0.0, variances / now, 1.0))
    return np.asarray(change[:, None] * covariance * change)
