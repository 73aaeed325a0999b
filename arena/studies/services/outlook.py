"""Expected intervals of a study before its first vote.

All of it is closed form: the sandwich of single votes of a balanced plan, plus what experts and
scenarios add, which only more experts and more scenarios reduce, and Student's t with
Satterthwaite's degrees of freedom. docs/rating.md describes it; everything is on the scale of the
rated table, ties half a win.

Notation: C contestants, P pairs. Widths and gaps are Elo points.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri

from arena.models.studies import one_question
from arena.rating import models, ranking, sandwich
from arena.rating.comparisons import LEVEL, FloatArray, t_quantile
from arena.studies.services.plan import QUANTITIES

COMPARED = (0.5, 1.0, 2.0, 4.0)
"""Times the votes per expert: what fewer or more votes would tell."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyEstimate:
    """A study in mind; the defaults below the first block are guesses (docs/rating.md).

    Attributes:
        repeats, checks, overlap: In percent, as in StudyPlan.
        spread: Points from the worst to the best; the others lie evenly between them.
        ties: Percent of the votes that say equal.
        expert_sd, scenario_sd: By how many points experts and scenarios differ about a contestant.
        power: Percent, the chance with which two are to be told apart.
        questions: Asked about each pair.
        seconds: For one pair with one question, and `seconds_more` for each further one.
    """

    contestants: int
    experts: int
    scenarios: int
    votes_per_expert: int
    repeats: float = 5.0
    checks: float = 2.0
    overlap: float = 10.0
    questions: int = 1

    spread: float = 150.0
    ties: float = 45.0
    expert_sd: float = 30.0
    scenario_sd: float = 70.0
    power: float = 80.0
    seconds: float = 12.0
    seconds_more: float = 3.0

    @property
    def pairs(self) -> int:
        """P."""
        return self.contestants * (self.contestants - 1) // 2

    @property
    def most_votes(self) -> int:
        """The most votes of an expert: nobody sees a pair on a scenario twice."""
        return self.pairs * self.scenarios

    @property
    def votes(self) -> int:
        """Votes in all, without repeats and checks."""
        return self.votes_per_expert * self.experts

    @property
    def minutes(self) -> float:
        """Minutes that each expert needs, repeats and checks included."""
        on_top = 1.0 + (self.repeats + self.checks) / 100
        return self.votes_per_expert * on_top * (self.seconds + self.extra_seconds) / 60.0

    @property
    def extra_seconds(self) -> float:
        """Seconds that the further questions about a pair take."""
        return (self.questions - 1) * self.seconds_more

    @property
    def gaps(self) -> FloatArray:
        """(P,) points between the pairs, in the order of np.triu_indices."""
        low, high = np.triu_indices(self.contestants, 1)
        return np.asarray((high - low) * self.spread / (self.contestants - 1))


@dataclass(frozen=True, slots=True, kw_only=True)
class Prospect:
    """Expected precision of a study's votes.

    Attributes:
        half_width, widest: Expected of a typical interval, and of the widest.
        gap: At which two are told apart with the wanted power.
    """

    half_width: float
    widest: float
    gap: float


def estimate_plan(values: Mapping[str, Any]) -> StudyEstimate | None:
    """Return the estimate from the values of a StudyPlan; None if one is missing."""
    counted = {name: len(values.get(name, ())) for name in ("contestants", "experts", "scenarios")}
    numbers = {name: values.get(name) or 0 for name in QUANTITIES}
    if not all(counted.values()) or not numbers["votes_per_expert"]:
        return None
    questions = len(values.get("questions") or one_question())
    return StudyEstimate(**counted, **numbers, questions=questions)


def compare_votes(estimate: StudyEstimate) -> list[tuple[StudyEstimate, Prospect]]:
    """Return the prospects of several numbers of votes per expert, from few to many.

    Nothing where there is only one contestant, expert or scenario: no interval can be foretold.
    """
    if min(estimate.contestants, estimate.experts, estimate.scenarios) < 2:
        return []
    most, wanted = estimate.most_votes, estimate.votes_per_expert
    numbers = {min(max(round(wanted * times), 1), most) for times in COMPARED} | {wanted}
    estimates = [replace(estimate, votes_per_expert=number) for number in sorted(numbers)]
    return [(plan_estimate, prospect(plan_estimate)) for plan_estimate in estimates]


def prospect(estimate: StudyEstimate) -> Prospect:
    """Return the prospect of a study with two or more of everything."""
    covariance, degrees, chance = _predict_spread(estimate)
    variance = covariance.diagonal()
    factor = float(t_quantile(degrees))
    # By chance some intervals of a table are wider than expected.
    by_chance = 1.0 + 0.5 * _expect_largest(estimate.contestants) * math.sqrt(chance)
    return Prospect(
        half_width=factor * math.sqrt(float(variance.mean())),
        widest=factor * math.sqrt(float(variance.max())) * by_chance,
        gap=_gap_found(estimate, covariance, degrees),
    )


