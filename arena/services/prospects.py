"""What is known for the planning of a study: the pace of votes, and what an earlier study says."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median
from typing import Any

from django.contrib.auth.models import User

from arena.models import Snapshot, Study, Vote
from arena.rating.planning import estimate_effects
from arena.results.queries.access import ResultsAccess, latest_snapshot, results_access
from arena.results.services.analysis import vote_arrays
from arena.results.services.ratings import votes_of

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
        from_results: Whether spread, ties and effects are among them: only where whoever asks may
            read the results.
    """

    values: dict[str, Any]
    from_results: bool = False


def usual_seconds(study: Study | None = None) -> float | None:
    """The median time of a vote, of a study or of all; None where too few were timed."""
    votes = Vote.objects.filter(is_simulated=False, ms_visible__isnull=False)
    if study is not None:
        votes = votes.filter(matchup__study=study)
    times = list(votes.order_by("-pk").values_list("ms_visible", flat=True)[:LAST_VOTES])
    if len(times) < FEWEST_VOTES:
        return None
    return round(median(min(ms / 1000.0, LONGEST_S) for ms in times if ms is not None), 1)


def known_of(study: Study, reader: User | None = None) -> Known:
    """What a study says; nothing of its results where the reader may not see them.

    Args:
        study: Any.
        reader: Who asks on a page; None for a command, which reads closed studies alone.

    Raises:
        Conflict: The votes of its rating are not what they were.
    """
    values: dict[str, Any] = {
        "contestants": study.contestants.count(),
        "experts": study.experts.count(),
        "scenarios": study.scenarios.count(),
        "seconds": usual_seconds(study),
    }
    for name, key in (("repeats", "repeat_share"), ("checks", "check_share")):
        if key in study.rules:
            values[name] = round(100 * study.rules[key], 2)
    values = {name: value for name, value in values.items() if value}
    snapshot = latest_snapshot(study) if _may_read(study, reader) else None
    if snapshot is None:
        return Known(values=values)
    found = _of_results(snapshot)
    return Known(values=values | found, from_results=bool(found))


# --- Private -----------------------------------------------------------------------------------


def _may_read(study: Study, reader: User | None) -> bool:
    if reader is None:
        return study.state == Study.State.CLOSED
    return results_access(user=reader, study=study) is ResultsAccess.FULL


def _of_results(snapshot: Snapshot) -> dict[str, Any]:
    votes = votes_of(snapshot)
    comparisons = vote_arrays(votes.entrants, votes.counted).comparisons
    ratings = snapshot.standings.exclude(rating=None).values_list("rating", flat=True)
    found = [rating for rating in ratings if rating is not None]
    effects = estimate_effects(comparisons)
    if effects is None or len(found) < 2:
        return {}
    return {
        "contestants": len(votes.entrants),
        "experts": len(set(comparisons.expert.tolist())),
        "scenarios": len(set(comparisons.scenario.tolist())),
        "spread": round(max(found) - min(found)),
        "ties": round(100 * float((comparisons.score == 0.5).mean()), 1),
        "expert_sd": round(effects.expert_sd),
        "scenario_sd": round(effects.scenario_sd),
    }
