"""Every table of a job by name, for the API, pages and commands."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

from arena.exports.formats import Format
from arena.jobs.exports import displacement_files, driving, faults, tables
from arena.jobs.exports.displacement import displacement_table
from arena.jobs.exports.files import TRANSCRIPT_FORMATS
from arena.jobs.queries import analysis_of
from augment.models import GenerationJob
from augment.services.judging.displacement import By
from augment.services.judging.simulations import SCORES


class JobTable(NamedTuple):
    """A table of a job: its formats, what makes it, and a line about it."""

    formats: Mapping[str, Format[Any]]
    make: Callable[[GenerationJob], Any]
    help: str = ""


def _analysis(part: str, job: GenerationJob) -> tables.Sheet:
    return tables.analysis_sheet(analysis_of(job), part)


PLAIN_TABLES = {
    "faults": JobTable(faults.FORMATS, faults.fault_table, "how often experts saw which fault"),
    "tool-calls": JobTable(
        tables.TABLE_FORMATS,
        tables.tool_call_sheet,
        "calls of the function: tried, understood, mended",
    ),
    "augmentations": JobTable(
        tables.TABLE_FORMATS, tables.augmentation_sheet, "one row for each augmentation of a job"
    ),
    "repeats": JobTable(
        tables.TABLE_FORMATS, tables.repeat_sheet, "what varies between the samples of a job"
    ),
}
"""Those that take no options."""

JOB_TABLES = PLAIN_TABLES | {
    "displacement-objects": JobTable(tables.TABLE_FORMATS, tables.object_sheet),
    **{
        f"displacement-by-{by.value}": JobTable(
            displacement_files.FORMATS, partial(displacement_table, by=by)
        )
        for by in By
    },
    **{
        f"driving-{score}": JobTable(driving.FORMATS, partial(driving.driving_table, score=score))
        for score in SCORES
    },
    **{
        f"analyses-{part}": JobTable(tables.TABLE_FORMATS, partial(_analysis, part))
        for part in tables.ANALYSES
    },
}
TRANSCRIPTS = JobTable(
    TRANSCRIPT_FORMATS,
    lambda job: job,
    "every transcript of a job: a line of JSON each, or with their images as a zip",
)
