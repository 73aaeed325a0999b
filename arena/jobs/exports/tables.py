"""Every table of a job by name, for the API, pages and commands, and the columns of most."""

import json
from collections.abc import Callable
from functools import partial
from typing import Any

from arena.exports.formats import TABLE_FORMATS, Columns, Dtype, Export, Sheet, make_sheet
from arena.jobs.exports import displacement, driving, faults, realism
from arena.jobs.exports.files import TRANSCRIPT_FORMATS
from augment.models import GenerationJob
from augment.services import judging
from augment.services.driving import compare_job, scores_of_job
from augment.services.driving.simulations import SCORES
from augment.services.judging.analyses import ANALYSES, SEED
from augment.services.judging.displacement import By
from augment.services.running import tool_calls


def _count(name: str, measure: str = "displacement") -> Callable[[Any], int | None]:
    """Return a function that counts matched, missing or surplus objects of a line."""

    def count(line: Any) -> int | None:
        distance = getattr(line, measure)
        return None if distance is None else len(getattr(distance, name))

    return count


def _json(document: Any) -> str | None:
    return None if document is None else json.dumps(document, sort_keys=True)


_WISHED: Columns = {
    "wish_distance_m": ("wish.mean_m", Dtype.NUMBER),
    "wish_missing": (_count("missing", "wish"), Dtype.WHOLE),
    "wish_surplus": (_count("surplus", "wish"), Dtype.WHOLE),
}
AUGMENTATIONS: Columns = {
    **displacement.WHOSE,
    "sample": ("row.sample", Dtype.WHOLE),
    "options": (lambda line: _json(line.row.options), Dtype.TEXT),
    "augmentation": ("row.code", Dtype.TEXT),
    "state": ("row.state", Dtype.TEXT),
    **_WISHED,
    "matched": (_count("matches"), Dtype.WHOLE),
    "missing": (_count("missing"), Dtype.WHOLE),
    "surplus": (_count("surplus"), Dtype.WHOLE),
    "displacement_mean_m": ("displacement.mean_m", Dtype.NUMBER),
    **displacement.kept_columns("kept_summary"),
    **Dtype.WHOLE.columns("wrong", "doubtful"),
    "calls": ("spending.calls", Dtype.WHOLE),
    "tokens": ("spending.tokens", Dtype.WHOLE),
    "cost_usd": ("spending.usd", Dtype.NUMBER),
    "reason": ("row.reason", Dtype.TEXT),
}
"""`contestant` is the slug, `options` a JSON object; `wrong` and `doubtful` count findings."""

OVER_TIME: Columns = {
    f"displacement_{name}": (f"displacement.over_time.{name}", Dtype.NUMBER)
    for name in ("at_t0_m", "final_m", "start_s")
}
"""Of augmentations, where something moves in one."""

PURPOSE: Columns = {
    "purpose_served": ("serves", Dtype.YES_NO),
    "purpose_measured": ("purpose_words", Dtype.TEXT),
}
"""Of augmentations, where a wish is open; what only drives tell is empty before the first."""

REPEATS: Columns = {
    **Dtype.TEXT.columns("contestant", "name"),
    **Dtype.YES_NO.columns("simulated"),
    **Dtype.WHOLE.columns("samples"),
    **{
        f"{name}_{part}": (f"{name}_{part}", Dtype.TEXT if part == "values" else Dtype.NUMBER)
        for name in ("displacement_m", "missed", "usd")
        for part in ("mean", "sd", "values")
    },
    "displacement_within_scenario_sd_m": ("within_m", Dtype.NUMBER),
    **{
        f"wish_m_{part}": (f"wish_m_{part}", Dtype.TEXT if part == "values" else Dtype.NUMBER)
        for part in ("mean", "sd", "values")
    },
    "wish_within_scenario_sd_m": ("wish_within_m", Dtype.NUMBER),
}
"""`sd` is between samples, `values` has one number a sample; see `repeatability`."""

TOOL_CALLS: Columns = {
    **Dtype.TEXT.columns("contestant", "name", "scenario", "augmentation"),
    **Dtype.YES_NO.columns("simulated"),
    **Dtype.WHOLE.columns("attempted", "understood", "mended"),
}

_WHO: Columns = {**Dtype.TEXT.columns("contestant"), **Dtype.YES_NO.columns("simulated")}
ANALYSIS_COLUMNS: dict[str, Columns] = {
    "pairs": {
        **Dtype.TEXT.columns("first", "second"),
        **Dtype.WHOLE.columns("scenarios"),
        "median_difference_m": ("median_m", Dtype.NUMBER),
        **Dtype.NUMBER.columns("low_m", "high_m"),
        "p_wilcoxon": ("p", Dtype.NUMBER),
        **Dtype.NUMBER.columns("p_holm"),
        **Dtype.WHOLE.columns("wish_scenarios"),
        "wish_median_difference_m": ("wish_median_m", Dtype.NUMBER),
        **Dtype.NUMBER.columns("wish_low_m", "wish_high_m"),
        "wish_p_wilcoxon": ("wish_p", Dtype.NUMBER),
        **Dtype.NUMBER.columns("wish_p_holm"),
    },
    "wordings": {
        **_WHO,
        **Dtype.WHOLE.columns("scenarios", "wordings"),
        **Dtype.NUMBER.columns("within_m"),
        **Dtype.WHOLE.columns("wish_scenarios", "wish_wordings"),
        **Dtype.NUMBER.columns("wish_within_m"),
    },
    "refusals": {
        **_WHO,
        **Dtype.WHOLE.columns("right", "wrong", "overlooked"),
        **Dtype.NUMBER.columns("precision", "recall"),
    },
}


def augmentation_sheet(job: GenerationJob) -> Sheet:
    """Return a job's augmentations with one row each."""
    columns: Columns = {"job": (lambda line: job.name, Dtype.TEXT), **AUGMENTATIONS}
    name, lines = "augmentations", list(judging.augmentation_lines(job))
    if any(line.displacement and line.displacement.over_time for line in lines):
        columns = {**columns, **OVER_TIME}
    columns = {**columns, "sends": (lambda line: _json(line.row.contestant.sends), Dtype.TEXT)}
    if any(line.row.scenario.is_open for line in lines):
        columns = {**columns, **PURPOSE}
    return make_sheet(lines, columns, name=name, key=name)


def repeat_sheet(job: GenerationJob) -> Sheet:
    """Return the variation between the samples of a job, one row a contestant."""
    return make_sheet(judging.repeatability(job), REPEATS, digits=6, name="repeats", key="repeats")


def tool_call_sheet(job: GenerationJob) -> Sheet:
    """Return the calls of a job's contestants to their function, one row an augmentation."""
    lines = tool_calls(job)
    return make_sheet(lines, TOOL_CALLS, name="tool-calls", key="augmentations")


def analysis_sheet(job: GenerationJob, *, part: str) -> Sheet:
    """Return one part of a job's analysis; its bootstrap has a seed, which JSON names."""
    lines, facts = ANALYSES[part](judging.read_answers(job)), {"part": part, "seed": SEED}
    columns = ANALYSIS_COLUMNS[part]
    return make_sheet(lines, columns, digits=6, name="analysis", number="g", facts=facts)


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
        judging.realism_of_job,
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
        f"planners-{score}": Export(driving.PLANNER_FORMATS, partial(compare_job, score=score))
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
