"""How many votes a study needs, and what it will tell, before its first vote.

In: a `Question`. Out: an `Outlook` with a `Prospect` for each wish. All of it is closed form: the
sandwich of single votes of a balanced plan, plus what experts and scenarios add, which only more
experts and more scenarios reduce, and Student's t with Satterthwaite's degrees of freedom.
docs/rating.md describes it; everything is on the scale of the rated table, ties half a win.

Notation: C contestants, P pairs. Widths and gaps are Elo points.
"""

import math
from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.special import ndtr, ndtri

from arena.rating.chains import are_determined
from arena.rating.comparisons import LEVEL, Comparisons, FloatArray, count_pairs, t_quantile
from arena.rating.models import ELO_PER_LOGIT, Meetings, fit
from arena.rating.ranking import CAUTION
from arena.rating.rules import Unit
from arena.rating.sandwich import MOST_PRIOR, pulls_of_model, spread_of

MOST_SEARCHED = 500
"""No more experts, or scenarios, are thought of."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyDesign:
    """A study that somebody thinks of.

    Attributes:
        contestants, experts, scenarios: How many, 2 or more of each.
        spread: Points from the worst to the best; the others lie evenly between.
        tie_share: Of the votes, from 0 to below 1.
        expert_sd, scenario_sd: By how many points experts, and scenarios, differ in what they
            make of a contestant.
        overlap_share: Of the judged units, those that two experts judge.

    Raises:
        ValueError: Something is out of range; the text says what is allowed.
    """

    contestants: int
    experts: int
    scenarios: int
    spread: float = 0.0
    tie_share: float = 0.4
    expert_sd: float = 0.0
    scenario_sd: float = 0.0
    overlap_share: float = 0.0

    def __post_init__(self) -> None:
        if min(self.contestants, self.experts, self.scenarios) < 2:
            raise ValueError("contestants, experts and scenarios must be 2 or more")
        if min(self.spread, self.expert_sd, self.scenario_sd) < 0.0:
            raise ValueError("spread and standard deviations must be 0 or more")
        if not 0.0 <= self.overlap_share <= 1.0:
            raise ValueError(f"overlap_share goes from 0 to 1, not {self.overlap_share}")
        if not 0.0 <= self.tie_share < min(1.0, self.most_ties):
            raise ValueError(
                f"tie_share goes from 0 to below {min(1.0, self.most_ties):.2f} with a spread of "
                f"{self.spread:g} points, not {self.tie_share}"
            )

    @property
    def pairs(self) -> int:
        """P."""
        return self.contestants * (self.contestants - 1) // 2

    @property
    def units(self) -> int:
        """The most votes that an expert can give: nobody sees a pair on a scenario twice."""
        return self.pairs * self.scenarios

    @property
    def gaps(self) -> FloatArray:
        """(P,) points between the pairs, in the order of np.triu_indices."""
        ratings = np.linspace(0.0, self.spread, self.contestants)
        low, high = np.triu_indices(self.contestants, 1)
        return np.asarray(ratings[high] - ratings[low])

    @property
    def most_ties(self) -> float:
        """The tie share at which the weaker one of a pair would never win."""
        return float((2.0 / (1.0 + np.exp(self.gaps / ELO_PER_LOGIT))).mean())


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """A design, and what it is to tell.

    Attributes:
        half_width: Of the widest 95 % interval that is expected; some studies miss it.
        gap: Points between two contestants that are to be told apart with this power.
        votes_per_expert: What somebody has in mind, None without.
        seconds: Of one vote.
        extra_share: Hidden repeats and attention checks, as a share of the votes.
    """

    design: StudyDesign
    half_width: float
    gap: float
    power: float = 0.8
    votes_per_expert: int | None = None
    seconds: float = 12.0
    extra_share: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Prospect:
    """What a number of votes gives.

    Attributes:
        votes_per_expert, votes: Without repeats and checks.
        minutes: Of each expert, with them.
        half_width, widest: Expected of a typical interval, and of the widest.
        gap: At which two are told apart with the wanted power.
        judged_twice: Units that two experts judge.
        agreement: The half-width of their share of agreement, from 0 to 1; None without any.
    """

    votes_per_expert: int
    votes: int
    minutes: float
    half_width: float
    widest: float
    gap: float
    judged_twice: int
    agreement: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Wish:
    """One goal, and what it takes.

    Attributes:
        prospect: None where no number of votes reaches it.
        most: What all units judged by everybody would give.
        experts: The fewest experts with whom it can be reached on as many scenarios, None where
            it is reached anyway or nobody's number does.
        scenarios: The fewest scenarios on which as many experts reach it, likewise.
    """

    prospect: Prospect | None
    most: Prospect
    experts: int | None = None
    scenarios: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Outlook:
    """What each wish takes, and what the number of votes in mind gives."""

    narrow: Wish
    apart: Wish
    in_mind: Prospect | None


def foretell(question: Question) -> Outlook:
    """Return what it takes to be told what the question asks."""
    votes = question.votes_per_expert
    return Outlook(
        narrow=_wish(question, lambda found: found.widest <= question.half_width),
        apart=_wish(question, lambda found: found.gap <= question.gap),
        in_mind=None if votes is None else prospect(question, votes),
    )


def prospect(question: Question, votes_per_expert: int) -> Prospect:
    """Return what so many votes of each expert give."""
    design = question.design
    votes = votes_per_expert * design.experts
    judged_twice = votes * design.overlap_share / (1.0 + design.overlap_share)
    covariance, degrees, chance = _expected_spread(design, float(votes))
    variance = covariance.diagonal()
    factor = float(t_quantile(degrees))
    # By chance some intervals of a table are wider than expected.
    by_chance = 1.0 + 0.5 * _largest_of(design.contestants) * math.sqrt(chance)
    return Prospect(
        votes_per_expert=votes_per_expert,
        votes=votes,
        minutes=votes_per_expert * (1.0 + question.extra_share) * question.seconds / 60.0,
        half_width=factor * math.sqrt(float(variance.mean())),
        widest=factor * math.sqrt(float(variance.max())) * by_chance,
        gap=_gap_found(design, covariance, degrees, question.power),
        judged_twice=round(judged_twice),
        # Of a share of a half, where it is widest.
        agreement=_NORMAL * 0.5 / math.sqrt(judged_twice) if judged_twice >= 1.0 else None,
    )


_NORMAL = float(ndtri(0.5 + LEVEL / 2))


def _wish(question: Question, reached: Callable[[Prospect], bool]) -> Wish:
    design = question.design

    def is_enough(votes_per_expert: int) -> bool:
        return reached(prospect(question, votes_per_expert))

    def reaches_with(**more: int) -> bool:
        larger = replace(design, **more)
        return reached(prospect(replace(question, design=larger), larger.units))

    most = prospect(question, design.units)
    votes = _fewest(is_enough, 1, design.units)
    if votes is not None:
        return Wish(prospect=prospect(question, votes), most=most)
    return Wish(
        prospect=None,
        most=most,
        experts=_fewest(lambda number: reaches_with(experts=number), design.experts),
        scenarios=_fewest(lambda number: reaches_with(scenarios=number), design.scenarios),
    )


def _fewest(is_enough: Callable[[int], bool], least: int, most: int = MOST_SEARCHED) -> int | None:
    """Return the first number that is enough, where every larger one is, too."""
    numbers = range(least, most + 1)
    place = bisect_left(numbers, True, key=is_enough)
    return numbers[place] if place < len(numbers) else None


def _expected_spread(design: StudyDesign, votes: float) -> tuple[FloatArray, float, float]:
    """Return (C, C) squared points, Student's degrees of freedom, and the chance in variances.

    The last is the relative variance of what is found for one contestant's variance.
    """
    size = design.contestants
    single = _covariance_of_a_vote(size, design.spread, design.tie_share) / votes
    distinct = votes / (1.0 + design.overlap_share)
    centre = np.eye(size) - 1.0 / size
    added = [
        effect**2 * (1.0 + _uneven(design, per_cluster)) / clusters * centre
        for clusters, effect, per_cluster in (
            (design.experts, design.expert_sd, votes / design.experts),
            (design.scenarios, design.scenario_sd, distinct / design.scenarios),
        )
    ]
    covariance = single + added[0] + added[1]
    largest = float(covariance.diagonal().max())
    of_parts = chance = 0.0
    for clusters, part in zip((design.experts, design.scenarios), added, strict=True):
        variance = float(single.diagonal().max() + part[0, 0])
        own = clusters - 1.0
        of_parts += variance**2 / max(min(MOST_PRIOR + own, own * (size - 1.0)), 1.0)
        chance += 2.0 * (own / (own + MOST_PRIOR) * variance / largest) ** 2 / own
    return covariance, max(largest**2 / of_parts, 1.0), chance


@lru_cache(maxsize=4)
def _covariance_of_a_vote(size: int, spread: float, tie_share: float) -> FloatArray:
    """Return (C, C) squared points: H^-1 B H^-1 of a balanced plan with one vote in all."""
    ratings = np.linspace(0.0, spread, size) / ELO_PER_LOGIT
    expected = 1.0 / (1.0 + np.exp(ratings[:, None] - ratings[None, :]))
    off_diagonal = ~np.eye(size, dtype=np.bool_)
    chance_of_tie = np.minimum(expected, 1.0 - expected)
    chance_of_tie *= tie_share / chance_of_tie[off_diagonal].mean()
    pairs = size * (size - 1) / 2
    information = np.where(off_diagonal, expected * (1.0 - expected), 0.0) / pairs
    surprise = np.where(off_diagonal, information - chance_of_tie / 4.0 / pairs, 0.0)
    curvature, squares = (np.diag(w.sum(axis=1)) - w for w in (information, surprise))
    inverse = np.linalg.pinv(curvature, rcond=1e-9, hermitian=True)
    return np.asarray(inverse @ squares @ inverse * ELO_PER_LOGIT**2)


def _uneven(design: StudyDesign, per_cluster: float) -> float:
    """Return what a cluster's tastes weigh more because it has not every pair equally often.

    The pairs of a cluster are drawn without putting back: with m of P pairs the variance of its
    mean taste is (C - 2) (P - m) / ((P - 1) m) times larger than with all of them.
    """
    pairs = design.pairs
    if per_cluster >= pairs or pairs < 2:
        return 0.0
    missing = (pairs - per_cluster) / (pairs - 1)
    return (design.contestants - 2) * missing / max(per_cluster, 1e-9)


def _largest_of(number: int) -> float:
    """Return the mean of the largest of so many standard normal values."""
    values, step = np.linspace(-9.0, 9.0, 1801, retstep=True)
    return float((1.0 - ndtr(values) ** number - ndtr(-values)).sum() * step)


def _gap_found(design: StudyDesign, covariance: FloatArray, degrees: float, power: float) -> float:
    """Return how far apart two must be to be told apart with such a chance.

    All pairs are judged at once, at 5 % for all of them, from the largest difference on: a pair
    shares the 5 % with those that are closer.
    """
    variance = covariance.diagonal()
    neighbours = variance[1:] + variance[:-1] - 2.0 * covariance.diagonal(1)
    error = math.sqrt(float(neighbours.mean()))
    gap = 0.0
    for _ in range(20):  # the gap says which pairs are closer, and these say the gap
        closer = max(int((design.gaps <= gap + 1e-6).sum()), design.contestants - 1)
        limit = float(t_quantile(degrees, 1.0 - (1.0 - LEVEL) / CAUTION / closer / 2.0))
        before, gap = gap, (limit + float(ndtri(power))) * error
        if abs(gap - before) < 0.01:
            break
    return gap


# --- What past votes say -------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Effects:
    """Standard deviations in Elo points, on the scale of the rated table; 0 where none is seen."""

    expert_sd: float
    scenario_sd: float


def estimate_effects(votes: Comparisons) -> Effects | None:
    """Return what past votes say; None where they do not determine ratings."""
    counts = count_pairs(votes)
    met = Meetings(len(votes.names), counts)
    games, scores = counts.games[:, None], counts.scores[:, None]
    if not are_determined(met, games, scores).all():
        return None
    pulls = pulls_of_model(votes, met, counts.games, fit(met, games, scores)[:, 0])
    means = {unit: float(spread_of(pulls, unit).covariance.diagonal().mean()) for unit in Unit}
    share = 1.0 - 1.0 / len(votes.names)

    def standard_deviation(unit: Unit, clusters: int) -> float:
        return math.sqrt(max(means[unit] - means[Unit.VOTE], 0.0) * clusters / share)

    return Effects(
        expert_sd=standard_deviation(Unit.EXPERT, len(np.unique(votes.expert))),
        scenario_sd=standard_deviation(Unit.SCENARIO, len(np.unique(votes.scenario))),
    )
