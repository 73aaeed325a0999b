"""Analyses of a job's rows by contestant: lines, repeats, pairs, wordings, refusals.

Rows of tables are dicts. None is unknown or undefined, never zero.
"""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from statistics import fmean, median, stdev
from typing import Any

from django.db.models import Q
from pydantic import TypeAdapter

from augment.checks import Finding, FindingKind, Severity
from augment.metrics import paired
from augment.models import Augmentation, Contestant, GenerationJob
from augment.services.endpoints.known_models import AUGMENTATION, Spending, sum_spending
from augment.services.judging.displacement import DISTANCES, WISHES, MeasuredRow, of_job
from augment.services.judging.findings import FINDINGS, read_findings
from augment.services.judging.measures import Measure, compute_once, digest_code, digest_rows
from augment.services.judging.realism import REALISM, realism_of_job

State = Augmentation.State
Row = dict[str, Any]
Answers = Mapping[str, Sequence[MeasuredRow]]
"""What each contestant answered, by its slug."""

SEED = 2026
"""Of the bootstrap."""
_ROW_MEASURES: tuple[Measure[Any], ...] = (REALISM, WISHES, DISTANCES, FINDINGS)
_PAIRS = TypeAdapter(tuple[paired.PairedComparison, ...])
_COMPARED = tuple(field.name for field in fields(paired.PairedComparison))[2:]
_PREFIXES = {"displacement": "", "wish": "wish_"}
"""Of keys of a row, by the distance that they are about."""
_AT_ONCE = 50
"""So many rows are measured before they are stored."""


@dataclass(frozen=True, kw_only=True)
class AugmentationLine(MeasuredRow):
    """One augmentation with all that is measured of it.

    Attributes:
        spending: None where no model was asked.
        wrong, doubtful: Findings of the checks, None where nothing was checked.
        purpose: Findings on the windows of an open wish.
    """

    spending: Spending | None
    wrong: int | None = None
    doubtful: int | None = None
    purpose: tuple[Finding, ...] = ()

    @property
    def serves(self) -> bool | None:
        """True if all that is measured of its purpose lies in the windows; None without any."""
        return not any(one.is_fault for one in self.purpose) if self.purpose else None

    @property
    def purpose_words(self) -> str | None:
        """What was measured of its purpose, and what was asked for."""
        return " ".join(one.sentence() for one in self.purpose) or None


def augmentation_lines(job: GenerationJob) -> Iterator[AugmentationLine]:
    """Yield every row of a job, by scenario, contestant and sample."""
    ids = list(job.augmentations.values_list("pk", flat=True))
    findings = read_findings(ids)
    for line in _lines(job):
        if line.row.pk in findings:
            counts = Counter(finding.severity for finding in findings[line.row.pk])
            wrong, doubtful = counts[Severity.WRONG], counts[Severity.DOUBTFUL]
            purpose = (one for one in findings[line.row.pk] if one.kind is FindingKind.PURPOSE)
            line = replace(line, wrong=wrong, doubtful=doubtful, purpose=tuple(purpose))
        yield line


def repeatability(job: GenerationJob) -> list[Row]:
    """Return the variation between each contestant's samples, of rows that have an outcome.

    The displacement of a sample is the mean over its matched objects, over time where something
    moves, as in all analyses; `within_m` is the pooled standard deviation, within a scenario, of
    its mean displacement. The distance to the wish is `wish_...`. `missed` is the share of answers
    that were unreadable or refused.
    """
    by_contestant: dict[str, list[AugmentationLine]] = defaultdict(list)
    for line in _lines(job):
        if line.row.state in Augmentation.SHOWABLE:
            by_contestant[line.row.contestant.slug].append(line)
    return [_repeat_line(lines) for _, lines in sorted(by_contestant.items())]


def count_unmeasured(job: GenerationJob) -> int:
    """Return how many rows of a job with an outcome lack a measure that still holds."""
    digests = digest_rows(job.augmentations.values_list("pk", flat=True))
    return max(measure.count_stale(digests) for measure in _ROW_MEASURES)


def measure_job(job: GenerationJob) -> None:
    """Measure what is not measured of a job; a second time nothing is left to do."""
    realism_of_job(job)  # which measures the scenes as well
    ids = list(job.augmentations.order_by("scenario").values_list("pk", flat=True))
    for start in range(0, len(ids), _AT_ONCE):
        for measure in _ROW_MEASURES:
            measure.of(ids[start : start + _AT_ONCE])
    compare_pairs(read_answers(job))  # whose bootstrap is kept as well


# --- Analyses ----------------------------------------------------------------------------------


def read_answers(job: GenerationJob) -> Answers:
    """Return all outcomes of a job, measured, but those of the reference; one query."""
    answers: defaultdict[str, list[MeasuredRow]] = defaultdict(list)
    for measured_row in of_job(job):
        is_reference = measured_row.row.contestant.kind == Contestant.Kind.REFERENCE
        if measured_row.row.state in Augmentation.SHOWABLE and not is_reference:
            answers[measured_row.row.contestant.slug].append(measured_row)
    return dict(sorted(answers.items()))


def compare_pairs(answers: Answers) -> list[Row]:
    """Compare all contestants with each other on the scenarios that both placed something in.

    A scenario's value is the median over its samples of the mean displacement of their matched
    objects, and of their distance to the wish (`wish_...`); None where no scenario has both.
    """
    names = [f"{prefix}{name}" for prefix in _PREFIXES.values() for name in _COMPARED]
    rows: defaultdict[tuple[str, str], Row] = defaultdict(lambda: dict.fromkeys(names))
    for distance, prefix in _PREFIXES.items():
        values = {slug: _median_errors(some, distance) for slug, some in answers.items()}
        compute = partial(_compare, values)
        for pair in _PAIRS.validate_json(compute_once("json", compute, digest_code(), values)):
            numbers = {f"{prefix}{name}": getattr(pair, name) for name in _COMPARED}
            rows[pair.first, pair.second] |= numbers
    return [{"first": pair[0], "second": pair[1], **row} for pair, row in sorted(rows.items())]


