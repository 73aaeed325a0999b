"""Exports of a job's measurements: tables of what its contestants made, and their pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from arena.exports.formats import format_named
from arena.exports.samples import SHEET_FORMATS, sheet_bytes, sheet_of
from arena.jobs.exports import displacement_files, driving
from arena.jobs.exports.displacement import displacement_table
from arena.jobs.exports.registry import PLAIN_TABLES, TRANSCRIPTS
from arena.jobs.exports.tables import ANALYSES, TABLE_FORMATS, analysis_sheet, object_sheet
from arena.management.exporting.kinds import (
    Chosen,
    ExportedFile,
    Say,
    add_format,
    add_kind,
    add_table,
    fill,
)
from augment.errors import Conflict, UnknownName
from augment.services.judging.analyses import analyse_job
from augment.services.judging.displacement import By, types_named
from augment.services.judging.driving_scores import options_driven
from augment.services.judging.simulations import SCORES, Options
from augment.services.running.choosing import find_job

BY_OBJECT = "object"


def add_jobs(kinds: Any) -> None:
    """What can be written of a job, but for its scenarios."""
    _add_displacement(kinds)
    _add_samples(kinds)
    _add_driving(kinds)
    for name, table in PLAIN_TABLES.items():
        add_table(kinds, name, table.formats, table.make, help=table.help)
    add_table(
        *(kinds, "transcripts", TRANSCRIPTS.formats, TRANSCRIPTS.make), help=TRANSCRIPTS.help
    ).set_defaults(format="jsonl")
    _add_analyses(kinds)


def _add_displacement(kinds: Any) -> None:
    kind = add_kind(
        kinds, "displacement", write_displacement, of="job", help="how far from the references"
    )
    kind.add_argument(
        "--by",
        default="type",
        help=f"one of {', '.join(By)}; or {BY_OBJECT}, for one row an object "
        f"({', '.join(TABLE_FORMATS)})",
    )
    kind.add_argument(
        "--types",
        nargs="+",
        help="scenario types, or all; by variant only those with definite places unless given",
    )
    add_format(kind, displacement_files.FORMATS)


def write_displacement(options: Chosen, say: Say) -> ExportedFile:
    """How far from the references: in groups, or one row an object."""
    types = None if options["types"] is None else types_named(options["types"])
    if options["by"] == BY_OBJECT:
        of_objects = format_named(TABLE_FORMATS, options["format"])
        return fill(of_objects, object_sheet(find_job(options["job"]), types=types))
    chosen = format_named(displacement_files.FORMATS, options["format"])
    if options["by"] not in set(By):
        raise UnknownName("grouping", options["by"], [*By, BY_OBJECT])
    table = displacement_table(find_job(options["job"]), by=By(options["by"]), types=types)
    return fill(chosen, table)


def _add_samples(kinds: Any) -> None:
    kind = add_kind(
        kinds, "samples", write_samples, of="job", help="a sheet of pictures with captions"
    )
    kind.add_argument("--scenarios", nargs="+", required=True, help="slugs, top to bottom")
    kind.add_argument("--contestants", nargs="+", required=True, help="left to right")
    kind.add_argument(
        "--format", help=f"one of {', '.join(SHEET_FORMATS)}; else the file's ending says it"
    )
    kind.add_argument("--sample", type=int, default=1, help="which one of each cell")


def write_samples(options: Chosen, say: Say) -> ExportedFile:
    """The sheet, in the format that is given or that the file's ending says."""
    form = options["format"] or Path(options["out"]).suffix.removeprefix(".")
    if form not in SHEET_FORMATS:
        raise UnknownName("format", form, list(SHEET_FORMATS))
    sheet = sheet_of(
        find_job(options["job"]),
        scenarios=options["scenarios"],
        contestants=options["contestants"],
        sample=options["sample"],
    )
    return ExportedFile(sheet_bytes(sheet, file_format=form), form, False)


def _add_driving(kinds: Any) -> None:
    kind = add_kind(
        *(kinds, "driving", write_driving),
        of="job",
        help="mean driving scores of what was simulated",
    )
    kind.add_argument("--score", default="nuplan", help=f"one of {', '.join(SCORES)}")
    kind.add_argument("--planner", default="pdm-closed", help="as it was simulated with")
    kind.add_argument("--offsets", default="paper", help="as it was simulated with")
    kind.add_argument("--reactive", action="store_true", help="as it was simulated")
    kind.add_argument(
        "--with-paper", action="store_true", help="add the paper's rows below a rule"
    )
    add_format(kind, driving.FORMATS)


def write_driving(options: Chosen, say: Say) -> ExportedFile:
    """Mean scores of the drives that were made just so."""
    chosen = format_named(driving.FORMATS, options["format"])
    job = find_job(options["job"])
    if options["score"] not in SCORES:
        raise UnknownName("score", options["score"], list(SCORES))
    how = Options(
        planner=options["planner"], offsets=options["offsets"], is_reactive=options["reactive"]
    )
    if how not in options_driven(job):
        raise Conflict(f"Job {job.name!r} was not driven so; manage.py simulate does it.")
    table = driving.driving_table(
        job, options=how, score=options["score"], with_paper=options["with_paper"]
    )
    return fill(chosen, table)


def _add_analyses(kinds: Any) -> None:
    kind = add_kind(
        *(kinds, "analyses", write_analyses),
        of="job",
        help="pairs of contestants, wordings, refusals",
    )
    kind.add_argument("--part", required=True, help=f"one of {', '.join(ANALYSES)}")
    add_format(kind, TABLE_FORMATS)


def write_analyses(options: Chosen, say: Say) -> ExportedFile:
    """One part of what can be said of a job."""
    chosen = format_named(TABLE_FORMATS, options["format"])
    if options["part"] not in ANALYSES:
        raise UnknownName("part", options["part"], list(ANALYSES))
    found = analyse_job(find_job(options["job"]))
    return fill(chosen, analysis_sheet(found, options["part"]))
