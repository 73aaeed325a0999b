"""manage.py export: write results to files."""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path
from typing import Any
from uuid import UUID

from django.core.management.base import CommandError, CommandParser
from django.utils.text import slugify

from arena.errors import ArenaError, StudyStillOpen
from arena.exports import analyses, displacement_writers, driving_writers, faults, tool_calls
from arena.exports.augmentations import (
    AUGMENTATION_FORMATS,
    REPEAT_FORMATS,
    augmentation_rows,
    repeat_rows,
)
from arena.exports.bundle import bundle
from arena.exports.displacement_objects import BY_OBJECT, OBJECT_FORMATS, object_rows
from arena.exports.displacement_table import displacement_table
from arena.exports.driving_table import DrivingTable
from arena.exports.files import write_whole
from arena.exports.formats import format_named
from arena.exports.rating_charts import CONTENT_TYPES, chart_bytes
from arena.exports.samples import SHEET_FORMATS, sheet_bytes, sheet_of
from arena.exports.scenarios import scenario_zip, zip_name
from arena.exports.study_folder.writing import write_study
from arena.exports.tables import leaderboard_table
from arena.exports.votes import VOTE_FORMATS, vote_table
from arena.exports.writers import FORMATS
from arena.exports.zips import ZIP
from arena.models import Snapshot, Study
from arena.queries.jobs import grid
from arena.queries.results import snapshot_to_export
from arena.queries.studies import study_named
from arena.services.early_looks import log_early_look
from augment.errors import AugmentError, Conflict, UnknownName
from augment.services.judging.analyses import analyse_job
from augment.services.judging.displacement import By, types_named
from augment.services.judging.driving_scores import options_driven, scores_of_job
from augment.services.judging.scenario_export import FORMATS as SCENARIO_FORMATS
from augment.services.judging.scenario_export import RECORDED, Exported, export_job
from augment.services.judging.simulations import SCORES, Options
from augment.services.running.choosing import find_job
from augment.services.running.tool_calls import tool_calls_by_augmentation
from augment.services.scenarios.interplan import job_as_interplan
from augment.services.terminal import TerminalCommand

MODIFICATION_FORMATS = ("interplan",)

Written = tuple[bytes, str, bool]
"""A file's bytes, its ending, and whether it is text."""


