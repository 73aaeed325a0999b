"""What somebody asks for who estimates how many votes a study needs; shares in percent."""

from dataclasses import dataclass
from statistics import median
from typing import Any

from django.contrib.auth.models import User
from django.db.models import Count, Max, Min

from arena.models import Snapshot, Study, Vote
from arena.rating.planning import Question, StudyDesign, estimate_effects
from arena.results.queries.access import ResultsAccess, latest_snapshot, results_access
from arena.results.services.analysis import vote_arrays
from arena.results.services.ratings import votes_of
from augment.services.inputs import InputKind, input_field, inputs_of

POINTS = "Elo points"


def _whole(label: str, least: int, most: int, default: int | None) -> Any:
    return input_field(InputKind.WHOLE, label, default=default, least=least, most=most)


def _number(label: str, unit: str, least: float, most: float, default: float) -> Any:
    return input_field(InputKind.NUMBER, label, unit=unit, default=default, least=least, most=most)


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyEstimate:
    """A study in mind, and what it is to tell; the defaults are guesses (docs/method.md)."""

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
    def most_ties(self) -> float:
        """The percentage of ties that contestants so far apart can't reach."""
        return 100 * self._design(ties=0.0).most_ties

    def question(self) -> Question:
        """Return what is to be foretold.

        Raises:
            ValueError: So many ties do not go together with so large a spread.
        """
        return Question(
            design=self._design(ties=self.ties),
            half_width=self.half_width,
            gap=self.gap,
            power=self.power / 100,
            votes_per_expert=self.votes_per_expert,
            seconds=self.seconds,
            extra_share=(self.repeats + self.checks) / 100,
        )

    def _design(self, *, ties: float) -> StudyDesign:
        return StudyDesign(
            contestants=self.contestants,
            experts=self.experts,
            scenarios=self.scenarios,
            spread=self.spread,
            expert_sd=self.expert_sd,
            scenario_sd=self.scenario_sd,
            tie_share=ties / 100,
            overlap_share=self.overlap / 100,
        )


ESTIMATE_INPUTS = inputs_of(StudyEstimate)


LAST_VOTES = 2000
FEWEST_VOTES = 20
"""With fewer timed votes a pace is a guess."""
LONGEST_S = 120.0
"""Somebody who takes longer has left the room."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Known:
    """What a study says of the next one like it.

    Attributes:
        values: By the fields of StudyEstimate; only what is known.
        from_results: Whether spread, ties and effects are among them.
    """

    values: dict[str, Any]
    from_results: bool = False


def usual_seconds(study: Study | None = None) -> float | None:
    """Return the median time of a vote, of a study or of all; None where too few were timed."""
    votes = Vote.objects.filter(is_simulated=False, ms_visible__isnull=False)
    if study is not None:
        votes = votes.filter(matchup__study=study)
    times = list(votes.order_by("-pk").values_list("ms_visible", flat=True)[:LAST_VOTES])
    if len(times) < FEWEST_VOTES:
        return None
    return round(median(min(ms / 1000.0, LONGEST_S) for ms in times if ms is not None), 1)


def known_of(study: Study, reader: User | None = None) -> Known:
    """Return what a study says; nothing of its results where the reader may not see them.

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
        "seconds": usual_seconds(study),
        **{name: round(100 * study.rules.get(share, 0), 2) for name, share in shares.items()},
    }
    values = {name: value for name, value in values.items() if value}
    may_read = study.state == Study.State.CLOSED
    if reader is not None:
        may_read = results_access(user=reader, study=study) is ResultsAccess.FULL
    snapshot = latest_snapshot(study) if may_read else None
    results = {} if snapshot is None else _of_results(snapshot)
    return Known(values=values | results, from_results=bool(results))


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
        "expert_sd": round(effects.expert_sd),
        "scenario_sd": round(effects.scenario_sd),
    }
