"""What a job says about its contestants beyond boxes: pairs, wordings, refusals.

In: the rows of a job, measured. Out: values of `augment.metrics`, by contestant.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from statistics import fmean, median

from django.db.models import Q

from augment.checks import Severity
from augment.errors import InvalidDocument, InvalidModification
from augment.metrics.displacement import Displacement
from augment.metrics.paired import (
    PairedComparison,
    RefusalScore,
    Robustness,
    SampleSpread,
    compare_all,
    measure_robustness,
    score_refusals,
    spread_of,
    within_sd,
)
from augment.models import Augmentation, Contestant, GenerationJob
from augment.services.endpoints.known_models import AUGMENTATION, Spending, sum_spending
from augment.services.judging.displacement import Measured, of_job
from augment.services.judging.findings import findings_of

__all__ = [
    "ContestantAnalysis",
    "JobAnalysis",
    "PairedComparison",
    "RefusalScore",
    "RepeatLine",
    "Robustness",
    "SampleSpread",
    "analyse_job",
    "analyse_measured",
    "repeatability",
]

State = Augmentation.State

SEED = 2026


@dataclass(frozen=True, slots=True, kw_only=True)
class ContestantAnalysis:
    """One contestant.

    Attributes:
        refusals: None where no scenario of the job says whether its wish can be met.
        robustness: None where no scenario has two wordings that were measured.
    """

    slug: str
    name: str
    is_simulated: bool
    refusals: RefusalScore | None
    robustness: Robustness | None


@dataclass(frozen=True, slots=True, kw_only=True)
class JobAnalysis:
    """All contestants, and every pair of them.

    Attributes:
        seed: Of the bootstrap.
    """

    contestants: tuple[ContestantAnalysis, ...]
    pairs: tuple[PairedComparison, ...]
    seed: int

    @property
    def refusing(self) -> tuple[ContestantAnalysis, ...]:
        """Those with wishes that can't be met, or who refused."""
        return tuple(
            one
            for one in self.contestants
            if one.refusals is not None
            and (one.refusals.right or one.refusals.wrong or one.refusals.overlooked)
        )

    @property
    def reworded(self) -> tuple[ContestantAnalysis, ...]:
        """Those who answered some wish in several wordings."""
        return tuple(one for one in self.contestants if one.robustness is not None)


def analyse_job(job: GenerationJob, *, seed: int = SEED) -> JobAnalysis:
    """Everything about a job; one query."""
    return analyse_measured(of_job(job), seed=seed)


def analyse_measured(measured: Sequence[Measured], *, seed: int = SEED) -> JobAnalysis:
    """Everything about some measured rows.

    A scenario's value is the median over its samples of the mean displacement of their matched
    objects; a sample with none has no value. The reference itself is no contestant here.
    """
    by_contestant: defaultdict[str, list[Measured]] = defaultdict(list)
    for one in measured:
        if one.row.contestant.kind != Contestant.Kind.REFERENCE:
            by_contestant[one.row.contestant.slug].append(one)
    return JobAnalysis(
        contestants=tuple(_analysed(slug, by_contestant[slug]) for slug in sorted(by_contestant)),
        pairs=compare_all(
            {slug: values_of(found) for slug, found in by_contestant.items()}, seed=seed
        ),
        seed=seed,
    )


def values_of(measured: Sequence[Measured]) -> dict[str, float]:
    """By scenario the median over samples of the mean displacement in metres."""
    samples: defaultdict[str, list[float]] = defaultdict(list)
    for one in measured:
        if one.displacement is not None and one.displacement.matches:
            samples[one.row.scenario.slug].append(fmean(one.displacement.distances_m))
    return {slug: median(found) for slug, found in sorted(samples.items())}


# Private


