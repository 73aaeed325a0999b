"""How sure ratings are when votes hang together by expert and by scenario, in closed form.

Every vote pulls at its two contestants by how much it surprises. The pulls of a cluster are added
up before they are squared, so that what its votes have in common counts (the sandwich); clustered
two ways, the squares by expert and by scenario are added and those of the cells, which are in
both, taken off once (Cameron, Gelbach, Miller 2011).

With few experts such a square is a guess by few numbers, and Student's t makes it twice as wide as
need be. But contestants are many: by how much experts disagree about one says something about the
others. So each contestant's own square is drawn towards what all of them have in common, the less
the more they differ (moderated variances, Smyth 2004), and Student's t gets the degrees of freedom
of what it then rests on (Satterthwaite 1946). docs/rating.md has how often the truth is inside.

Notation: C contestants, R rows, G clusters of one kind. Strengths are logarithms of odds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from arena.rating.bootstrap import Unit
from arena.rating.comparisons import BoolArray, Comparisons, FloatArray, IntArray, renumber_codes
from arena.rating.estimate import t_quantile
from arena.rating.sandwich import Pulls, without_negative_parts

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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Component:
    """What clusters of one kind add to the covariance of the ratings.

    Attributes:
        covariance: (C, C) moderated.
        plain: (C, C) what the plain sandwich has: the squares, corrected for what the fit takes.
        common: (C, C) what it would be if all contestants were disagreed about alike.
        own_share: (C,) the weight of a contestant's own square, 0 to 1.
        own_degrees: (C,) degrees of freedom of that square: effective clusters less one.
        degrees: (C,) those of the moderated one.
    """

    covariance: FloatArray
    plain: FloatArray
    common: FloatArray
    own_share: FloatArray
    own_degrees: FloatArray
    degrees: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Spread:
    """How sure ratings are.

    Attributes:
        covariance: (C, C) in squared points, around the mean of the reference.
        degrees: (C,) of Student's t for a rating.
        common: (C, C) the covariance if contestants were disagreed about alike, at least `base`.
        base: (C, C) that of independent cells, or votes.
        plain: (C, C) by the plain sandwich, in which each contestant stands for itself.
        components: By kind of cluster; none for votes that count as independent.
    """

    covariance: FloatArray
    degrees: FloatArray
    common: FloatArray
    base: FloatArray
    plain: FloatArray
    components: tuple[Component, ...]

    def among(self, members: IntArray) -> Self:
        """The same for some of the contestants alone."""
        if len(members) == len(self.degrees):
            return self
        places = np.ix_(members, members)
        return replace(
            self,
            covariance=self.covariance[places],
            degrees=self.degrees[members],
            common=self.common[places],
            base=self.base[places],
            plain=self.plain[places],
            components=tuple(
                Component(
                    covariance=component.covariance[places],
                    plain=component.plain[places],
                    common=component.common[places],
                    own_share=component.own_share[members],
                    own_degrees=component.own_degrees[members],
                    degrees=component.degrees[members],
                )
                for component in self.components
            ),
        )

    def half_widths(self) -> FloatArray:
        """(C,) of the 95 % intervals, in points."""
        return t_factor(self.degrees) * np.sqrt(self.covariance.diagonal())


def t_factor(degrees: FloatArray) -> FloatArray:
    """By how much to multiply a standard error for a 95 % interval."""
    return np.asarray(t_quantile(np.maximum(degrees, 1.0)))


def spread_of(
    votes: Comparisons, pulls: Pulls, unit: Unit, reference: BoolArray | None = None
) -> Spread:
    """The spread of ratings by votes that hang together as the unit says.

    Args:
        votes: Of contestants who all have votes.
        pulls: What each row pulls at its contestants.
        unit: What hangs together. Where all votes are of one expert, or on one scenario, that
            side says nothing and is left out.
        reference: (C,) those whose mean is fixed, by default everybody. Only they say what
            contestants have in common: who has hardly any votes widens nobody else's interval.
    """
    if reference is None:
        reference = np.ones(pulls.contestants, dtype=np.bool_)
    pulls = pulls.relative_to(reference)
    kinds = clusters_of(votes, unit)
    base = pulls.by_row()
    single = base.diagonal()
    cells = np.empty(0, dtype=np.int64)
    if len(kinds) > 1:
        cells, cell_of = renumber_codes(kinds[0][1] * kinds[1][0] + kinds[1][1])
        base = pulls.by_cluster(cell_of, len(cells))
    components = tuple(
        _component(pulls, base, single, clusters, of_row, reference) for clusters, of_row in kinds
    )
    if not components and unit is not Unit.VOTE:
        base = np.zeros_like(base)  # there is but one of what differs: nothing can be said
    if not components:
        known = np.full(len(base), _FAR)
        return Spread(
            covariance=base, degrees=known, common=base, base=base, plain=base, components=()
        )
    found = sum((component.covariance for component in components[1:]), components[0].covariance)
    # What clusters add is never negative: equals drawn with less would be told apart too often.
    added = (part.common - base for part in components if part.common.trace() > base.trace())
    common = sum(added, base)
    plain = sum((component.plain for component in components[1:]), components[0].plain)
    if len(components) > 1:
        plain = plain - base * len(cells) / max(len(cells) - 1, 1)
        found = found - base
    least = np.maximum(found.diagonal(), LEAST * base.diagonal())
    found = _with_variances(without_negative_parts(found), least)
    return Spread(
        covariance=found,
        degrees=satterthwaite(found.diagonal(), components),
        common=common,
        base=base,
        plain=_with_variances(without_negative_parts(plain), plain.diagonal()),
        components=components,
    )


def satterthwaite(variance: FloatArray, components: tuple[Component, ...]) -> FloatArray:
    """(C,) degrees of freedom of variances (C,) that are sums of the components'."""
    of_parts = sum(
        component.covariance.diagonal() ** 2 / component.degrees for component in components
    )
    return np.asarray(variance**2 / np.maximum(of_parts, 1e-300))


