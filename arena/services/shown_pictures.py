"""Which augmentations a study shows: of which jobs, which samples, under which options.

In: contestants, scenarios, jobs and the rule for samples. Out: the cells of a plan. A contestant
stands for one set of options: pictures made with two are refused, with the jobs they come from.
"""

from __future__ import annotations

import hashlib
import json
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from django.db.models import F

from arena.errors import NothingToPlan
from arena.pairing.rules import place_of
from arena.services.frames import Cells
from arena.studies.services.pictures import find_showable, refuse_missing
from augment.errors import Conflict
from augment.models import Augmentation, Contestant, GenerationJob, Scenario


class SampleRule(StrEnum):
    """Which samples of a cell take part.

    ONE: one of each scenario, by the study's seed (`draw_sample`). ALL: every one, each against
    the same sample of the others.
    """

    ONE = "one"
    ALL = "all"


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyPictures:
    """The pictures of a study.

    Attributes:
        cells: By place and contestant; a place is a scenario, or one sample of it.
        jobs: Those that the pictures come from, by their age.
        options: By contestant, with which its pictures were made; only of those who ask models.
    """

    cells: Cells
    jobs: tuple[GenerationJob, ...]
    options: dict[str, dict[str, Any]]


def choose_pictures(
    contestants: list[Contestant],
    scenarios: list[Scenario],
    *,
    seed: int,
    rule: SampleRule = SampleRule.ONE,
    jobs: Sequence[GenerationJob] = (),
) -> StudyPictures:
    """The augmentation that finished last of each scenario, contestant and sample that is shown.

    Args:
        contestants: Who takes part.
        scenarios: On what.
        seed: Of the study.
        rule: Which samples are shown.
        jobs: Whose augmentations count; none for those of every job.

    Raises:
        NothingToPlan: Pictures are missing; the text names them.
        Conflict: A contestant's pictures were made with different options.
    """
    found = find_showable(scenarios).filter(contestant__in=contestants)
    if jobs:
        found = found.filter(job__in=jobs)
    rows = found.select_related("scenario", "contestant", "job")
    latest: defaultdict[tuple[str, str], dict[int, Augmentation]] = defaultdict(dict)
    for row in rows.order_by(F("finished_at").asc(nulls_first=True), "pk"):
        latest[row.scenario.slug, row.contestant.slug][row.sample] = row
    cells = _one(latest, seed) if rule is SampleRule.ONE else _all(latest, contestants)
    refuse_missing(contestants, scenarios, latest)
    _refuse_mixed(cells)
    used = {row.job_id: row.job for row in cells.values()}
    return StudyPictures(
        cells=cells,
        jobs=tuple(used[pk] for pk in sorted(used)),
        options={
            row.contestant.slug: row.options for row in cells.values() if row.options is not None
        },
    )


def draw_sample(seed: int, scenario: str, samples: int) -> int:
    """Which of so many samples of a scenario a study shows, from 0.

    The first eight bytes of the SHA-256 of "seed/scenario", modulo the number of samples: the same
    for every contestant that has as many.
    """
    digest = hashlib.sha256(f"{seed}/{scenario}".encode()).digest()
    return int.from_bytes(digest[:8], "big") % samples


# --- Private -----------------------------------------------------------------------------------

_Latest = dict[tuple[str, str], dict[int, Augmentation]]


def _one(latest: _Latest, seed: int) -> Cells:
    return {
        (scenario, contestant): found[sorted(found)[draw_sample(seed, scenario, len(found))]]
        for (scenario, contestant), found in latest.items()
    }


def _all(latest: _Latest, contestants: list[Contestant]) -> Cells:
    """Every sample of a scenario, each as a place of its own that everybody has a picture of."""
    most: defaultdict[str, set[int]] = defaultdict(set)
    for (scenario, _), found in latest.items():
        most[scenario] |= found.keys()
    missing = [
        f"{who.slug} on {scenario}, sample {sample}"
        for who in contestants
        for scenario, samples in sorted(most.items())
        for sample in sorted(samples - latest.get((scenario, who.slug), {}).keys())
        if (scenario, who.slug) in latest
    ]
    if missing:
        raise NothingToPlan(
            "All samples are to be shown, and there is no picture of "
            f"{', '.join(missing[:8])}. Generate them, or show one sample of each scenario."
        )
    return {
        (place_of(scenario, sample), contestant): row
        for (scenario, contestant), found in latest.items()
        for sample, row in found.items()
    }


def _refuse_mixed(cells: Cells) -> None:
    by_contestant: defaultdict[str, dict[str, list[Augmentation]]] = defaultdict(dict)
    for row in cells.values():
        key = json.dumps(row.options, sort_keys=True)
        by_contestant[row.contestant.slug].setdefault(key, []).append(row)
    for slug, sets in sorted(by_contestant.items()):
        if len(sets) > 1:
            raise Conflict(_mixed(slug, sets))


def _mixed(slug: str, sets: dict[str, list[Augmentation]]) -> str:
    documents = [json.loads(key) or {} for key in sets]
    names = sorted({name for one in documents for name in one})
    differing = [
        name for name in names if len({json.dumps(one.get(name)) for one in documents}) > 1
    ]
    jobs = sorted({row.job.name for rows in sets.values() for row in rows})
    options = ", ".join(differing) or "unknown"
    return (
        f"The pictures of {slug} were made with different options ({options}), in the jobs "
        f"{', '.join(jobs)}. Name the jobs whose augmentations the study is to show, or run it "
        "anew."
    )