def measure_wordings(answers: Answers) -> list[Row]:
    """Return the spread within a wish of whoever answered some wish in several wordings."""
    lines = []
    for measured in answers.values():
        scenarios = {entry.row.scenario.slug: entry.row.scenario for entry in measured}
        line: Row = {}
        for distance, prefix in _PREFIXES.items():
            wishes: defaultdict[int, list[float]] = defaultdict(list)
            for slug, value in _median_errors(measured, distance).items():
                wishes[scenarios[slug].paraphrase_of_id or scenarios[slug].pk].append(value)
            several = [values for values in wishes.values() if len(values) > 1]
            line[f"{prefix}scenarios"] = len(several)
            line[f"{prefix}wordings"] = sum(map(len, several))
            line[f"{prefix}within_m"] = paired.within_sd(several)
        if line["wordings"] or line["wish_wordings"]:
            lines.append(_who(measured[0].row) | line)
    return lines


def count_refusals(answers: Answers) -> list[Row]:
    """Return how right the refusals were of whoever refused, or had to.

    Right ones are of wishes that can't be met; such a wish that was not refused is overlooked.
    Scenarios without an intent don't count.
    """
    lines = []
    for measured in answers.values():
        counts = Counter(
            (entry.row.state == State.REFUSED, bool(intent.get("unmet")))
            for entry in measured
            if (intent := entry.row.scenario.intent) is not None
        )
        right, wrong, overlooked = counts[True, True], counts[True, False], counts[False, True]
        if right or wrong or overlooked:
            line = {
                "right": right,
                "wrong": wrong,
                "overlooked": overlooked,
                "precision": right / (right + wrong) if right or wrong else None,
                "recall": right / (right + overlooked) if right or overlooked else None,
            }
            lines.append(_who(measured[0].row) | line)
    return lines


ANALYSES: Mapping[str, Callable[[Answers], Sequence[Any]]] = {
    "pairs": compare_pairs,
    "wordings": measure_wordings,
    "refusals": count_refusals,
}


# --- Private -----------------------------------------------------------------------------------


def _lines(job: GenerationJob) -> Iterator[AugmentationLine]:
    """Yield every row of a job with its displacement and cost, unchecked."""
    spent = sum_spending(Q(attempt__augmentation__job=job), by=AUGMENTATION)
    for entry in of_job(job):
        yield AugmentationLine(**vars(entry), spending=spent.get(entry.row.pk))


def _compare(values: Mapping[str, Mapping[str, float]]) -> bytes:
    return _PAIRS.dump_json(paired.compare_all(values, seed=SEED))


def _median_errors(measured: Sequence[MeasuredRow], distance: str) -> dict[str, float]:
    """Return by scenario the median over samples of the mean of a distance in metres."""
    samples: defaultdict[str, list[float]] = defaultdict(list)
    for entry in measured:
        found = getattr(entry, distance)
        if found is not None and found.matches:
            samples[entry.row.scenario.slug].append(fmean(found.errors_m))
    return {slug: median(values) for slug, values in sorted(samples.items())}


def _who(row: Augmentation) -> Row:
    who = row.contestant
    return {"contestant": who.slug, "name": who.name, "simulated": who.is_simulated}


def _repeat_line(lines: Sequence[AugmentationLine]) -> Row:
    by_sample: dict[int, list[AugmentationLine]] = defaultdict(list)
    for line in lines:
        by_sample[line.row.sample].append(line)
    samples = [by_sample[number] for number in sorted(by_sample)]
    missed = [
        fmean(line.row.state in Augmentation.MISSES for line in sample) for sample in samples
    ]
    row = {
        **_who(lines[0].row),
        "samples": len(samples),
        **_spread("missed", missed),
        **_spread("usd", [_usd(sample) for sample in samples]),
    }
    for distance, prefix in _PREFIXES.items():
        row |= _spread(f"{distance}_m", [_distance_m(sample, distance) for sample in samples])
        by_scenario: defaultdict[int, list[float]] = defaultdict(list)
        for line in lines:
            if (found := getattr(line, distance)) is not None and found.matches:
                by_scenario[line.row.scenario_id].append(found.mean_m)
        row[f"{prefix}within_m"] = paired.within_sd(by_scenario.values())
    return row


def _spread(name: str, values: Sequence[float | None]) -> Row:
    """Return mean, standard deviation and values of a measure, one a sample.

    None where a sample has no value: the rest would be another comparison.
    """
    present = [value for value in values if value is not None]
    if len(present) < len(values):
        return dict.fromkeys((f"{name}_mean", f"{name}_sd", f"{name}_values"))
    sd = stdev(present) if len(present) > 1 else None
    return {f"{name}_mean": fmean(present), f"{name}_sd": sd, f"{name}_values": tuple(present)}


def _distance_m(lines: Sequence[AugmentationLine], distance: str) -> float | None:
    measured = (getattr(line, distance) for line in lines)
    errors_m = [error for found in measured if found is not None for error in found.errors_m]
    return fmean(errors_m) if errors_m else None


def _usd(lines: Sequence[AugmentationLine]) -> float | None:
    costs = [line.spending.usd for line in lines if line.spending is not None]
    present = [cost for cost in costs if cost is not None]
    return sum(present) if costs and len(present) == len(costs) else None