def _predict_spread(estimate: StudyEstimate) -> tuple[FloatArray, float, float]:
    """Return (C, C) squared points, Student's degrees of freedom, and the chance in variances.

    The last is the relative variance of what is found for one contestant's variance.
    """
    size, votes = estimate.contestants, float(estimate.votes)
    single = _covariance_of_a_vote(size, estimate.spread, estimate.ties) / votes
    distinct = votes / (1.0 + estimate.overlap / 100)
    clusters = np.array([estimate.experts, estimate.scenarios], dtype=np.float64)
    effects = np.array([estimate.expert_sd, estimate.scenario_sd])
    uneven = np.array(
        [_uneven(estimate, number) for number in np.array([votes, distinct]) / clusters]
    )
    added = effects**2 * (1.0 + uneven) / clusters
    covariance = single + added.sum() * (np.eye(size) - 1.0 / size)
    largest = float(covariance.diagonal().max())
    variance = float(single.diagonal().max()) + added * (1.0 - 1.0 / size)
    own = clusters - 1.0
    degrees = np.maximum(np.minimum(sandwich.MOST_PRIOR + own, own * (size - 1.0)), 1.0)
    chance = (2.0 * (own / (own + sandwich.MOST_PRIOR) * variance / largest) ** 2 / own).sum()
    return covariance, max(largest**2 / float((variance**2 / degrees).sum()), 1.0), float(chance)


@lru_cache(maxsize=4)
def _covariance_of_a_vote(size: int, spread: float, ties: float) -> FloatArray:
    """Return (C, C) squared points: H^-1 B H^-1 of a balanced plan with one vote in all."""
    ratings = np.linspace(0.0, spread, size) / models.ELO_PER_LOGIT
    expected = 1.0 / (1.0 + np.exp(ratings[:, None] - ratings[None, :]))
    off_diagonal = ~np.eye(size, dtype=np.bool_)
    chance_of_tie = np.minimum(expected, 1.0 - expected)
    chance_of_tie *= ties / 100 / chance_of_tie[off_diagonal].mean()
    pairs = size * (size - 1) / 2
    information = np.where(off_diagonal, expected * (1.0 - expected), 0.0) / pairs
    surprise = np.where(off_diagonal, information - chance_of_tie / 4.0 / pairs, 0.0)
    curvature, squares = (np.diag(w.sum(axis=1)) - w for w in (information, surprise))
    inverse = np.linalg.pinv(curvature, rcond=1e-9, hermitian=True)
    return np.asarray(inverse @ squares @ inverse * models.ELO_PER_LOGIT**2)


def _uneven(estimate: StudyEstimate, per_cluster: float) -> float:
    """Return the extra weight of a cluster's tastes from its uneven numbers of pairs.

    The pairs of a cluster are drawn without putting back: with m of P pairs the variance of its
    mean taste is (C - 2) (P - m) / ((P - 1) m) times larger than with all of them.
    """
    pairs = estimate.pairs
    if per_cluster >= pairs or pairs < 2:
        return 0.0
    missing = (pairs - per_cluster) / (pairs - 1)
    return (estimate.contestants - 2) * missing / max(per_cluster, 1e-9)


def _expect_largest(number: int) -> float:
    """Return the mean of the largest of so many standard normal values."""
    values, step = np.linspace(-9.0, 9.0, 1801, retstep=True)
    return float((1.0 - ndtr(values) ** number - ndtr(-values)).sum() * step)


def _gap_found(estimate: StudyEstimate, covariance: FloatArray, degrees: float) -> float:
    """Return how far apart two must be to be told apart with such a chance.

    All pairs are judged at once, at 5 % for all of them, from the largest difference on: a pair
    shares the 5 % with those that are closer.
    """
    variance = covariance.diagonal()
    neighbours = variance[1:] + variance[:-1] - 2.0 * covariance.diagonal(1)
    error = math.sqrt(float(neighbours.mean()))
    gap = 0.0
    for _ in range(20):  # the gap says which pairs are closer, and these say the gap
        closer = max(int((estimate.gaps <= gap + 1e-6).sum()), estimate.contestants - 1)
        limit = float(t_quantile(degrees, 1.0 - (1.0 - LEVEL) / ranking.CAUTION / closer / 2.0))
        before, gap = gap, (limit + float(ndtri(estimate.power / 100))) * error
        if abs(gap - before) < 0.01:
            break
    return gap
