"""What the rows of a job say of its contestants: lines, repeats, pairs, wordings, refusals."""

from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from statistics import fmean, median

from django.db.models import Q

from augment.checks import Severity
from augment.metrics import paired
from augment.metrics.displacement import Displacement
from augment.models import Augmentation, Contestant, GenerationJob
from augment.services.endpoints.known_models import AUGMENTATION, Spending, sum_spending
from augment.services.judging.displacement import Measured, of_job
from augment.services.judging.findings import find_readable

State = Augmentation.State

SEED = 2026
MISSES = (State.UNREADABLE, State.REFUSED)


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
    refusals: paired.RefusalScore | None
    robustness: paired.Robustness | None


@dataclass(frozen=True, slots=True, kw_only=True)
class JobAnalysis:
    """All contestants, and every pair of them.

    Attributes:
        seed: Of the bootstrap.
    """

    contestants: tuple[ContestantAnalysis, ...]
    pairs: tuple[paired.PairedComparison, ...]
    seed: int

    @property
    def refusing(self) -> tuple[ContestantAnalysis, ...]:
        """Contestants with wishes that can't be met, or that refused."""
        return tuple(
            one
            for one in self.contestants
            if (score := one.refusals) and (score.right or score.wrong or score.overlooked)
        )

    @property
    def reworded(self) -> tuple[ContestantAnalysis, ...]:
        """Contestants that answered some wish in several wordings."""
        return tuple(one for one in self.contestants if one.robustness is not None)


@dataclass(frozen=True, slots=True, kw_only=True)
class AugmentationLine:
    """One augmentation with all that is measured of it.

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


@dataclass(frozen=True, slots=True, kw_only=True)
class RepeatLine:
    """What varies between one contestant's samples. None is unknown, never zero.

    Attributes:
        displacement_m: The mean over the sample's matched objects.
        within_m: The pooled standard deviation, within a scenario, of its mean displacement.
        missed: The share of the sample's answers that were unreadable or refused.
        usd: What the sample cost; None where no model was asked or a price is unknown.
    """

    slug: str
    name: str
    is_simulated: bool
    displacement_m: paired.SampleSpread | None
    within_m: float | None
    missed: paired.SampleSpread | None
    usd: paired.SampleSpread | None

    @property
    def missed_percent(self) -> paired.SampleSpread | None:
        """The share in percent, for people."""
        if self.missed is None:
            return None
        return paired.spread_of([100.0 * value for value in self.missed.values])


def analyse_job(job: GenerationJob, *, seed: int = SEED) -> JobAnalysis:
    """Analyse the contestants of a job but for the reference; one query.

    A scenario's value is the median over its samples of the mean displacement of their matched
    objects; a sample with none has no value.
    """
    by_contestant: defaultdict[str, list[Measured]] = defaultdict(list)
    for one in of_job(job):
        if one.row.contestant.kind != Contestant.Kind.REFERENCE:
            by_contestant[one.row.contestant.slug].append(one)
    values = {slug: _values_of(measured) for slug, measured in by_contestant.items()}
    return JobAnalysis(
        contestants=tuple(
            _analyse(measured, values[slug]) for slug, measured in sorted(by_contestant.items())
        ),
        pairs=paired.compare_all(values, seed=seed),
        seed=seed,
    )


def augmentation_lines(job: GenerationJob) -> Iterator[AugmentationLine]:
    """Yield every row of a job, by scenario, contestant and sample; three queries."""
    rows = job.augmentations.select_related("scenario__base_scene")
    scenes = {row.pk: row for row in rows.defer("scenario__base_scene__recording")}
    for line in _lines(job):
        findings = find_readable(scenes[line.row.pk])
        if findings is not None:
            counts = Counter(finding.severity for finding in findings)
            wrong, doubtful = counts[Severity.WRONG], counts[Severity.DOUBTFUL]
            line = replace(line, wrong=wrong, doubtful=doubtful)
        yield line


def repeatability(job: GenerationJob) -> tuple[RepeatLine, ...]:
    """Return a line for each contestant, by slug; rows under way or failed don't count."""
    by_contestant: dict[str, list[AugmentationLine]] = defaultdict(list)
    for line in _lines(job):
        if line.row.state in Augmentation.SHOWABLE:
            by_contestant[line.row.contestant.slug].append(line)
    return tuple(_repeat_line(lines) for _, lines in sorted(by_contestant.items()))


