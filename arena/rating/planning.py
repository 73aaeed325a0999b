"""What it takes to be told something: votes, minutes, pairs judged by two.

In: a `Question`. Out: an `Outlook` with a `Prospect` for each wish; the numbers come from
`sample_size.py`. By how much experts and scenarios differ is read off past votes.

Notation: C contestants, half-widths in Elo points.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from scipy.special import ndtri

from arena.rating.bootstrap import Unit
from arena.rating.bradley_terry import ELO_PER_LOGIT
from arena.rating.comparisons import Comparisons
from arena.rating.estimate import LEVEL
from arena.rating.leaderboard import Intervals, Leaderboard, rate
from arena.rating.sample_size import (
    Expected,
    StudyDesign,
    agreement_error,
    expect,
    votes_per_expert_for,
)

QUANTILE = float(ndtri(0.5 + LEVEL / 2))


def votes_for(
    *, contestants: int, half_width: float, tie_share: float, design_effect: float = 1.0
) -> int:
    """Votes per contestant until its 95 % interval is +-`half_width` points.

    For a balanced plan and contestants close to each other: with n votes each the variance of a
    strength is 4 (1 - t) (C - 1)^2 / (C^2 n), because a tie leaves less to chance. Every vote
    serves two contestants, so the whole study needs C / 2 times as many.

    Args:
        contestants: C, 2 or more.
        half_width: More than 0.
        tie_share: t, from 0 to below 1.
        design_effect: How much larger the variance is than that of independent votes.

    Raises:
        ValueError: An argument is out of range.
    """
    if contestants < 2 or half_width <= 0 or not 0 <= tie_share < 1 or design_effect <= 0:
        raise ValueError(
            "2 contestants or more, a half-width above 0, a tie share from 0 to below 1 and a "
            f"design effect above 0 are needed, not {contestants}, {half_width}, {tie_share} and "
            f"{design_effect}"
        )
    strength = half_width / (QUANTILE * ELO_PER_LOGIT)
    variance = 4.0 * (1.0 - tie_share) * ((contestants - 1) / contestants) ** 2
    return math.ceil(design_effect * variance / strength**2)


def votes_until(*, votes: int, half_width: float, wanted: float) -> int:
    """Votes in all until an interval of +-`half_width` by `votes` votes has become +-`wanted`.

    Widths fall with the square root of the number of votes as long as experts and scenarios grow
    along with it: more votes of the same experts on the same scenarios narrow it less.

    Raises:
        ValueError: A number is not positive.
    """
    if votes <= 0 or half_width <= 0 or wanted <= 0:
        raise ValueError(f"positive numbers are needed, not {votes}, {half_width} and {wanted}")
    return math.ceil(votes * (half_width / wanted) ** 2)


def design_effects(board: Leaderboard, independent: Leaderboard) -> list[float]:
    """How many votes weigh as much as one independent vote, by contestant with an interval.

    The ratio of the variances. Half-widths would also count what Student's t adds for few experts.

    Args:
        board: Its covariance knows of experts and scenarios.
        independent: The same votes rated as if each stood for itself.
    """
    if board.covariance is None or independent.covariance is None:
        return []
    both = zip(board.covariance.diagonal(), independent.covariance.diagonal(), strict=True)
    return [
        float(clustered / alone)
        for line, (clustered, alone) in zip(board.lines, both, strict=True)
        if line.lower is not None and line.upper is not None and alone > 0.0
    ]


# --- A question and its answer -------------------------------------------------------------------


MOST_SEARCHED = 500
"""No more experts, or scenarios, are thought of."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """A design, and what it is to tell.

    Attributes:
        half_width: Points that the widest 95 % interval is expected to have: some studies miss
            it (docs/rating.md).
        gap: Points between two contestants that are to be told apart.
        power: With this chance.
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
        half_width, widest: Points expected of a typical interval, and of the widest.
        gap: Points at which two are told apart with the wanted power.
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
            that is no question or nobody's number does.
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
    """What it takes to be told what the question asks."""

    def is_narrow(found: Expected) -> bool:
        return found.widest <= question.half_width

    def tells_apart(found: Expected) -> bool:
        return found.tells_apart(question.gap, power=question.power)

    votes = question.votes_per_expert
    return Outlook(
        narrow=_wish(question, is_narrow),
        apart=_wish(question, tells_apart),
        in_mind=None if votes is None else prospect(question, votes),
    )


def prospect(question: Question, votes_per_expert: int) -> Prospect:
    """What so many votes of each expert give."""
    design = question.design
    votes = votes_per_expert * design.experts
    found = expect(design, votes)
    distinct = votes / (1.0 + design.overlap_share)
    return Prospect(
        votes_per_expert=votes_per_expert,
        votes=votes,
        minutes=votes_per_expert * (1.0 + question.extra_share) * question.seconds / 60.0,
        half_width=found.half_width,
        widest=found.widest,
        gap=found.gap_found(power=question.power),
        judged_twice=round(distinct * design.overlap_share),
        agreement=agreement_error(design, votes),
    )


def _wish(question: Question, reached: Callable[[Expected], bool]) -> Wish:
    design = question.design
    most = prospect(question, design.units)
    votes = votes_per_expert_for(design, reached)
    if votes is not None:
        return Wish(prospect=prospect(question, votes), most=most)
    return Wish(
        prospect=None,
        most=most,
        experts=_fewest(design, "experts", reached),
        scenarios=_fewest(design, "scenarios", reached),
    )


def _fewest(design: StudyDesign, what: str, reached: Callable[[Expected], bool]) -> int | None:
    """The fewest of something with which all units judged by everybody reach it."""

    def is_enough(number: int) -> bool:
        larger = replace(design, **{what: number})
        return reached(expect(larger, larger.units * larger.experts))

    low, high = getattr(design, what), MOST_SEARCHED
    if low >= high or not is_enough(high):
        return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if is_enough(middle) else (middle, high)
    return high


# --- What past votes say -------------------------------------------------------------------------


_ROUNDS = 100
"""They only say who is determined at all."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Effects:
    """Standard deviations in Elo points, on the scale of the rated table; 0 where none is seen."""

    expert_sd: float
    scenario_sd: float


def estimate_effects(votes: Comparisons) -> Effects | None:
    """What past votes say; None where they do not determine ratings with intervals."""
    alone = _mean_variance(votes, Unit.VOTE)
    by_expert, by_scenario = (_mean_variance(votes, unit) for unit in (Unit.EXPERT, Unit.SCENARIO))
    if alone is None or by_expert is None or by_scenario is None:
        return None
    contestants = len(votes.names)
    share = (contestants - 1) / contestants
    experts, scenarios = len(set(votes.expert.tolist())), len(set(votes.scenario.tolist()))
    return Effects(
        expert_sd=math.sqrt(max(by_expert - alone, 0.0) * experts / share),
        scenario_sd=math.sqrt(max(by_scenario - alone, 0.0) * scenarios / share),
    )


def _mean_variance(votes: Comparisons, unit: Unit) -> float | None:
    """Squared points, over the contestants."""
    board = rate(votes, unit=unit, intervals=Intervals.CLOSED_FORM, rounds=_ROUNDS)
    if board.covariance is None:
        return None
    found = float(board.covariance.diagonal().mean())
    return None if math.isnan(found) else found
