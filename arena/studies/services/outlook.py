"""How many votes a study needs, and what it will tell, before its first vote.

In: a `StudyEstimate`, filled in by hand or from a study that there is. Out: a `Goal` for each
wish. All of it is closed form: the sandwich of single votes of a balanced plan, plus what experts
and scenarios add, which only more experts and more scenarios reduce, and Student's t with
Satterthwaite's degrees of freedom. docs/rating.md describes it; everything is on the scale of the
rated table, ties half a win.

Notation: C contestants, P pairs. Widths and gaps are Elo points.
"""

import math
from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from django.contrib.auth.models import User
from django.db.models import Count, Max, Min
from scipy.special import ndtr, ndtri

from arena.models import Snapshot, Study
from arena.rating.comparisons import LEVEL, FloatArray, t_quantile
from arena.rating.influence import estimate_effects
from arena.rating.models import ELO_PER_LOGIT
from arena.rating.ranking import CAUTION
from arena.rating.sandwich import MOST_PRIOR
from arena.results.queries.access import ResultsAccess, latest_snapshot, results_access
from arena.results.services.analysis import vote_arrays
from arena.results.services.ratings import votes_of
from augment.errors import InvalidDocument
from augment.services.inputs import InputKind, input_field, inputs_of

POINTS = "Elo points"
MOST_SEARCHED = 500
"""No more experts, or scenarios, are thought of."""


def _whole(label: str, least: int, most: int, default: int | None) -> Any:
    return input_field(InputKind.WHOLE, label, default=default, least=least, most=most)


def _number(label: str, unit: str, least: float, most: float, default: float) -> Any:
    return input_field(InputKind.NUMBER, label, unit=unit, default=default, least=least, most=most)


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyEstimate:
    """A study in mind, and what it is to tell; the defaults are guesses (docs/method.md).

    Shares are in percent. The contestants lie evenly between the worst and the best.
    """

    contestants: int = _whole("Contestants", 2, 500, 9)
    experts: int = _whole("Experts", 2, 500, 9)
    scenarios: int = _whole("Scenarios", 2, 10_000, 50)
    spread: float = _number("From the worst to the best", POINTS, 0, 3000, 150)
    ties: float = _number("Votes that say Equal", "%", 0, 99, 45)
    expert_sd: float = _number("Experts differ about a contestant by", POINTS, 0, 1000, 30)
    scenario_sd: float = _number("Scenarios differ in a contestant by", POINTS, 0, 1000, 70)
    half_width: float = _number("Expected widest interval ±", POINTS, 1, 1000, 25)
    gap: float = _number("Tell two apart that differ by", POINTS, 1, 2000, 40)
    power: float = _number("with a chance of", "%", 50, 99.9, 80)
    seconds: float = _number("Seconds for one vote", "", 0.1, 3600, 12)
    repeats: float = _number("Hidden repeats", "%", 0, 50, 5)
    checks: float = _number("Attention checks", "%", 0, 50, 2)
    overlap: float = _number("Pairs that two experts judge", "%", 0, 80, 10)
    votes_per_expert: int | None = _whole("Votes per expert in mind", 1, 10_000, None)

    @property
    def pairs(self) -> int:
        """P."""
        return self.contestants * (self.contestants - 1) // 2

    @property
    def most_votes(self) -> int:
        """The most votes of an expert: nobody sees a pair on a scenario twice."""
        return self.pairs * self.scenarios

    @property
    def gaps(self) -> FloatArray:
        """(P,) points between the pairs, in the order of np.triu_indices."""
        low, high = np.triu_indices(self.contestants, 1)
        return np.asarray((high - low) * self.spread / (self.contestants - 1))

    @property
    def most_ties(self) -> float:
        """The percentage of ties that contestants so far apart can't reach."""
        return float((200.0 / (1.0 + np.exp(self.gaps / ELO_PER_LOGIT))).mean())


ESTIMATE_INPUTS = inputs_of(StudyEstimate)


