"""One number an augmentation by each metric, more being better: what votes are held against."""

import math
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass

from augment.checks import Severity
from augment.models import Augmentation, Contestant, Simulation
from augment.services.driving.simulations import SCORES, Options
from augment.services.judging.displacement import of_rows
from augment.services.judging.findings import read_findings

SAME_M = 0.15
"""Displacements that differ by no more are equal: objects so near each other look the same."""

UNREADABLE_OR_REFUSED = (Augmentation.State.UNREADABLE, Augmentation.State.REFUSED)


@dataclass(frozen=True, slots=True, kw_only=True)
class MetricScores:
    """The scores of augmentations by one metric.

    Attributes:
        name: As people read it.
        by_code: More is better; augmentations that the metric knows nothing of are missing.
        tolerance: Scores that differ by no more are equal.
    """

    name: str
    by_code: dict[str, float]
    tolerance: float = 0.0


def metric_scores(ids: Collection[int]) -> tuple[MetricScores, ...]:
    """Return the scores of the augmentations with these primary keys; a second for a hundred."""
    return (_displacement(ids), _checks(ids), *_driving(ids))


# --- Private -----------------------------------------------------------------------------------


def _displacement(ids: Collection[int]) -> MetricScores:
    """Less is better; none for the reference itself, which would be held against itself."""
    scores = {
        str(one.row.code): -one.displacement.error_m
        for one in of_rows(ids)
        if one.displacement is not None and one.row.contestant.kind != Contestant.Kind.REFERENCE
    }
    return MetricScores(name="Displacement", by_code=scores, tolerance=SAME_M)


def _checks(ids: Collection[int]) -> MetricScores:
    """Fewer wrong findings are better, then fewer doubtful ones; no answer is worst."""
    rows = Augmentation.objects.filter(pk__in=ids, state__in=Augmentation.SHOWABLE)
    found, scores = read_findings(ids), dict[str, float]()
    for pk, code, state in rows.values_list("pk", "code", "state"):
        if state in UNREADABLE_OR_REFUSED:
            scores[str(code)] = -math.inf
        elif pk in found:
            counts = Counter(finding.severity for finding in found[pk])
            doubts = min(counts[Severity.DOUBTFUL], 99) / 100
            scores[str(code)] = -counts[Severity.WRONG] - doubts
    return MetricScores(name="Checks", by_code=scores)


def _driving(ids: Collection[int]) -> list[MetricScores]:
    """The lower the ego scores, the better: a change is to make a scene harder to drive."""
    all_drives = Simulation.objects.filter(augmentation__in=ids)
    drives = Options().newest_in(all_drives).of(all_drives)
    done = drives.filter(state=Simulation.State.DONE)
    rows = list(done.values_list("augmentation__code", *SCORES.values()))
    names = {"nuplan": "Driving score (nuPlan)", "interplan": "Driving score (interPlan)"}
    return [
        MetricScores(
            name=names[kind],
            by_code={str(row[0]): -row[place] for row in rows if row[place] is not None},
        )
        for place, kind in enumerate(SCORES, start=1)
    ]
