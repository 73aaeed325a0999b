"""One number an augmentation by each metric, more being better: what votes are held against."""

import math
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass

from django.db.models import Q

from augment.checks import Severity
from augment.models import Augmentation, Contestant, Simulation
from augment.services.driving.driving_scores import find_shown
from augment.services.driving.simulations import SCORES
from augment.services.judging.displacement import of_rows
from augment.services.judging.findings import read_findings

SAME_M = 0.15
"""Displacements that differ by no more are equal: objects so near each other look the same."""

_REFERENCE = Contestant.Kind.REFERENCE


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
    return (*_distances(ids), _checks(ids), *_driving(ids))


# --- Private -----------------------------------------------------------------------------------


def _distances(ids: Collection[int]) -> list[MetricScores]:
    """Less is better; by displacement none for the reference, which is held against itself."""
    wishes, displacements = dict[str, float](), dict[str, float]()
    for measured in of_rows(ids):
        code, is_reference = str(measured.row.code), measured.row.contestant.kind == _REFERENCE
        if measured.wish is not None:
            wishes[code] = -measured.wish.error_m
        if measured.displacement is not None and not is_reference:
            displacements[code] = -measured.displacement.error_m
    by_name = {"Distance to the wish": wishes} if wishes else {}
    by_name["Displacement"] = displacements
    return [
        MetricScores(name=name, by_code=scores, tolerance=SAME_M)
        for name, scores in by_name.items()
    ]


def _checks(ids: Collection[int]) -> MetricScores:
    """Fewer wrong findings are better, then fewer doubtful ones; no answer is worst."""
    rows = Augmentation.objects.filter(pk__in=ids, state__in=Augmentation.SHOWABLE)
    findings, scores = read_findings(ids), dict[str, float]()
    for pk, code, state in rows.values_list("pk", "code", "state"):
        if state in Augmentation.MISSES:
            scores[str(code)] = -math.inf
        elif pk in findings:
            counts = Counter(finding.severity for finding in findings[pk])
            doubts = min(counts[Severity.DOUBTFUL], 99) / 100
            scores[str(code)] = -counts[Severity.WRONG] - doubts
    return MetricScores(name="Checks", by_code=scores)


def _driving(ids: Collection[int]) -> list[MetricScores]:
    """The lower the ego scores, the better: a change is to make a scene harder to drive."""
    which = Q(augmentation__in=ids)
    done = Simulation.objects.filter(which, state=Simulation.State.DONE)
    rows = list(find_shown(which).of(done).values_list("augmentation__code", *SCORES.values()))
    names = {"nuplan": "Driving score (nuPlan)", "interplan": "Driving score (interPlan)"}
    return [
        MetricScores(
            name=names[kind],
            by_code={str(row[0]): -row[place] for row in rows if row[place] is not None},
        )
        for place, kind in enumerate(SCORES, start=1)
    ]