class Command(TerminalCommand):
    """One subcommand per kind of result."""

    help = "Write results to files; the same snapshot or job always gives the same bytes."

    def add_arguments(self, parser: CommandParser) -> None:
        """What to export, of which study or job, where to."""
        kinds = parser.add_subparsers(dest="what", required=True, metavar="WHAT")
        for kind in (*_kinds_of_studies(kinds), *_kinds_of_jobs(kinds)):
            kind.add_argument("--out", required=True, help="a file; - for standard output")

    def handle(self, *args: Any, **options: Any) -> None:
        """Write the file."""
        if options["what"] == "study":
            self._study(options)
            return
        write = {
            "leaderboard": self._leaderboard,
            "votes": self._votes,
            "chart": self._chart,
            "displacement": self._displacement,
            "samples": self._samples,
            "modifications": self._modifications,
            "scenarios": self._scenarios,
            "faults": self._faults,
            "driving": self._driving,
            "tool-calls": self._tool_calls,
            "augmentations": self._augmentations,
            "repeats": self._repeats,
            "analyses": self._analyses,
        }
        try:
            content, suffix, is_text = write[options["what"]](options)
        except (ArenaError, AugmentError) as error:
            raise CommandError(str(error)) from error
        self._deliver(content, options["out"], suffix, is_text)

    def _study(self, options: dict[str, Any]) -> None:
        try:
            study = study_named(options["study"])
            write_study(study, Path(options["out"]), say=self.stderr.write)
        except (ArenaError, AugmentError, OSError) as error:
            raise CommandError(f"Nothing was exported. {error}") from error
        self.stderr.write(f"Wrote {options['out']}.")

    def _leaderboard(self, options: dict[str, Any]) -> Written:
        form = options["format"]
        chosen = None if form == ZIP else format_named(FORMATS, form)
        snapshot = self._snapshot(options)
        if chosen is None:
            return bundle(snapshot), ZIP, False
        return chosen.write(leaderboard_table(snapshot)), chosen.suffix, chosen.is_text

    def _votes(self, options: dict[str, Any]) -> Written:
        chosen = format_named(VOTE_FORMATS, options["format"])
        return chosen.write(vote_table(self._snapshot(options))), chosen.suffix, chosen.is_text

    def _chart(self, options: dict[str, Any]) -> Written:
        form = options["format"]
        snapshot = self._snapshot(options)
        content = chart_bytes(snapshot, name=options["chart"], file_format=form)
        return content, form, form == "svg"

    def _snapshot(self, options: dict[str, Any]) -> Snapshot:
        """The rating that is asked for; looking into an open study is written to the log."""
        study = study_named(options["study"])
        snapshot = snapshot_to_export(study, options["rating"])
        if study.state == Study.State.OPEN:
            if not options["early"]:
                raise StudyStillOpen(study.name)
            what = f"{options['what']} as {options['format']}"
            log_early_look(study=study, actor=None, what=what)
        return snapshot

    def _displacement(self, options: dict[str, Any]) -> Written:
        if options["by"] == BY_OBJECT:
            one = format_named(OBJECT_FORMATS, options["format"])
            types = None if options["types"] is None else types_named(options["types"])
            rows = object_rows(find_job(options["job"]), types=types)
            return one.write(rows), one.suffix, one.is_text
        chosen = format_named(displacement_writers.FORMATS, options["format"])
        if options["by"] not in set(By):
            raise UnknownName("grouping", options["by"], [*By, BY_OBJECT])
        types = None if options["types"] is None else types_named(options["types"])
        table = displacement_table(find_job(options["job"]), by=By(options["by"]), types=types)
        return chosen.write(table), chosen.suffix, chosen.is_text

    def _augmentations(self, options: dict[str, Any]) -> Written:
        chosen = format_named(AUGMENTATION_FORMATS, options["format"])
        rows = augmentation_rows(find_job(options["job"]))
        return chosen.write(rows), chosen.suffix, chosen.is_text

    def _repeats(self, options: dict[str, Any]) -> Written:
        chosen = format_named(REPEAT_FORMATS, options["format"])
        return chosen.write(repeat_rows(find_job(options["job"]))), chosen.suffix, chosen.is_text

    def _faults(self, options: dict[str, Any]) -> Written:
        chosen = format_named(faults.FORMATS, options["format"])
        table = faults.fault_table(find_job(options["job"]))
        return chosen.write(table), chosen.suffix, chosen.is_text

    def _tool_calls(self, options: dict[str, Any]) -> Written:
        chosen = format_named(tool_calls.FORMATS, options["format"])
        lines = tool_calls_by_augmentation(find_job(options["job"]))
        return chosen.write(lines), chosen.suffix, chosen.is_text

    def _analyses(self, options: dict[str, Any]) -> Written:
        chosen = format_named(analyses.ANALYSIS_FORMATS, options["format"])
        if options["part"] not in analyses.PARTS:
            raise UnknownName("part", options["part"], list(analyses.PARTS))
        table = analyses.analysis_table(analyse_job(find_job(options["job"])), options["part"])
        return chosen.write(table), chosen.suffix, chosen.is_text

    def _driving(self, options: dict[str, Any]) -> Written:
        chosen = format_named(driving_writers.FORMATS, options["format"])
        job = find_job(options["job"])
        if options["score"] not in SCORES:
            raise UnknownName("score", options["score"], list(SCORES))
        known = options_driven(job)
        how = Options(
            planner=options["planner"],
            offsets=options["offsets"],
            is_reactive=options["reactive"],
        )
        if how not in known:
            raise Conflict(f"Job {job.name!r} was not driven so; manage.py simulate does it.")
        scores = scores_of_job(job, options=how, score=options["score"])
        table = DrivingTable(title=job.name, scores=scores)
        return chosen.write(table), chosen.suffix, chosen.is_text

    def _samples(self, options: dict[str, Any]) -> Written:
        form = options["format"] or Path(options["out"]).suffix.removeprefix(".")
        if form not in SHEET_FORMATS:
            raise UnknownName("format", form, list(SHEET_FORMATS))
        job = find_job(options["job"])
        sheet = sheet_of(
            job.name,
            grid(job, sample=options["sample"]),
            scenarios=options["scenarios"],
            contestants=options["contestants"],
        )
        return sheet_bytes(sheet, file_format=form), form, False

    def _modifications(self, options: dict[str, Any]) -> Written:
        if options["format"] not in MODIFICATION_FORMATS:
            raise UnknownName("format", options["format"], list(MODIFICATION_FORMATS))
        text, losses = job_as_interplan(
            find_job(options["job"]),
            contestant=options["contestant"],
            strict=options["strict"],
        )
        for loss in losses:
            self.stderr.write(f"Lost: {loss}.")
        self.stderr.write(f"{len(losses)} things could not be said in interPlan's format.")
        return text.encode(), "yaml", True

    def _scenarios(self, options: dict[str, Any]) -> Written:
        exported = export_job(
            find_job(options["job"]),
            file_format=options["format"],
            contestant=options["contestant"],
            motion=options["motion"],
            strict=options["strict"],
        )
        self._tell(exported)
        out = Path(options["out"])
        if options["out"] != "-" and out.suffix != f".{ZIP}":
            slug = slugify(exported.job.name) or str(exported.job.code)
            options["out"] = str(out / zip_name(exported, slug))
            try:
                out.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise CommandError(f"{out} can't be made a folder: {error.strerror}.") from error
        return scenario_zip(exported), ZIP, False

    def _tell(self, exported: Exported) -> None:
        for loss in exported.missing:
            self.stderr.write(f"Left out: {loss}.")
        for loss in exported.written.refused:
            self.stderr.write(f"Refused: {loss}.")
        for loss in exported.written.losses:
            self.stderr.write(f"Lost: {loss}.")
        for warning in exported.warnings:
            self.stderr.write(f"Warning: {warning}")
        lost, refused = len(exported.written.losses), len(exported.written.refused)
        self.stderr.write(
            f"{lost} things could not be said as {exported.format}; {refused} refused."
        )

    def _deliver(self, content: bytes, out: str, suffix: str, is_text: bool) -> None:
        if out == "-":
            if not is_text:
                raise CommandError(f"A {suffix} file can't go to a terminal: name a file.")
            self.stdout.write_data(content.decode())
            return
        try:
            write_whole(Path(out), content)
        except OSError as error:
            raise CommandError(f"{out} can't be written: {error.strerror}.") from error
        self.stderr.write(f"Wrote {out}.")


