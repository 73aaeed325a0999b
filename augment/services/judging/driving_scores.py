"""Mean driving scores: by contestant, by scenario type, beside the unmodified scenes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

from django.db.models import Q, QuerySet

from augment.models import GenerationJob, Scenario, Simulation
from augment.services.judging.simulations import SCORES, Options

State, Subject = Simulation.State, Simulation.Subject


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivingLine:
    """The mean score of one contestant, or of the scenes without any.

    Attributes:
        slug: Of the contestant; empty for the scenes before the change and the references.
        drives: How many count: those whose scene was also driven before the change.
        failed: How many could not be driven.
        mean: 0 to 1, None without drives.
        before: The mean of the same scenes before the change; None without.
        by_type: The mean by scenario type, in the catalogue's order, None without drives.
        collided: How many drives had a collision at fault.
        braked: How many had an emergency brake.
    """

    subject: str
    name: str
    slug: str = ""
    model: str = ""
    variant: str = ""
    is_simulated: bool = False
    drives: int
    failed: int
    mean: float | None
    before: float | None
    by_type: dict[str, float | None]
    collided: int
    braked: int

    @property
    def lowered(self) -> float | None:
        """By how much the change lowered the score, 0 to 1."""
        if self.mean is None or self.before is None:
            return None
        return self.before - self.mean


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivingScores:
    """The table.

    Attributes:
        lines: The unmodified scenes, the reference, then contestants by how much they lower the
            score, the most first.
        under_way: How many drives wait or run.
        failures: Why drives failed, with how often.
    """

    score: str
    options: Options
    lines: tuple[DrivingLine, ...]
    total: int
    under_way: int
    failures: tuple[tuple[str, int], ...]
    codes: dict[int, str]

    @property
    def done(self) -> int:
        """How many have an outcome."""
        return self.total - self.under_way


def scores_of_job(job: GenerationJob, *, options: Options, score: str) -> DrivingScores:
    """The table of a job; one query for its drives."""
    return _scores(_of_job(job), options, score)


def scores_of_augmentations(
    ids: Collection[int], *, options: Options, score: str
) -> DrivingScores:
    """The table of the augmentations with these keys, with their scenes."""
    scenarios = Scenario.objects.filter(augmentations__in=ids)
    return _scores(
        Q(augmentation__in=ids) | Q(augmentation=None, scenario__in=scenarios), options, score
    )


def options_driven(job: GenerationJob) -> list[Options]:
    """Every way in which drives of a job were asked for, the latest first."""
    found = (
        Simulation.objects.filter(_of_job(job))
        .order_by("-pk")
        .values_list("planner", "offsets", "is_reactive")
    )
    return [
        Options(planner=planner, offsets=offsets, is_reactive=reactive)
        for planner, offsets, reactive in dict.fromkeys(found)
    ]


# Private


def _of_job(job: GenerationJob) -> Q:
    """Its results, and its scenes before the change and with the reference."""
    return Q(augmentation__job=job) | Q(augmentation=None, scenario__in=job.scenarios.all())


def _scores(which: Q, options: Options, score: str) -> DrivingScores:
    rows = list(_rows(options.of(Simulation.objects.filter(which))))
    under_way = [row for row in rows if row.state in Simulation.UNDER_WAY]
    before = {
        row.scenario_id: getattr(row, SCORES[score])
        for row in rows
        if row.subject == Subject.UNMODIFIED and row.state == State.DONE
    }
    cells: defaultdict[tuple[str, int], list[Simulation]] = defaultdict(list)
    for row in rows:
        who = 0 if row.augmentation is None else row.augmentation.contestant_id
        cells[row.subject, who].append(row)
    own = {row.scenario.type for row in rows} - set(Scenario.Type.values)
    kinds = (*Scenario.Type.values, *sorted(own))
    lines = [_line(cell, before, score, kinds) for cell in cells.values()]
    return DrivingScores(
        score=score,
        options=options,
        lines=tuple(sorted(lines, key=_place)),
        total=len(rows),
        under_way=len(under_way),
        failures=_failures(rows),
        codes={row.augmentation_id: str(row.code) for row in rows if row.augmentation_id},
    )


def _rows(found: QuerySet[Simulation]) -> QuerySet[Simulation]:
    return (
        found.select_related("scenario", "augmentation__contestant")
        .only(
            "code", "state", "reason", "subject", "nuplan_score", "interplan_score", "document",
            "scenario__type", "augmentation__contestant__name", "augmentation__contestant__slug",
            "augmentation__contestant__model", "augmentation__contestant__variant",
            "augmentation__contestant__kind",
        )
        .order_by("pk")
    )  # fmt: skip


def _line(
    cell: list[Simulation], before: dict[int, float], score: str, kinds: Sequence[str]
) -> DrivingLine:
    done = [row for row in cell if row.state == State.DONE]
    paired = [row for row in done if row.scenario_id in before]
    first = cell[0]
    contestant = None if first.augmentation is None else first.augmentation.contestant
    values = {row.pk: float(getattr(row, SCORES[score])) for row in paired}
    return DrivingLine(
        subject=first.subject,
        name=first.get_subject_display() if contestant is None else contestant.name,
        slug="" if contestant is None else contestant.slug,
        model="" if contestant is None else contestant.model,
        variant="" if contestant is None else contestant.variant,
        is_simulated=contestant is not None and contestant.is_simulated,
        drives=len(paired),
        failed=sum(row.state == State.FAILED for row in cell),
        mean=_mean(values.values()),
        before=_mean(before[row.scenario_id] for row in paired),
        by_type={
            kind: _mean(values[row.pk] for row in paired if row.scenario.type == kind)
            for kind in kinds
        },
        collided=sum(_collided(row) for row in paired),
        braked=sum(bool((row.document or {}).get("emergency_brake_steps")) for row in paired),
    )


def _collided(row: Simulation) -> bool:
    return any(one["at_fault"] for one in (row.document or {}).get("collisions", ()))


def _place(line: DrivingLine) -> tuple[int, float, str]:
    order = [Subject.UNMODIFIED, Subject.REFERENCE, Subject.AUGMENTATION]
    lowered = line.lowered if line.lowered is not None else -2.0
    return order.index(Subject(line.subject)), -lowered, line.name.lower()


def _mean(values: Iterable[float]) -> float | None:
    found = list(values)
    return sum(found) / len(found) if found else None


def _failures(rows: list[Simulation]) -> tuple[tuple[str, int], ...]:
    counts: defaultdict[str, int] = defaultdict(int)
    for row in rows:
        if row.state == State.FAILED:
            counts[row.reason] += 1
    return tuple(sorted(counts.items(), key=lambda item: (-item[1], item[0])))
