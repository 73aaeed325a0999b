"""Every table of a job by name, for the API, pages and commands, and the columns of most."""

import json
from collections.abc import Callable
from functools import partial
from typing import Any

from arena.exports.formats import (
    NUMBER,
    TABLE_FORMATS,
    TEXT,
    WHOLE,
    YES_NO,
    Columns,
    Export,
    Sheet,
    sheet_of,
)
from arena.jobs.exports import displacement, driving, faults, realism
from arena.jobs.exports.files import TRANSCRIPT_FORMATS
from augment.models import GenerationJob
from augment.services.judging.analyses import (
    ANALYSES,
    SEED,
    answers_of,
    augmentation_lines,
    repeatability,
)
from augment.services.judging.displacement import By
from augment.services.judging.driving_scores import scores_of_job
from augment.services.judging.realism import realism_of_job
from augment.services.judging.simulations import SCORES
from augment.services.running.progress import tool_calls


def _count(name: str) -> Callable[[Any], int | None]:
    """Return what counts matched, missing or surplus objects of a line."""

    def count(line: Any) -> int | None:
        return None if line.displacement is None else len(getattr(line.displacement, name))

    return count


def _options(line: Any) -> str | None:
    options = line.row.options
    return None if options is None else json.dumps(options, sort_keys=True)


AUGMENTATIONS: Columns = {
    **displacement.WHOSE,
    "sample": ("row.sample", WHOLE),
    "options": (_options, TEXT),
    "augmentation": ("row.code", TEXT),
    "state": ("row.state", TEXT),
    "matched": (_count("matches"), WHOLE),
    "missing": (_count("missing"), WHOLE),
    "surplus": (_count("surplus"), WHOLE),
    "displacement_mean_m": ("displacement.mean_m", NUMBER),
    "wrong": ("wrong", WHOLE),
    "doubtful": ("doubtful", WHOLE),
    "realism": ("realism", NUMBER),
    "calls": ("spending.calls", WHOLE),
    "tokens": ("spending.tokens", WHOLE),
    "cost_usd": ("spending.usd", NUMBER),
    "reason": ("row.reason", TEXT),
}
"""`contestant` is the slug, `options` a JSON object; `wrong` and `doubtful` count findings."""

REPEATS: Columns = {
    **{name: (name, TEXT) for name in ("contestant", "name")},
    "simulated": ("simulated", YES_NO),
    "samples": ("samples", WHOLE),
    **{
        f"{name}_{part}": (f"{name}_{part}", TEXT if part == "values" else NUMBER)
        for name in ("displacement_m", "missed", "usd")
        for part in ("mean", "sd", "values")
    },
    "displacement_within_scenario_sd_m": ("within_m", NUMBER),
}
"""`sd` is between samples, `values` has one number a sample; see `repeatability`."""

TOOL_CALLS: Columns = {
    **{name: (name, TEXT) for name in ("contestant", "name", "scenario", "augmentation")},
    "simulated": ("is_simulated", YES_NO),
    **{name: (name, WHOLE) for name in ("attempted", "understood", "mended")},
}

_WHO: Columns = {"contestant": ("contestant", TEXT), "simulated": ("simulated", YES_NO)}
ANALYSIS_COLUMNS: dict[str, Columns] = {
    "pairs": {
        **{name: (name, TEXT) for name in ("first", "second")},
        "scenarios": ("scenarios", WHOLE),
        "median_difference_m": ("median_m", NUMBER),
        **{name: (name, NUMBER) for name in ("low_m", "high_m")},
        "p_wilcoxon": ("p", NUMBER),
        "p_holm": ("p_holm", NUMBER),
    },
    "wordings": {
        **_WHO,
        **{name: (name, WHOLE) for name in ("scenarios", "wordings")},
        "within_m": ("within_m", NUMBER),
    },
    "refusals": {
        **_WHO,
        **{name: (name, WHOLE) for name in ("right", "wrong", "overlooked")},
        **{name: (name, NUMBER) for name in ("precision", "recall")},
    },
}


def augmentation_sheet(job: GenerationJob) -> Sheet:
    """Return a job's augmentations with one row each."""
    columns: Columns = {"job": (lambda line: job.name, TEXT), **AUGMENTATIONS}
    name = "augmentations"
    return sheet_of(augmentation_lines(job), columns, name=name, key=name)


def repeat_sheet(job: GenerationJob) -> Sheet:
    """Return what varies between the samples of a job, one row a contestant."""
    return sheet_of(repeatability(job), REPEATS, digits=6, name="repeats", key="repeats")


def tool_call_sheet(job: GenerationJob) -> Sheet:
    """Return the calls of a job's contestants to their function, one row an augmentation."""
    lines = tool_calls(job)
    return sheet_of(lines, TOOL_CALLS, name="tool-calls", key="augmentations")


def analysis_sheet(job: GenerationJob, *, part: str) -> Sheet:
    """Return one part of a job's analysis; its bootstrap has a seed, which JSON names."""
    lines, facts = ANALYSES[part](answers_of(job)), {"part": part, "seed": SEED}
    columns = ANALYSIS_COLUMNS[part]
    return sheet_of(lines, columns, digits=6, name="analysis", number="g", facts=facts)


JOB_TABLES = {
    "faults": Export(faults.FORMATS, faults.fault_table, "how often experts saw which fault"),
    "tool-calls": Export(
        TABLE_FORMATS, tool_call_sheet, "calls of the function: tried, understood, mended"
    ),
    "augmentations": Export(
        TABLE_FORMATS, augmentation_sheet, "one row for each augmentation of a job"
    ),
    "repeats": Export(TABLE_FORMATS, repeat_sheet, "what varies between the samples of a job"),
    "realism": Export(
        realism.FORMATS,
        realism_of_job,
        "how realistic, between recorded traffic and random places",
    ),
    "displacement-objects": Export(TABLE_FORMATS, displacement.object_sheet),
    **{
        f"displacement-by-{by.value}": Export(
            displacement.FORMATS, partial(displacement.displacement_table, by=by)
        )
        for by in By
    },
    **{
        f"driving-{score}": Export(driving.FORMATS, partial(scores_of_job, score=score))
        for score in SCORES
    },
    **{
        f"analyses-{part}": Export(TABLE_FORMATS, partial(analysis_sheet, part=part))
        for part in ANALYSES
    },
}
JOB_FILES = JOB_TABLES | {
    "transcripts": Export(
        TRANSCRIPT_FORMATS, lambda job: job, "every transcript of a job, a line of JSON each"
    )
}
