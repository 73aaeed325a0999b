"""Several planners on the drives of one job: means, differences, sets, by contestant."""

from collections import Counter
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from string import ascii_lowercase as LETTERS

from django.db.models import Q

from augment.errors import Conflict, UnknownName
from augment.metrics import paired
from augment.models import Contestant, GenerationJob, Simulation
from augment.services.driving.driving_scores import drives_of_job, options_driven
from augment.services.driving.simulations import SCORES, Options

Subject = Simulation.Subject


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerLine:
    """One planner on the scenes of one contestant, or on those without any; or a difference.

    Attributes:
        against: Of a difference, first minus second, the second planner.
        sets: Of a mean, the letters of the sets that it is in; "a" is the set of the best.
        p_holm: Of a difference, adjusted for all of the table.
    """

    name: str
    contestant: Contestant | None
    planner: str
    estimate: paired.ClusteredMean
    against: str = ""
    sets: str = ""
    p_holm: float | None = None

    @property
    def is_simulated(self) -> bool:
        """True if its contestant is simulated."""
        return self.contestant is not None and self.contestant.is_simulated


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerTable:
    """The table of a job.

    Attributes:
        groups: For each contestant, the unmodified scenes and the reference first: a line a
            planner, then the differences of all pairs of planners.
    """

    title: str
    score: str
    version: int
    planners: tuple[str, ...]
    groups: tuple[tuple[PlannerLine, ...], ...]


def ways_to_compare(job: GenerationJob, specs: Sequence[str] = ()) -> list[Options]:
    """Return the ways of the newest version in which a job was driven.

    Args:
        job: Whose results were driven.
        specs: Only these, replayed: a planner, or a planner:offsets; by default all.

    Raises:
        Conflict: Fewer than two are left.
        UnknownName: The job was not driven by one of them.
    """
    driven = options_driven(drives_of_job(job))
    newest = max((way.version for way in driven), default=0)
    ways = {way.name: way for way in reversed(driven) if way.version == newest}
    if specs:
        chosen = []
        for planner, _, offsets in (spec.partition(":") for spec in dict.fromkeys(specs)):
            way = Options(planner=planner, offsets=offsets or Options().offsets, version=newest)
            if way.name not in ways:
                raise UnknownName("planner that drove the job", way.name, list(ways))
            chosen.append(ways[way.name])
        ways = {way.name: way for way in chosen}
    if len(ways) < 2:
        raise Conflict(f"“{job.name}” was not driven by two planners; manage.py simulate does it.")
    return list(ways.values())


def compare_job(
    job: GenerationJob, *, score: str, options: Sequence[Options] | None = None
) -> PlannerTable:
    """Return the planners of a job beside each other; as `ways_to_compare`."""
    ways = ways_to_compare(job) if options is None else options
    who: dict[int, Contestant | None] = {}
    cells: dict[tuple[Subject, int], dict[str, dict[Hashable, tuple[Hashable, float]]]] = {}
    for way in ways:
        done = Simulation.objects.filter(drives_of_job(job) & Q(state=Simulation.State.DONE))
        rows = way.of(done).select_related("augmentation__contestant", "scenario")
        for row in rows.defer("document", "trace", "scenario__reference", "scenario__intent"):
            contestant = row.augmentation.contestant if row.augmentation else None
            cell = (Subject(row.subject), contestant.pk if contestant else 0)
            who[cell[1]] = contestant
            key = row.augmentation_id or row.scenario_id
            drives = cells.setdefault(cell, {}).setdefault(way.name, {})
            drives[key] = (row.scenario.base_scene_id, float(getattr(row, SCORES[score])))
    order = [Subject.UNMODIFIED, Subject.REFERENCE, Subject.AUGMENTATION]
    placed = sorted(cells, key=lambda cell: (order.index(cell[0]), str(who[cell[1]]), cell[1]))
    compared = paired.compare_planners([cells[cell] for cell in placed])
    return PlannerTable(
        title=job.name,
        score=score,
        version=ways[0].version,
        planners=tuple(way.name for way in ways),
        groups=tuple(
            _lines(subject, who[pk], cells[subject, pk], differences)
            for (subject, pk), differences in zip(placed, compared, strict=True)
        ),
    )


def _lines(
    subject: Subject,
    contestant: Contestant | None,
    scores: Mapping[str, paired.Scores],
    differences: Sequence[paired.PlannerDifference],
) -> tuple[PlannerLine, ...]:
    means = {planner: paired.estimate_score(drives) for planner, drives in scores.items()}
    # Who is told apart comes first by that: a mean may be of fewer, easier drives.
    apart = [one for one in differences if one.is_apart]
    behind = Counter(one.second if one.estimate.mean > 0.0 else one.first for one in apart)
    ranked = sorted(means, key=lambda planner: (behind[planner], -means[planner].mean))
    sets = paired.find_sets(ranked, apart)
    name = contestant.name if contestant else str(subject.label)
    line = partial(PlannerLine, name=name, contestant=contestant)

    def letters(planner: str) -> str:
        return "".join(sign for sign, one in zip(LETTERS, sets, strict=False) if planner in one)

    return (
        *(line(planner=who, estimate=mean, sets=letters(who)) for who, mean in means.items()),
        *(
            line(planner=one.first, against=one.second, estimate=one.estimate, p_holm=one.p_holm)
            for one in differences
        ),
    )