def _kinds_of_studies(kinds: Any) -> list[ArgumentParser]:
    leaderboard = kinds.add_parser("leaderboard", help="the newest rating of a study")
    leaderboard.add_argument("study", help="its name or its code")
    formats = ", ".join([*FORMATS, ZIP])
    leaderboard.add_argument("--format", default="csv", help=f"one of {formats}")
    votes = kinds.add_parser("votes", help="the votes of the newest rating, with pseudonyms")
    votes.add_argument("study", help="its name or its code")
    votes.add_argument("--format", default="csv", help=f"one of {', '.join(VOTE_FORMATS)}")
    chart = kinds.add_parser("chart", help="a chart of the newest rating beside the table's")
    chart.add_argument("study", help="its name or its code")
    chart.add_argument(
        "--chart", required=True, help="pairs, types, width, displacement, elo-usd, ..."
    )
    chart.add_argument("--format", default="svg", help=f"one of {', '.join(CONTENT_TYPES)}")
    whole = kinds.add_parser("study", help="a whole study; OUT is a new folder")
    whole.add_argument("study", help="its name or its code; it is closed")
    for kind in (leaderboard, votes, chart):
        kind.add_argument("--rating", type=UUID, help="the code of an older rating")
        kind.add_argument(
            "--early", action="store_true", help="export from an open study; this is logged"
        )
    return [leaderboard, votes, chart, whole]