@dataclass(frozen=True, slots=True, kw_only=True)
class Prospect:
    """What a number of votes gives.

    Attributes:
        votes_per_expert, votes: Without repeats and checks.
        minutes: Of each expert, with them.
        half_width, widest: Expected of a typical interval, and of the widest.
        gap: At which two are told apart with the wanted power.
    """

    votes_per_expert: int
    votes: int
    minutes: float
    half_width: float
    widest: float
    gap: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """A wish and what it takes, or why no number of votes reaches it."""

    text: str
    prospect: Prospect | None
    obstacle: str = ""


def foretell(estimate: StudyEstimate) -> list[Goal]:
    """Return what it takes to be told what is asked for, and what the votes in mind give.

    Raises:
        InvalidDocument: So many ties do not go together with so large a spread.
    """
    if estimate.ties >= estimate.most_ties:
        allowed = f"is below {estimate.most_ties:.0f} for contestants so far apart"
        raise InvalidDocument("estimate", [("ties", allowed)])
    goals = [
        _pursue(
            estimate,
            f"Expected widest interval ±{estimate.half_width:g}",
            lambda found: found.widest <= estimate.half_width,
        ),
        _pursue(
            estimate,
            f"Two that differ by {estimate.gap:g} told apart",
            lambda found: found.gap <= estimate.gap,
        ),
    ]
    if (votes := estimate.votes_per_expert) is not None:
        goals.append(Goal(text="Votes in mind", prospect=prospect(estimate, votes)))
    return goals


def prospect(estimate: StudyEstimate, votes_per_expert: int) -> Prospect:
    """Return what so many votes of each expert give."""
    votes = votes_per_expert * estimate.experts
    covariance, degrees, chance = _expected_spread(estimate, float(votes))
    variance = covariance.diagonal()
    factor = float(t_quantile(degrees))
    # By chance some intervals of a table are wider than expected.
    by_chance = 1.0 + 0.5 * _largest_of(estimate.contestants) * math.sqrt(chance)
    on_top = 1.0 + (estimate.repeats + estimate.checks) / 100
    return Prospect(
        votes_per_expert=votes_per_expert,
        votes=votes,
        minutes=votes_per_expert * on_top * estimate.seconds / 60.0,
        half_width=factor * math.sqrt(float(variance.mean())),
        widest=factor * math.sqrt(float(variance.max())) * by_chance,
        gap=_gap_found(estimate, covariance, degrees),
    )


def _pursue(estimate: StudyEstimate, text: str, reached: Callable[[Prospect], bool]) -> Goal:
    votes = _fewest(lambda number: reached(prospect(estimate, number)), 1, estimate.most_votes)
    if votes is not None:
        return Goal(text=text, prospect=prospect(estimate, votes))
    needs = []
    for name in ("experts", "scenarios"):

        def is_enough(number: int, name: str = name) -> bool:
            larger = replace(estimate, **{name: number})
            return reached(prospect(larger, larger.most_votes))

        number = _fewest(is_enough, getattr(estimate, name), MOST_SEARCHED)
        needs += [] if number is None else [f"{number} {name} would do"]
    most = prospect(estimate, estimate.most_votes)
    obstacle = (
        "No number of votes reaches it: with every pair judged by everybody the widest interval "
        f"is ±{most.widest:.0f} and {most.gap:.0f} points are told apart. "
        f"{' or '.join(needs) or 'It takes more experts and more scenarios'}."
    )
    return Goal(text=text, prospect=None, obstacle=obstacle)


def _fewest(is_enough: Callable[[int], bool], least: int, most: int) -> int | None:
    """Return the first number that is enough, where every larger one is, too."""
    numbers = range(least, most + 1)
    place = bisect_left(numbers, True, key=is_enough)
    return numbers[place] if place < len(numbers) else None


def _expected_spread(estimate: StudyEstimate, votes: float) -> tuple[FloatArray, float, float]:
    """Return (C, C) squared points, Student's degrees of freedom, and the chance in variances.

    The last is the relative variance of what is found for one contestant's variance.
    """
    size = estimate.contestants
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
    degrees = np.maximum(np.minimum(MOST_PRIOR + own, own * (size - 1.0)), 1.0)
    chance = (2.0 * (own / (own + MOST_PRIOR) * variance / largest) ** 2 / own).sum()
    return covariance, max(largest**2 / float((variance**2 / degrees).sum()), 1.0), float(chance)