def _analysed(slug: str, measured: Sequence[Measured]) -> ContestantAnalysis:
    contestant = measured[0].row.contestant
    values = values_of(measured)
    original = {
        one.row.scenario.slug: one.row.scenario.paraphrase_of_id or one.row.scenario.pk
        for one in measured
    }
    wordings: defaultdict[str, list[float]] = defaultdict(list)
    for scenario, value in values.items():
        wordings[str(original[scenario])].append(value)
    judged = [
        (one.row.state == State.REFUSED, bool((one.row.scenario.intent or {}).get("unmet")))
        for one in measured
        if one.row.state in Augmentation.SHOWABLE and one.row.scenario.intent is not None
    ]
    return ContestantAnalysis(
        slug=slug,
        name=contestant.name,
        is_simulated=contestant.is_simulated,
        refusals=score_refusals(judged) if judged else None,
        robustness=measure_robustness(wordings),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class AugmentationLine:
    """One augmentation.

    Attributes:
        displacement: None where nothing can be measured.
        spending: None where no model was asked.
        wrong, doubtful: Findings of the checks, None where nothing was checked.
    """

    row: Augmentation
    displacement: Displacement | None
    spending: Spending | None
    wrong: int | None = None
    doubtful: int | None = None


def augmentation_lines(
    job: GenerationJob, *, with_checks: bool = True
) -> Iterator[AugmentationLine]:
    """Every row of a job, by scenario, contestant and sample; three queries.

    Args:
        job: Whose rows.
        with_checks: Whether the checks are run, which takes some milliseconds a row.
    """
    spent = sum_spending(Q(attempt__augmentation__job=job), by=AUGMENTATION)
    scenes = {}
    if with_checks:
        rows = job.augmentations.select_related("scenario__base_scene")
        scenes = {row.pk: row for row in rows.defer("scenario__base_scene__recording")}
    for one in of_job(job):
        wrong, doubtful = _faults(scenes[one.row.pk]) if with_checks else (None, None)
        yield AugmentationLine(
            row=one.row,
            displacement=one.displacement,
            spending=spent.get(one.row.pk),
            wrong=wrong,
            doubtful=doubtful,
        )


# --- Private -----------------------------------------------------------------------------------


def _faults(row: Augmentation) -> tuple[int, int] | tuple[None, None]:
    if row.modification is None or row.state != Augmentation.State.DONE:
        return None, None
    try:
        found = [one.severity for one in findings_of(row)]
    except (InvalidDocument, InvalidModification):
        return None, None
    return found.count(Severity.WRONG), found.count(Severity.DOUBTFUL)


MISSES = (Augmentation.State.UNREADABLE, Augmentation.State.REFUSED)


@dataclass(frozen=True, slots=True, kw_only=True)
class RepeatLine:
    """One contestant; each spread has a value for each sample. None is unknown, never zero.

    Attributes:
        displacement_m: The mean over the sample's matched objects.
        within_m: The pooled standard deviation, within a scenario, of its mean displacement.
        missed: The share of the sample's answers that were unreadable or refused.
        usd: What the sample cost; None where no model was asked or a price is unknown.
        wrong: Findings that are wrong for each augmentation that was checked.
    """

    slug: str
    name: str
    is_simulated: bool
    displacement_m: SampleSpread | None
    within_m: float | None
    missed: SampleSpread | None
    usd: SampleSpread | None
    wrong: SampleSpread | None

    @property
    def missed_percent(self) -> SampleSpread | None:
        """The share in percent, for people."""
        if self.missed is None:
            return None
        return spread_of([100.0 * value for value in self.missed.values])


def repeatability(job: GenerationJob, *, with_checks: bool = True) -> tuple[RepeatLine, ...]:
    """A line for each contestant of a job, by slug; rows that are under way or failed are out."""
    found: dict[str, list[AugmentationLine]] = defaultdict(list)
    for line in augmentation_lines(job, with_checks=with_checks):
        if line.row.state in Augmentation.SHOWABLE:
            found[line.row.contestant.slug].append(line)
    return tuple(_line(lines) for _, lines in sorted(found.items()))


# --- Private -----------------------------------------------------------------------------------


def _line(lines: Sequence[AugmentationLine]) -> RepeatLine:
    by_sample: dict[int, list[AugmentationLine]] = defaultdict(list)
    by_scenario: dict[int, list[float]] = defaultdict(list)
    for line in lines:
        by_sample[line.row.sample].append(line)
        distances = _distances([line])
        if distances:
            by_scenario[line.row.scenario_id].append(sum(distances) / len(distances))
    samples = [by_sample[number] for number in sorted(by_sample)]
    who = lines[0].row.contestant
    return RepeatLine(
        slug=who.slug,
        name=who.name,
        is_simulated=who.is_simulated,
        displacement_m=_spread(_mean(_distances(sample)) for sample in samples),
        within_m=within_sd(by_scenario.values()),
        missed=_spread(
            _mean([float(one.row.state in MISSES) for one in sample]) for sample in samples
        ),
        usd=_spread(_usd(sample) for sample in samples),
        wrong=_spread(
            _mean([float(one.wrong) for one in sample if one.wrong is not None])
            for sample in samples
        ),
    )


def _spread(values: Iterable[float | None]) -> SampleSpread | None:
    """None where a sample has no value: the rest would be another comparison."""
    known = list(values)
    return None if None in known else spread_of([one for one in known if one is not None])


def _distances(lines: Iterable[AugmentationLine]) -> list[float]:
    return [
        value
        for line in lines
        if line.displacement is not None
        for value in line.displacement.distances_m
    ]


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None


def _usd(lines: Iterable[AugmentationLine]) -> float | None:
    asked = [line.spending for line in lines if line.spending is not None]
    known = [one.usd for one in asked if one.usd is not None]
    return sum(known) if asked and len(known) == len(asked) else None
