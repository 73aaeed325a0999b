"""What varies between the samples of a job: a line a contestant."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from augment.metrics.paired import SampleSpread, spread_of, within_sd
from augment.models import Augmentation, GenerationJob
from augment.services.judging.analyses import AugmentationLine, augmentation_lines

__all__ = ["RepeatLine", "SampleSpread", "repeatability"]

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
