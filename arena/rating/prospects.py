"""What somebody wants of a study, and what it takes: votes, minutes, pairs judged by two.

In: a `Question`. Out: an `Outlook` with a `Prospect` for each wish. Pure; the numbers come from
`sample_size.py`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from arena.rating.sample_size import (
    Expected,
    StudyDesign,
    agreement_error,
    expect,
    votes_per_expert_for,
)

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


# --- Private -----------------------------------------------------------------------------------


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
