"""The report on a submission: a JSON document and back, exactly, and lines for a terminal."""

from collections import Counter
from collections.abc import Iterator

from pydantic import TypeAdapter

from augment.benchmark.values import EntryStatus, SubmissionCard, SubmissionReport, SubmittedEntry
from augment.metrics.displacement import Displacement, OverTime, Summary, summarise
from augment.scene.motion import HORIZON_S
from augment.scene.schema import Codec

CARD = Codec("submission card", TypeAdapter(SubmissionCard))
_REPORT = Codec("submission report", TypeAdapter(SubmissionReport))
report_to_document, report_from_document = _REPORT.to_document, _REPORT.from_document
DISTANCES = {"displacement": "Displacement", "wish": "Distance to the wish"}
"""Of an entry, in words."""


def count_statuses(report: SubmissionReport) -> dict[EntryStatus, int]:
    """Return how many entries have each status, those with none included."""
    counts = Counter(entry.status for entry in report.entries)
    return {status: counts[status] for status in EntryStatus}


def summarise_practice(report: SubmissionReport, distance: str = "displacement") -> Summary:
    """Return one of `DISTANCES` over all entries of the practice split that have it."""
    measured = [getattr(entry, distance) for entry in report.entries]
    return summarise([found for found in measured if found is not None])


def describe_report(report: SubmissionReport) -> Iterator[str]:
    """Yield a line for each entry with its notes, then the summary."""
    longest = max((len(_label(entry)) for entry in report.entries), default=0)
    for entry in report.entries:
        distances = (_describe(entry.displacement), _describe(entry.wish, "wish "))
        cells = (entry.file, *distances, entry.reason)
        shown = "  ".join(cell for cell in cells if cell)
        yield f"{_label(entry):<{longest}}  {entry.status.value:<10}  {shown}".rstrip()
        yield from (f"    {note}" for note in entry.notes)
    yield ""
    yield f"{report.card.name}, for {report.benchmark} {report.version} ({report.checksum[:12]})"
    counts = count_statuses(report).items()
    yield ", ".join(f"{count} {status.value}" for status, count in counts)
    for distance, words in DISTANCES.items():
        practice = summarise_practice(report, distance)
        if practice.augmentations:
            mean = "nothing matched" if practice.box is None else f"mean {practice.box.mean_m!r} m"
            yield (
                f"{words} on practice: {mean}, {practice.n} matched, {practice.missing} missing, "
                f"{practice.surplus} surplus" + _describe_over_time(practice.over_time)
            )
    yield from report.remarks


# Private


def _label(entry: SubmittedEntry) -> str:
    return entry.task if entry.sample == 1 else f"{entry.task}--{entry.sample}"


def _describe(distance: Displacement | None, what: str = "") -> str:
    if distance is None:
        return ""
    mean = "" if distance.mean_m is None else f"{distance.mean_m!r} m, "
    counts = f"{what}{mean}{len(distance.missing)} missing, {len(distance.surplus)} surplus"
    return counts + _describe_over_time(distance.over_time)


def _describe_over_time(over_time: OverTime | None) -> str:
    if over_time is None:
        return ""
    return (
        f", moving: {over_time.at_t0_m!r} m at t0, {over_time.final_m!r} m after {HORIZON_S:g} s"
    )
