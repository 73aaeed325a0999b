"""Mean driving scores: by contestant, by scenario type, beside the unmodified scenes."""

from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Any

from django.db.models import Q, QuerySet

from augment.models import Contestant, GenerationJob, NuplanResult, Scenario, Simulation
from augment.scene.entities import ScenarioType, in_type_order
from augment.services.driving.simulations import SCORES, Options

State, Subject = Simulation.State, Simulation.Subject
_NO_COLLISION = "no_ego_at_fault_collisions"
"""nuPlan's metric of collisions: 1 without one."""
CLOSE_M = 0.3
"""A least clearance below this is marked wherever a score is shown; the score does not ask."""

_COLUMNS = (
    *("state", "reason", "subject", "nuplan_score", "interplan_score", "document"),
    *("scenario__type", "augmentation__contestant__name", "augmentation__contestant__slug"),
    *("augmentation__contestant__model", "augmentation__contestant__variant"),
    "augmentation__contestant__kind",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivingLine:
    """The mean score of one contestant, or of the scenes without any.

    Attributes:
        contestant: None for the scenes before the change and the references.
        driven_by: The planner that drove it in nuPlan itself, empty for drives of ours. Such a
            line has a mean and nothing before the change.
        drives: How many count: those whose scene was also driven before the change.
        failed: How many could not be driven.
        mean: 0 to 1, None without drives.
        before: The mean of the same scenes before the change; None without.
        by_type: The mean by scenario type, in the catalogue's order, None without drives.
        least_clearance_m: The smallest of its drives; None where nobody else was there.
        close: How many drives came closer to somebody than `CLOSE_M`; None where nobody says.
        collided: How many drives had a collision at fault.
        braked: How many had an emergency brake; None where nobody says.
    """

    subject: str
    name: str
    contestant: Contestant | None
    drives: int
    failed: int
    mean: float | None
    before: float | None = None
    by_type: dict[str, float | None]
    least_clearance_m: float | None = None
    close: int | None = None
    collided: int
    braked: int | None = None
    driven_by: str = ""

    @property
    def is_simulated(self) -> bool:
        """True if its contestant is simulated."""
        return self.contestant is not None and self.contestant.is_simulated

    @property
    def lowered(self) -> float | None:
        """Loss of score due to the change, 0 to 1."""
        if self.mean is None or self.before is None:
            return None
        return self.before - self.mean


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivingScores:
    """The table of a job or a study.

    Attributes:
        title: Its name.
        lines: The unmodified scenes, the reference, then contestants by how much they lower the
            score, the most first; behind them what was driven in nuPlan.
        under_way: How many drives wait or run.
        failures: Why drives failed, with how often.
        outlasting: How many drives went on after the end of their recording.
        longest_s: How long one is let last: 30 s where scenarios go by interPlan's rules.
    """

    title: str
    score: str
    options: Options
    lines: tuple[DrivingLine, ...]
    total: int
    under_way: int
    failures: tuple[tuple[str, int], ...]
    outlasting: int
    longest_s: int

    @property
    def done(self) -> int:
        """Number of rows with an outcome."""
        return self.total - self.under_way

    @property
    def types(self) -> list[str]:
        """The scenario types that were driven, in their order."""
        every = self.lines[0].by_type if self.lines else ()
        means = {kind: [line.by_type[kind] for line in self.lines] for kind in every}
        return [kind for kind, values in means.items() if any(mean is not None for mean in values)]


def scores_of_job(
    job: GenerationJob, *, options: Options | None = None, score: str
) -> DrivingScores:
    """Return the table of a job; three queries.

    Args:
        job: Whose results were driven.
        options: How they were driven; None for the way in which they were driven last.
        score: One of `SCORES`.
    """
    options = options or next(iter(options_driven(drives_of_job(job))), Options())
    results = NuplanResult.objects.filter(augmentation__job=job, rules=score)
    return _scores(job.name, drives_of_job(job), results, options, score)


def scores_of_augmentations(
    ids: Collection[int], *, title: str, options: Options, score: str
) -> DrivingScores:
    """Return the table of the augmentations with these keys, with their scenes."""
    scenarios = Scenario.objects.filter(augmentations__in=ids)
    scenes = Simulation.OF_SCENES & Q(scenario__in=scenarios)
    results = NuplanResult.objects.filter(augmentation__in=ids, rules=score)
    return _scores(title, Q(augmentation__in=ids) | scenes, results, options, score)


def drives_of_job(job: GenerationJob) -> Q:
    """Return a filter for its results, and its scenes before the change and as referred to."""
    scenes = Simulation.OF_SCENES & Q(scenario__in=job.scenarios.all())
    return Q(augmentation__job=job) | scenes


def least_clearance_m(row: Simulation) -> float | None:
    """Return how near the ego of a drive came to anybody; None without a drive or others."""
    distance: float | None = _document(row).get("criticality", {}).get("least_distance_m")
    return distance


def clearance_text(least_distance_m: float | None) -> str:
    """Return the least clearance of a drive in words, marked where it is below `CLOSE_M`.

    Args:
        least_distance_m: Between the ego's body and the nearest other; None where nobody was.
    """
    if least_distance_m is None:
        return "–"
    mark = f" (below {CLOSE_M:g} m)" if least_distance_m < CLOSE_M else ""
    return f"{least_distance_m:.2f} m{mark}"


def find_shown(which: Q) -> Options:
    """Return the last way of the paper's planner where it drove, else the last one."""
    ways = options_driven(which)
    return next((way for way in ways if way.name == Options().name), [*ways, Options()][0])


def options_driven(which: Q) -> list[Options]:
    """Return every way in which drives were asked for, the latest first."""
    rows = Simulation.objects.filter(which).order_by("-pk")
    ways = dict.fromkeys(rows.values_list("planner", "offsets", "is_reactive", "version"))
    return [
        Options(planner=planner, offsets=offsets, is_reactive=reactive, version=version)
        for planner, offsets, reactive, version in ways
    ]


# --- Private -----------------------------------------------------------------------------------


def _scores(
    title: str, which: Q, results: QuerySet[NuplanResult], options: Options, score: str
) -> DrivingScores:
    drives = options.of(Simulation.objects.filter(which))
    read = drives.select_related("scenario", "augmentation__contestant").only(*_COLUMNS)
    rows = list(read.order_by("pk"))
    before = {
        row.scenario_id: float(getattr(row, SCORES[score]))
        for row in rows
        if row.subject == Subject.UNMODIFIED and row.state == State.DONE
    }
    cells: defaultdict[tuple[str, int], list[Simulation]] = defaultdict(list)
    for row in rows:
        contestant = 0 if row.augmentation is None else row.augmentation.contestant_id
        cells[row.subject, contestant].append(row)
    elsewhere = list(results.select_related("augmentation__contestant", "augmentation__scenario"))
    types = [row.scenario.type for row in rows]
    types += [row.augmentation.scenario.type for row in elsewhere]
    kinds = in_type_order([*ScenarioType, *types])
    lines = [_line(cell, before, score, kinds) for cell in cells.values()]
    failures = Counter(row.reason for row in rows if row.state == State.FAILED)
    return DrivingScores(
        title=title,
        score=score,
        options=options,
        lines=(*sorted(lines, key=_place), *_nuplan_lines(elsewhere, kinds)),
        total=len(rows),
        under_way=sum(row.state in Simulation.UNDER_WAY for row in rows),
        failures=tuple(sorted(failures.items(), key=lambda item: (-item[1], item[0]))),
        outlasting=sum(bool(_document(row).get("outlasts_recording")) for row in rows),
        longest_s=30 if any(_document(row).get("duration_s", 0.0) > 15.0 for row in rows) else 15,
    )


def _line(
    cell: list[Simulation], before: Mapping[int, float], score: str, kinds: Iterable[str]
) -> DrivingLine:
    paired = [row for row in cell if row.state == State.DONE and row.scenario_id in before]
    scored = [(row.scenario.type, float(getattr(row, SCORES[score]))) for row in paired]
    clearances = [distance for row in paired if (distance := least_clearance_m(row)) is not None]
    collisions = [_document(row).get("collisions", ()) for row in paired]
    first = cell[0]
    who = None if first.augmentation is None else first.augmentation.contestant
    return DrivingLine(
        subject=first.subject,
        name=who.name if who else first.get_subject_display(),
        contestant=who,
        drives=len(paired),
        failed=sum(row.state == State.FAILED for row in cell),
        mean=_mean(scored),
        before=_mean([("", before[row.scenario_id]) for row in paired]),
        by_type={kind: _mean(scored, kind) for kind in kinds},
        least_clearance_m=min(clearances, default=None),
        close=sum(distance < CLOSE_M for distance in clearances),
        collided=sum(any(contact["at_fault"] for contact in drive) for drive in collisions),
        braked=sum(bool(_document(row).get("emergency_brake_steps")) for row in paired),
    )


def _nuplan_lines(results: Iterable[NuplanResult], kinds: Iterable[str]) -> Iterator[DrivingLine]:
    """Yield a line for each contestant and planner of nuPlan, by their names."""
    cells: defaultdict[tuple[str, str, str], list[NuplanResult]] = defaultdict(list)
    for row in results:
        contestant = row.augmentation.contestant
        cells[contestant.name.lower(), contestant.slug, row.planner].append(row)
    for (_, _, planner), cell in sorted(cells.items()):
        contestant = cell[0].augmentation.contestant
        done = [row for row in cell if row.score is not None]
        scored = [
            (row.augmentation.scenario.type, row.score) for row in cell if row.score is not None
        ]
        yield DrivingLine(
            subject=Subject.AUGMENTATION,
            name=f"{contestant.name}, driven in nuPlan by {planner}",
            contestant=contestant,
            drives=len(done),
            failed=len(cell) - len(done),
            mean=_mean(scored),
            by_type={kind: _mean(scored, kind) for kind in kinds},
            collided=sum(row.parts.get(_NO_COLLISION) not in (None, 1.0) for row in done),
            driven_by=planner,
        )


def _document(row: Simulation) -> dict[str, Any]:
    return row.document or {}


def _place(line: DrivingLine) -> tuple[int, float, str]:
    order = [Subject.UNMODIFIED, Subject.REFERENCE, Subject.AUGMENTATION]
    lowered = line.lowered if line.lowered is not None else -2.0
    return order.index(Subject(line.subject)), -lowered, line.name.lower()


def _mean(scored: Sequence[tuple[str, float]], kind: str | None = None) -> float | None:
    """Return the mean of scores with their scenarios' types, of one type or of all."""
    values = [score for own_kind, score in scored if kind in (None, own_kind)]
    return fmean(values) if values else None
