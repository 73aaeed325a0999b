"""What a job says about its contestants beyond boxes: pairs, wordings, refusals.

In: the rows of a job, measured. Out: values of `augment.metrics`, by contestant.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean, median

from augment.metrics.paired import (
    PairedComparison,
    RefusalScore,
    Robustness,
    compare_all,
    measure_robustness,
    score_refusals,
)
from augment.models import Augmentation, Contestant, GenerationJob
from augment.services.judging.displacement import Measured, of_job

__all__ = [
    "ContestantAnalysis",
    "JobAnalysis",
    "PairedComparison",
    "RefusalScore",
    "Robustness",
    "analyse_job",
    "analyse_measured",
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