def clusters_of(votes: Comparisons, unit: Unit) -> list[tuple[int, IntArray]]:
    """The number of clusters of each kind that the unit names, from two on, and (R,) whose."""
    wanted = {
        Unit.VOTE: (),
        Unit.EXPERT: (votes.expert,),
        Unit.SCENARIO: (votes.scenario,),
        Unit.TWO_WAY: (votes.expert, votes.scenario),
    }
    codes_by_unit = [renumber_codes(codes) for codes in wanted[unit]]
    return [(len(codes), of_row) for codes, of_row in codes_by_unit if len(codes) > 1]


def left_of_effect(uneven: FloatArray, cubes: FloatArray) -> FloatArray:
    """Return the share of the variance of cluster effects that the fit leaves in the pulls.

    Args:
        uneven: (C,) sums of squared shares of a contestant's information by cluster, at most 1.
        cubes: (C,) sums of cubed shares.
    """
    return np.maximum(1.0 - 2.0 * cubes / uneven + uneven, LEAST_LEFT * (1.0 - uneven))


def prior_degrees(own: FloatArray, common: FloatArray, degrees: FloatArray) -> float:
    """How many clusters what all have in common counts for: few where contestants differ.

    The spread of own squares (C,) around the common ones (C,), less what chance alone gives with
    so many degrees of freedom (C,), as moments of a scaled F distribution.
    """
    known = (degrees > 0.5) & (common > 0.0)
    if known.sum() < 3:
        return MOST_PRIOR
    ratio, weight = own[known] / common[known], degrees[known]
    surplus = float((weight * ((ratio - 1.0) ** 2 - 2.0 / weight)).sum() / weight.sum())
    surplus /= 1.0 + 2.0 / float(weight.mean())
    return MOST_PRIOR if surplus <= 0.0 else min(MOST_PRIOR, 4.0 + 2.0 / surplus)


# --- Private -----------------------------------------------------------------------------------


def _component(
    pulls: Pulls,
    base: FloatArray,
    single: FloatArray,
    clusters: int,
    of_row: IntArray,
    reference: BoolArray,
) -> Component:
    """What clusters of one kind add; docs/rating.md derives it.

    Args:
        pulls: What each row pulls at its contestants.
        base: (C, C) the sandwich of independent cells, or votes.
        single: (C,) variances by independent votes.
        clusters: G.
        of_row: (R,) the cluster of each row.
        reference: (C,) whose mean is fixed.
    """
    raw = pulls.by_cluster(of_row, clusters)
    uneven, cubes = pulls.concentration(of_row, clusters)
    left_of_votes = 1.0 - uneven
    left_of_effects = left_of_effect(uneven, cubes)
    effects = _centred(uneven, reference)
    surplus = raw.diagonal() - base.diagonal() * left_of_votes
    room = effects.diagonal() * left_of_effects
    # Single votes, as cells contain the effect: weights by these would prefer where it is small.
    weight = np.where(reference, 1.0 / np.maximum(single, 1e-9) ** 2, 0.0)
    # Chance makes this as often too small as too large: cut off at zero it would be too large.
    effect = float((weight * surplus).sum()) / max(float((weight * room).sum()), 1e-300)
    common = base + effect * effects
    if effect < 0.0:
        common = _at_least(without_negative_parts(common), LEAST * base)
    of_votes = np.minimum(base.diagonal() / np.maximum(common.diagonal(), 1e-300), 1.0)
    left = of_votes * left_of_votes + (1.0 - of_votes) * left_of_effects
    degrees = left / uneven
    with np.errstate(invalid="ignore", divide="ignore"):
        own = np.where(left > 0.0, raw.diagonal() / left, 0.0)
    prior = prior_degrees(own[reference], common.diagonal()[reference], degrees[reference])
    share = degrees / (prior + degrees)
    mine = np.sqrt(1.0 / (prior * uneven + left))
    others = np.sqrt(1.0 - share)
    everybody = float(degrees[reference].sum()) * (1.0 - 1.0 / reference.sum())
    return Component(
        covariance=mine[:, None] * raw * mine + others[:, None] * common * others,
        plain=raw * clusters / (clusters - 1),
        common=common,
        own_share=share,
        own_degrees=degrees,
        degrees=np.maximum(np.minimum(prior + degrees, everybody), 1.0),
    )


def _centred(values: FloatArray, reference: BoolArray) -> FloatArray:
    """(C, C) covariance of independent numbers with these variances (C,), around a mean."""
    number = reference.sum()
    of_mean = np.where(reference, values, 0.0)
    found = np.diag(values) - (of_mean[:, None] + of_mean) / number
    return np.asarray(found + of_mean.sum() / number**2)


def _with_variances(found: FloatArray, variances: FloatArray) -> FloatArray:
    """The covariance with these variances (C,) where they are positive.

    Many contestants have more directions than there are clusters. What is cut off in negative ones
    would widen everybody's interval, by a tenth among a thousand.
    """
    now = np.maximum(found.diagonal(), 1e-300)
    change = np.sqrt(np.where(variances > 0.0, variances / now, 1.0))
    return np.asarray(change[:, None] * found * change)


def _at_least(found: FloatArray, base: FloatArray) -> FloatArray:
    """The covariance with variances no smaller than those of single cells."""
    now, least = found.diagonal(), base.diagonal()
    wider = np.sqrt(np.maximum(1.0, least / np.maximum(now, 1e-300)))
    return np.asarray(wider[:, None] * found * wider)
