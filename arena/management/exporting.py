"""What `manage.py export` can write: the arguments of each kind and what writes it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeVar
from uuid import UUID

from django.utils.text import slugify

from arena.errors import StudyStillOpen
from arena.exports.files import ZIP
from arena.exports.formats import Format, format_named
from arena.jobs.exports import displacement_files, driving
from arena.jobs.exports.displacement import displacement_table
from arena.jobs.exports.files import scenario_zip, zip_name
from arena.jobs.exports.registry import PLAIN_TABLES, TRANSCRIPTS, JobTable
from arena.jobs.exports.tables import ANALYSES, TABLE_FORMATS, analysis_sheet, object_sheet
from arena.models import Snapshot, Study
from arena.results.exports.charts import CONTENT_TYPES, chart_bytes
from arena.results.exports.sheets import SHEET_FORMATS, contact_sheet, find_cells, sample_sheet
from arena.results.exports.tables import leaderboard_table
from arena.results.exports.votes import VOTE_FORMATS, unrated_votes, vote_table
from arena.results.exports.writers import FORMATS, bundle
from arena.results.queries.access import snapshot_to_export
from arena.results.queries.votes import is_imported
from arena.results.services.ratings import log_early_look
from arena.studies.queries import study_named
from augment.errors import Conflict, UnknownName
from augment.services.judging import scenario_export
from augment.services.judging.analyses import analyse_job
from augment.services.judging.displacement import By, types_named
from augment.services.judging.driving_scores import options_driven
from augment.services.judging.simulations import SCORES, Options
from augment.services.running.choosing import find_job

Table = TypeVar("Table")
Chosen = dict[str, Any]
"""The arguments of the command line by name."""

Say = Callable[[str], None]
"""Where a kind tells what was left out or lost, beside the file."""

BY_OBJECT = "object"


class ExportedFile(NamedTuple):
    """A file that can be delivered.

    Attributes:
        suffix: The file's ending, without the dot.
        is_text: Whether it can go to a terminal.
        name: What it is called in a folder, where OUT may be one; else empty.
    """

    content: bytes
    suffix: str
    is_text: bool
    name: str = ""


@dataclass(frozen=True, slots=True)
class ExportKind:
    """A kind of export.

    Attributes:
        of: What it is an export of: study or job.
        options: Arguments of the command line, as argparse takes them, by flag.
    """

    of: str
    help: str
    write: Callable[[Chosen, Say], ExportedFile]
    options: Mapping[str, dict[str, Any]]


def add_kinds(kinds: Any) -> None:
    """Add a subcommand for each kind, all with --out.

    Args:
        kinds: Argparse's subparsers.
    """
    for name, kind in KINDS.items():
        parser = kinds.add_parser(name, help=kind.help)
        parser.add_argument(kind.of, help="its name or its code")
        for flag, how in kind.options.items():
            parser.add_argument(flag, **how)
        parser.add_argument("--out", required=True, help="a file; - for standard output")


def _format(names: Mapping[str, Any] | list[str], default: str | None = "csv") -> dict[str, Any]:
    help_text = f"one of {', '.join(names)}"
    return {"--format": {"default": default, "help": help_text}}


def _fill(form: Format[Table], table: Table) -> ExportedFile:
    return ExportedFile(form.write(table), form.suffix, form.is_text)


# --- Of a study's rating -------------------------------------------------------------------------


def _snapshot(options: Chosen) -> Snapshot:
    """Return the rating that is asked for; a look into an open study is written to the log."""
    study = study_named(options["study"])
    snapshot = snapshot_to_export(study, options["rating"])
    if study.state == Study.State.OPEN:
        if not options["early"]:
            raise StudyStillOpen(study.name)
        what = f"{options['what']} as {options['format']}"
        log_early_look(study=study, actor=None, what=what)
    return snapshot


def _write_leaderboard(options: Chosen, say: Say) -> ExportedFile:
    """Write the table in one format, or everything of the rating as one zip."""
    if options["format"] == ZIP:
        return ExportedFile(bundle(_snapshot(options)), ZIP, False)
    chosen = format_named(FORMATS, options["format"])
    return _fill(chosen, leaderboard_table(_snapshot(options)))


def _write_votes(options: Chosen, say: Say) -> ExportedFile:
    """Write the votes that the rating counted; of a cancelled study all that were given."""
    chosen = format_named(VOTE_FORMATS, options["format"])
    study = study_named(options["study"])
    if study.state == Study.State.CANCELLED:
        return _fill(chosen, unrated_votes(study))
    return _fill(chosen, vote_table(_snapshot(options)))


def _write_chart(options: Chosen, say: Say) -> ExportedFile:
    form = options["format"]
    content = chart_bytes(_snapshot(options), name=options["chart"], file_format=form)
    return ExportedFile(content, form, form == "svg")


def _write_contact_sheet(options: Chosen, say: Say) -> ExportedFile:
    """Write all pictures of the study, side by side."""
    snapshot = _snapshot(options | {"format": "pdf"})
    if is_imported(snapshot.study):
        raise Conflict("Votes from a file have no pictures, so there is no contact sheet.")
    scenarios = list(snapshot.study.scenarios.defer("reference").order_by("type", "slug"))
    return ExportedFile(contact_sheet(snapshot, scenarios), "pdf", False)


# --- Of a job ------------------------------------------------------------------------------------


def _plain(table: JobTable, default: str = "csv") -> ExportKind:
    def write(options: Chosen, say: Say) -> ExportedFile:
        chosen = format_named(table.formats, options["format"])
        return _fill(chosen, table.make(find_job(options["job"])))

    return ExportKind("job", table.help, write, _format(table.formats, default))


def _write_displacement(options: Chosen, say: Say) -> ExportedFile:
    """Write how far from the references: in groups, or one row an object."""
    types = None if options["types"] is None else types_named(options["types"])
    if options["by"] == BY_OBJECT:
        of_objects = format_named(TABLE_FORMATS, options["format"])
        return _fill(of_objects, object_sheet(find_job(options["job"]), types=types))
    chosen = format_named(displacement_files.FORMATS, options["format"])
    if options["by"] not in set(By):
        raise UnknownName("grouping", options["by"], [*By, BY_OBJECT])
    table = displacement_table(find_job(options["job"]), by=By(options["by"]), types=types)
    return _fill(chosen, table)


def _write_samples(options: Chosen, say: Say) -> ExportedFile:
    """Write the sheet in the format that is given or that the file's ending says."""
    form = options["format"] or Path(options["out"]).suffix.removeprefix(".")
    if form not in SHEET_FORMATS:
        raise UnknownName("format", form, list(SHEET_FORMATS))
    shown = {"scenarios": options["scenarios"], "contestants": options["contestants"]}
    cells = find_cells(find_job(options["job"]), sample=options["sample"], **shown)
    return ExportedFile(sample_sheet(cells, file_format=form, **shown), form, False)


