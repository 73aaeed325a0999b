"""Exports of what a job made, as scenarios of other tools; what is lost on the way is told."""

from __future__ import annotations

from typing import Any

from django.utils.text import slugify

from arena.exports.zips import ZIP
from arena.jobs.exports.files import scenario_zip, zip_name
from arena.management.exporting.kinds import Chosen, ExportedFile, Say, add_kind
from augment.errors import UnknownName
from augment.services.judging.scenario_export import FORMATS, RECORDED, Exported, export_job
from augment.services.running.choosing import find_job
from augment.services.scenarios.interplan import job_as_interplan

MODIFICATION_FORMATS = ("interplan",)


def add_scenarios(kinds: Any) -> None:
    """Modifications as one document, and scenarios as files of a standard format."""
    modifications = add_kind(
        *(kinds, "modifications", write_modifications),
        of="job",
        help="what a job's contestants made",
    )
    modifications.add_argument(
        "--format", default="interplan", help=f"one of {', '.join(MODIFICATION_FORMATS)}"
    )
    modifications.add_argument("--contestant", help="the slug of one; all unless given")
    modifications.add_argument(
        "--strict",
        action="store_true",
        help="write nothing if a scenario would not be the same there (kept traffic, motion, ...)",
    )
    scenarios = add_kind(
        *(kinds, "scenarios", write_scenarios),
        of="job",
        help="what a job made, in a standard format",
    )
    scenarios.add_argument(
        "--format", required=True, help=f"one of {', '.join(FORMATS)}; OUT is a folder"
    )
    scenarios.add_argument("--contestant", help="the slug of one; all unless given")
    scenarios.add_argument(
        "--motion",
        default=RECORDED,
        help=f"{RECORDED}, or the planner whose finished drives say what everybody does",
    )
    scenarios.add_argument(
        "--strict", action="store_true", help="write nothing if a scenario would not be the same"
    )


def write_modifications(options: Chosen, say: Say) -> ExportedFile:
    """All modifications of a job as interPlan's YAML."""
    if options["format"] not in MODIFICATION_FORMATS:
        raise UnknownName("format", options["format"], list(MODIFICATION_FORMATS))
    text, losses = job_as_interplan(
        find_job(options["job"]), contestant=options["contestant"], strict=options["strict"]
    )
    for loss in losses:
        say(f"Lost: {loss}.")
    say(f"{len(losses)} things could not be said in interPlan's format.")
    return ExportedFile(text.encode(), "yaml", True)


def write_scenarios(options: Chosen, say: Say) -> ExportedFile:
    """All scenarios of a job as a zip of files."""
    exported = export_job(
        find_job(options["job"]),
        file_format=options["format"],
        contestant=options["contestant"],
        motion=options["motion"],
        strict=options["strict"],
    )
    _tell(exported, say)
    slug = slugify(exported.origin.name) or exported.origin.code
    return ExportedFile(scenario_zip(exported), ZIP, False, name=zip_name(exported, slug))


def _tell(exported: Exported, say: Say) -> None:
    for loss in exported.missing:
        say(f"Left out: {loss}.")
    for loss in exported.written.refused:
        say(f"Refused: {loss}.")
    for loss in exported.written.losses:
        say(f"Lost: {loss}.")
    for warning in exported.warnings:
        say(f"Warning: {warning}")
    lost, refused = len(exported.written.losses), len(exported.written.refused)
    say(f"{lost} things could not be said as {exported.format}; {refused} refused.")
