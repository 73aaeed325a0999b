"""The report on a submission: a JSON document and back, exactly, and lines for a terminal."""

from collections import Counter
from collections.abc import Iterator
from typing import Any

from pydantic import TypeAdapter

from augment.benchmark.values import EntryStatus, SubmissionCard, SubmissionReport, SubmittedEntry
from augment.metrics.displacement import Displacement, OverTime, Summary, summarise
from augment.scene.motion import HORIZON_S
from augment.scene.schema import Codec

CARD = Codec("submission card", TypeAdapter(SubmissionCard))
_REPORT = Codec("submission report", TypeAdapter(SubmissionReport))


def report_to_document(report: SubmissionReport) -> dict[str, Any]:
    """Return the JSON document of a report; equal reports have equal documents."""
    return _REPORT.to_document(report)


def report_from_document(document: object) -> SubmissionReport:
    """Return the report that a document describes.

    Raises:
        InvalidDocument: It breaks the format, with every place.
    """
    return _REPORT.from_document(document)


def count_statuses(report: SubmissionReport) -> dict[EntryStatus, int]:
    """Return how many entries have each status, those with none included."""
    counts = Counter(entry.status for entry in report.entries)
    return {status: counts[status] for status in EntryStatus}


def summarise_practice(report: SubmissionReport) -> Summary:
    """Return the displacement over all entries of the practice split."""
    return summarise(
        [entry.displacement for entry in report.entries if entry.displacement is not None]
    )


def describe_report(report: SubmissionReport) -> Iterator[str]:
    """Yield a line for each entry with its notes, then the summary."""
    longest = max((len(_label(entry)) for entry in report.entries), default=0)
    for entry in report.entries:
        cells = (entry.file, _describe_displacement(entry.displacement), entry.reason)
        shown = "  ".join(cell for cell in cells if cell)
        yield f"{_label(entry):<{longest}}  {entry.status.value:<10}  {shown}".rstrip()
        yield from (f"    {note}" for note in entry.notes)
    yield ""
    yield f"{report.card.name}, for {report.benchmark} {report.version} ({report.checksum[:12]})"
    counts = count_statuses(report).items()
    yield ", ".join(f"{count} {status.value}" for status, count in counts)
    practice = summarise_practice(report)
    if practice.augmentations:
        mean = "nothing matched" if practice.box is None else f"mean {practice.box.mean_m!r} m"
        yield (
            f"Displacement on practice: {mean}, {practice.n} matched, {practice.missing} missing, "
            f"{practice.surplus} surplus" + _describe_over_time(practice.over_time)
        )
    yield from report.remarks


# Private


def _label(entry: SubmittedEntry) -> str:
    return entry.task if entry.sample == 1 else f"{entry.task}--{entry.sample}"


def _describe_displacement(distance: Displacement | None) -> str:
    if distance is None:
        return ""
    mean = "" if distance.mean_m is None else f"{distance.mean_m!r} m, "
    counts = f"{mean}{len(distance.missing)} missing, {len(distance.surplus)} surplus"
    return counts + _describe_over_time(distance.over_time)


def _describe_over_time(over_time: OverTime | None) -> str:
    if over_time is None:
        return ""
    return (
        f", moving: {over_time.at_t0_m!r} m at t0, {over_time.final_m!r} m after {HORIZON_S:g} s"
    )
