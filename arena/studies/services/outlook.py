"""How many votes a study needs, and what it will tell, before its first vote.

from dataclasses import dataclass
from typing import Any

import numpy as np
from django.contrib.auth.models import User
from django.db.models import Count, Max, Min
from scipy.special import ndtr, ndtri

from arena.models import Snapshot, Study
from arena.rating.planning import Prospect, Question, StudyDesign, Wish, estimate_effects, foretell
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

    def question(self) -> Question:
        """Return what is to be foretold.

        Raises:
            ValueError: So many ties do not go together with so large a spread.
        """
        return Question(
            design=StudyDesign(
                contestants=self.contestants,
                experts=self.experts,
                scenarios=self.scenarios,
                spread=self.spread,
                expert_sd=self.expert_sd,
                scenario_sd=self.scenario_sd,
                tie_share=self.ties / 100,
                overlap_share=self.overlap / 100,
            ),
            half_width=self.half_width,
            gap=self.gap,
            power=self.power / 100,
            votes_per_expert=self.votes_per_expert,
            seconds=self.seconds,
            extra_share=(self.repeats + self.checks) / 100,
        )


ESTIMATE_INPUTS = inputs_of(StudyEstimate)


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """What a study is to tell: what it takes, or why no number of votes reaches it."""

    title: str
    prospect: Prospect | None
    obstacle: str = ""


def forecast(question: Question) -> list[Goal]:
    """Return what each goal takes, and what the votes in mind would tell."""
    outlook = foretell(question)
    narrow, apart = outlook.narrow, outlook.apart
    unreached = "No number of votes reaches it: with every pair judged by everybody"
    goals = [
        Goal(
            title=f"Expected widest interval ±{question.half_width:g}",
            prospect=narrow.prospect,
            obstacle=f"{unreached} it is ±{narrow.most.widest:.0f}. {_what_would_do(narrow)}",
        ),
        Goal(
            title=f"Two that differ by {question.gap:g} told apart",
            prospect=apart.prospect,
            obstacle=f"{unreached} it is {apart.most.gap:.0f} points. {_what_would_do(apart)}",
        ),
    ]
    if outlook.in_mind is not None:
        goals.append(Goal(title="Votes in mind", prospect=outlook.in_mind))
    return goals


def _what_would_do(wish: Wish) -> str:
    numbers = {"experts": wish.experts, "scenarios": wish.scenarios}
    needs = [f"{number} {what}" for what, number in numbers.items() if number is not None]
    return f"It takes {' or '.join(needs) or 'more experts and scenarios'}."


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