# --- Private -----------------------------------------------------------------------------------


def _lines(job: GenerationJob) -> Iterator[AugmentationLine]:
    """Yield every row of a job with its displacement and cost, unchecked."""
    spent = sum_spending(Q(attempt__augmentation__job=job), by=AUGMENTATION)
    for one in of_job(job):
        spending = spent.get(one.row.pk)
        yield AugmentationLine(row=one.row, displacement=one.displacement, spending=spending)


def _values_of(measured: Sequence[Measured]) -> dict[str, float]:
    """Return by scenario the median over samples of the mean displacement in metres."""
    samples: defaultdict[str, list[float]] = defaultdict(list)
    for one in measured:
        if one.displacement is not None and one.displacement.matches:
            samples[one.row.scenario.slug].append(fmean(one.displacement.distances_m))
    return {slug: median(values) for slug, values in sorted(samples.items())}


def _analyse(measured: Sequence[Measured], values: dict[str, float]) -> ContestantAnalysis:
    contestant = measured[0].row.contestant
    scenarios = {one.row.scenario.slug: one.row.scenario for one in measured}
    wordings: defaultdict[str, list[float]] = defaultdict(list)
    for slug, value in values.items():
        wordings[str(scenarios[slug].paraphrase_of_id or scenarios[slug].pk)].append(value)
    answered = [
        (one.row.state == State.REFUSED, bool((one.row.scenario.intent or {}).get("unmet")))
        for one in measured
        if one.row.state in Augmentation.SHOWABLE and one.row.scenario.intent is not None
    ]
    return ContestantAnalysis(
        slug=contestant.slug,
        name=contestant.name,
        is_simulated=contestant.is_simulated,
        refusals=paired.score_refusals(answered) if answered else None,
        robustness=paired.measure_robustness(wordings),
    )


def _repeat_line(lines: Sequence[AugmentationLine]) -> RepeatLine:
    by_sample: dict[int, list[AugmentationLine]] = defaultdict(list)
    by_scenario: dict[int, list[float]] = defaultdict(list)
    for line in lines:
        by_sample[line.row.sample].append(line)
        if line.displacement is not None and line.displacement.mean_m is not None:
            by_scenario[line.row.scenario_id].append(line.displacement.mean_m)
    samples = [by_sample[number] for number in sorted(by_sample)]
    contestant = lines[0].row.contestant
    return RepeatLine(
        slug=contestant.slug,
        name=contestant.name,
        is_simulated=contestant.is_simulated,
        displacement_m=_spread([_distance_m(sample) for sample in samples]),
        within_m=paired.within_sd(by_scenario.values()),
        missed=_spread([fmean(line.row.state in MISSES for line in one) for one in samples]),
        usd=_spread([_usd(sample) for sample in samples]),
    )


def _spread(values: Sequence[float | None]) -> paired.SampleSpread | None:
    """Return None where a sample has no value: the rest would be another comparison."""
    known = [value for value in values if value is not None]
    return paired.spread_of(known) if len(known) == len(values) else None


def _distance_m(lines: Sequence[AugmentationLine]) -> float | None:
    measured = [line.displacement.distances_m for line in lines if line.displacement is not None]
    distances_m = list(chain.from_iterable(measured))
    return fmean(distances_m) if distances_m else None


def _usd(lines: Sequence[AugmentationLine]) -> float | None:
    costs = [line.spending.usd for line in lines if line.spending is not None]
    known = [cost for cost in costs if cost is not None]
    return sum(known) if costs and len(known) == len(costs) else None