def _write_driving(options: Chosen, say: Say) -> ExportedFile:
    """Write mean scores of the drives that were made just so."""
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
    return _fill(chosen, table)


def _write_analyses(options: Chosen, say: Say) -> ExportedFile:
    chosen = format_named(TABLE_FORMATS, options["format"])
    if options["part"] not in ANALYSES:
        raise UnknownName("part", options["part"], list(ANALYSES))
    found = analyse_job(find_job(options["job"]))
    return _fill(chosen, analysis_sheet(found, options["part"]))


def _write_modifications(options: Chosen, say: Say) -> ExportedFile:
    """Write all modifications of a job as interPlan's YAML."""
    if options["format"] != "interplan":
        raise UnknownName("format", options["format"], ["interplan"])
    exported = scenario_export.export_job(
        find_job(options["job"]), file_format="interplan", contestant=options["contestant"]
    )
    losses = (*exported.missing, *exported.written.refused, *exported.written.losses)
    for loss in losses:
        say(f"Lost: {loss}.")
    say(f"{len(losses)} things could not be said in interPlan's format.")
    (content,) = exported.written.files.values()
    return ExportedFile(content, "yaml", True)


def _write_scenarios(options: Chosen, say: Say) -> ExportedFile:
    """Write all scenarios of a job as a zip of files, and tell what is lost on the way."""
    exported = scenario_export.export_job(
        find_job(options["job"]), file_format=options["format"], contestant=options["contestant"]
    )
    written = exported.written
    for loss in exported.missing:
        say(f"Left out: {loss}.")
    for loss in written.refused:
        say(f"Refused: {loss}.")
    for loss in written.losses:
        say(f"Lost: {loss}.")
    for warning in exported.warnings:
        say(f"Warning: {warning}")
    say(
        f"{len(written.losses)} things could not be said as {exported.format}; "
        f"{len(written.refused)} refused."
    )
    slug = slugify(exported.origin.name) or exported.origin.code
    return ExportedFile(scenario_zip(exported), ZIP, False, name=zip_name(exported, slug))