def _kinds_of_jobs(kinds: Any) -> list[ArgumentParser]:
    displacement = kinds.add_parser("displacement", help="how far from the references")
    displacement.add_argument("job", help="its name or its code")
    displacement.add_argument(
        "--by",
        default="type",
        help=f"one of {', '.join(By)}; or {BY_OBJECT}, for one row an object "
        f"({', '.join(OBJECT_FORMATS)})",
    )
    displacement.add_argument(
        "--types",
        nargs="+",
        help="scenario types, or all; by variant only those with definite places unless given",
    )
    displacement.add_argument(
        "--format", default="csv", help=f"one of {', '.join(displacement_writers.FORMATS)}"
    )
    samples = kinds.add_parser("samples", help="a sheet of pictures with captions")
    samples.add_argument("job", help="its name or its code")
    samples.add_argument("--scenarios", nargs="+", required=True, help="slugs, top to bottom")
    samples.add_argument("--contestants", nargs="+", required=True, help="left to right")
    samples.add_argument(
        "--format", help=f"one of {', '.join(SHEET_FORMATS)}; else the file's ending says it"
    )
    samples.add_argument("--sample", type=int, default=1, help="which one of each cell")
    modifications = kinds.add_parser("modifications", help="what a job's contestants made")
    modifications.add_argument("job", help="its name or its code")
    modifications.add_argument(
        "--format", default="interplan", help=f"one of {', '.join(MODIFICATION_FORMATS)}"
    )
    modifications.add_argument("--contestant", help="the slug of one; all unless given")
    modifications.add_argument(
        "--strict",
        action="store_true",
        help="write nothing if a scenario would not be the same there (kept traffic, motion, ...)",
    )
    labels = kinds.add_parser("faults", help="how often experts saw which fault")
    labels.add_argument("job", help="its name or its code")
    labels.add_argument("--format", default="csv", help=f"one of {', '.join(faults.FORMATS)}")
    driving = kinds.add_parser("driving", help="mean driving scores of what was simulated")
    driving.add_argument("job", help="its name or its code")
    driving.add_argument("--score", default="nuplan", help=f"one of {', '.join(SCORES)}")
    driving.add_argument("--planner", default="pdm-closed", help="as it was simulated with")
    driving.add_argument("--offsets", default="paper", help="as it was simulated with")
    driving.add_argument("--reactive", action="store_true", help="as it was simulated")
    driving.add_argument(
        "--format", default="csv", help=f"one of {', '.join(driving_writers.FORMATS)}"
    )
    calls = kinds.add_parser("tool-calls", help="calls of the function: tried, understood, mended")
    calls.add_argument("job", help="its name or its code")
    calls.add_argument("--format", default="csv", help=f"one of {', '.join(tool_calls.FORMATS)}")
    others = [displacement, samples, modifications, labels, driving, calls]
    return [*others, *_kinds_of_rows(kinds), _kind_of_scenarios(kinds)]


def _kinds_of_rows(kinds: Any) -> list[ArgumentParser]:
    rows = kinds.add_parser("augmentations", help="one row for each augmentation of a job")
    rows.add_argument("job", help="its name or its code")
    rows.add_argument("--format", default="csv", help=f"one of {', '.join(AUGMENTATION_FORMATS)}")
    repeats = kinds.add_parser("repeats", help="what varies between the samples of a job")
    repeats.add_argument("job", help="its name or its code")
    repeats.add_argument("--format", default="csv", help=f"one of {', '.join(REPEAT_FORMATS)}")
    found = kinds.add_parser("analyses", help="pairs of contestants, wordings, refusals")
    found.add_argument("job", help="its name or its code")
    found.add_argument("--part", required=True, help=f"one of {', '.join(analyses.PARTS)}")
    found.add_argument(
        "--format", default="csv", help=f"one of {', '.join(analyses.ANALYSIS_FORMATS)}"
    )
    return [rows, repeats, found]


def _kind_of_scenarios(kinds: Any) -> ArgumentParser:
    scenarios: ArgumentParser = kinds.add_parser(
        "scenarios", help="what a job made, in a standard format"
    )
    scenarios.add_argument("job", help="its name or its code")
    scenarios.add_argument(
        "--format", required=True, help=f"one of {', '.join(SCENARIO_FORMATS)}; OUT is a folder"
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
    return scenarios