@lru_cache(maxsize=4)
def _covariance_of_a_vote(size: int, spread: float, ties: float) -> FloatArray:
    """Return (C, C) squared points: H^-1 B H^-1 of a balanced plan with one vote in all."""
    ratings = np.linspace(0.0, spread, size) / ELO_PER_LOGIT
    expected = 1.0 / (1.0 + np.exp(ratings[:, None] - ratings[None, :]))
    off_diagonal = ~np.eye(size, dtype=np.bool_)
    chance_of_tie = np.minimum(expected, 1.0 - expected)
    chance_of_tie *= ties / 100 / chance_of_tie[off_diagonal].mean()
    pairs = size * (size - 1) / 2
    information = np.where(off_diagonal, expected * (1.0 - expected), 0.0) / pairs
    surprise = np.where(off_diagonal, information - chance_of_tie / 4.0 / pairs, 0.0)
    curvature, squares = (np.diag(w.sum(axis=1)) - w for w in (information, surprise))
    inverse = np.linalg.pinv(curvature, rcond=1e-9, hermitian=True)
    return np.asarray(inverse @ squares @ inverse * ELO_PER_LOGIT**2)


def _uneven(estimate: StudyEstimate, per_cluster: float) -> float:
    """Return what a cluster's tastes weigh more because it has not every pair equally often.

    The pairs of a cluster are drawn without putting back: with m of P pairs the variance of its
    mean taste is (C - 2) (P - m) / ((P - 1) m) times larger than with all of them.
    """
    pairs = estimate.pairs
    if per_cluster >= pairs or pairs < 2:
        return 0.0
    missing = (pairs - per_cluster) / (pairs - 1)
    return (estimate.contestants - 2) * missing / max(per_cluster, 1e-9)


def _largest_of(number: int) -> float:
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
        limit = float(t_quantile(degrees, 1.0 - (1.0 - LEVEL) / CAUTION / closer / 2.0))
        before, gap = gap, (limit + float(ndtri(estimate.power / 100))) * error
        if abs(gap - before) < 0.01:
            break
    return gap


# --- What past votes say -------------------------------------------------------------------------


def known_of(study: Study, reader: User | None = None) -> dict[str, Any]:
    """Return what a study says of the next one like it, by the fields of StudyEstimate.

    Nothing of its results where the reader may not see them.

    Args:
        study: Any.
        reader: Who asks on a page; None for a command, which reads closed studies alone.

    Raises:
        Conflict: The votes of its rating are not what they were.
    """
    shares = {"repeats": "repeat_share", "checks": "check_share"}
    values: dict[str, Any] = {
        "contestants": study.contestants.count(),
        "experts": study.experts.count(),
        "scenarios": study.scenarios.count(),
        **{name: round(100 * study.rules.get(share, 0), 2) for name, share in shares.items()},
    }
    values = {name: value for name, value in values.items() if value}
    may_read = study.state == Study.State.CLOSED
    if reader is not None:
        may_read = results_access(user=reader, study=study) is ResultsAccess.FULL
    snapshot = latest_snapshot(study) if may_read else None
    return values if snapshot is None else values | _of_results(snapshot)


def _of_results(snapshot: Snapshot) -> dict[str, Any]:
    votes = votes_of(snapshot)
    comparisons = vote_arrays(votes.entrants, votes.counted).comparisons
    rated = snapshot.standings.exclude(rating=None).aggregate(
        best=Max("rating"), worst=Min("rating"), n=Count("pk")
    )
    effects = estimate_effects(comparisons)
    if effects is None or rated["n"] < 2:
        return {}
    return {
        "contestants": len(votes.entrants),
        "experts": len(set(comparisons.expert.tolist())),
        "scenarios": len(set(comparisons.scenario.tolist())),
        "spread": round(rated["best"] - rated["worst"]),
        "ties": round(100 * float((comparisons.score == 0.5).mean()), 1),
        "expert_sd": round(effects["expert"]),
        "scenario_sd": round(effects["scenario"]),
    }