# --- All of them ---------------------------------------------------------------------------------


_OF_RATING: dict[str, dict[str, Any]] = {
    "--rating": {"type": UUID, "help": "the code of an older rating"},
    "--early": {"action": "store_true", "help": "export from an open study; this is logged"},
}
_CONTESTANT = {"help": "the slug of one; all unless given"}
_DRIVEN = {"help": "as it was simulated with"}

KINDS: dict[str, ExportKind] = {
    "leaderboard": ExportKind(
        "study",
        "the newest rating of a study",
        _write_leaderboard,
        _format([*FORMATS, ZIP]) | _OF_RATING,
    ),
    "votes": ExportKind(
        "study",
        "the votes of the newest rating, with pseudonyms",
        _write_votes,
        _format(VOTE_FORMATS) | _OF_RATING,
    ),
    "chart": ExportKind(
        "study",
        "a chart of the newest rating beside the table's",
        _write_chart,
        {"--chart": {"required": True, "help": "pairs, types, width, displacement, elo-usd, ..."}}
        | _format(CONTENT_TYPES, "svg")
        | _OF_RATING,
    ),
    "contact-sheet": ExportKind(
        "study",
        "every contestant's picture of every scenario with the votes on it, as PDF",
        _write_contact_sheet,
        _OF_RATING,
    ),
    "displacement": ExportKind(
        "job",
        "how far from the references",
        _write_displacement,
        {
            "--by": {
                "default": "type",
                "help": f"one of {', '.join(By)}; or {BY_OBJECT}, for one row an object "
                f"({', '.join(TABLE_FORMATS)})",
            },
            "--types": {
                "nargs": "+",
                "help": "scenario types, or all; by variant only those with definite places "
                "unless given",
            },
        }
        | _format(displacement_files.FORMATS),
    ),
    "samples": ExportKind(
        "job",
        "a sheet of pictures with captions",
        _write_samples,
        {
            "--scenarios": {"nargs": "+", "required": True, "help": "slugs, top to bottom"},
            "--contestants": {"nargs": "+", "required": True, "help": "left to right"},
            "--sample": {"type": int, "default": 1, "help": "which one of each cell"},
        }
        | _format([*SHEET_FORMATS, "or what the file's ending says"], None),
    ),
    "driving": ExportKind(
        "job",
        "mean driving scores of what was simulated",
        _write_driving,
        {
            "--score": {"default": "nuplan", "help": f"one of {', '.join(SCORES)}"},
            "--planner": {"default": "pdm-closed"} | _DRIVEN,
            "--offsets": {"default": "paper"} | _DRIVEN,
            "--reactive": {"action": "store_true"} | _DRIVEN,
            "--with-paper": {"action": "store_true", "help": "add the paper's rows below a rule"},
        }
        | _format(driving.FORMATS),
    ),
    **{name: _plain(table) for name, table in PLAIN_TABLES.items()},
    "transcripts": _plain(TRANSCRIPTS, "jsonl"),
    "analyses": ExportKind(
        "job",
        "pairs of contestants, wordings, refusals",
        _write_analyses,
        {"--part": {"required": True, "help": f"one of {', '.join(ANALYSES)}"}}
        | _format(TABLE_FORMATS),
    ),
    "modifications": ExportKind(
        "job",
        "what a job's contestants made",
        _write_modifications,
        _format(["interplan"], "interplan") | {"--contestant": _CONTESTANT},
    ),
    "scenarios": ExportKind(
        "job",
        "what a job made, in a standard format",
        _write_scenarios,
        {
            "--format": {
                "required": True,
                "help": f"one of {', '.join(scenario_export.FORMATS)}; OUT is a folder",
            },
            "--contestant": _CONTESTANT,
        },
    ),
}
