"""`manage.py export`: the kinds of results, the arguments of each, and the file that it makes."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple
from uuid import UUID

from django.core.management.base import CommandError, CommandParser
from django.utils.text import slugify

from arena.errors import StudyStillOpen
from arena.exports.files import write_whole
from arena.exports.formats import Export
from arena.jobs.exports.faults import tabulate_votes
from arena.jobs.exports.files import pack_scenarios
from arena.jobs.exports.tables import JOB_FILES
from arena.models import Snapshot, Study
from arena.results.exports.board_files import board_folder, write_folder
from arena.results.exports.methods import METHODS_FORMATS, read_methods
from arena.results.exports.preferences import PREFERENCE_FORMATS, preference_sheet
from arena.results.exports.sheets import SHEET_FORMATS, find_cells, sample_sheet
from arena.results.exports.study_folder import write_study
from arena.results.exports.votes import VOTE_FORMATS, list_unrated
from arena.results.exports.writers import CHARTS, RATING_FILES
from arena.results.queries.access import snapshot_to_export
from arena.results.services.boards import board_named
from arena.results.services.ratings import log_early_look
from arena.scenarios.exports.benchmarks import write_benchmark
from arena.studies.queries import study_named
from augment.errors import Conflict, check_names
from augment.models import BaseScene
from augment.services import TerminalCommand
from augment.services.benchmarks import find_benchmark
from augment.services.driving import drives_of_job, options_driven, simulations, ways_to_compare
from augment.services.driving.simulations import SCORES
from augment.services.judging import list_warnings, scenario_export, scene_source
from augment.services.judging.analyses import ANALYSES
from augment.services.judging.displacement import By
from augment.services.running import find_job

Chosen = dict[str, Any]
"""The arguments of the command line by name."""

Say = Callable[[str], None]
"""Where a kind tells what was left out or lost, beside the file."""

_DISPLACEMENT: dict[str, str] = {
    **{by: f"displacement-by-{by}" for by in By},
    "object": "displacement-objects",
}


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


def _write(exported: Export, form: str, find: Callable[[], Any], **more: Any) -> ExportedFile:
    """Write one format of what is found; the format is looked at first."""
    check_names("format", [form], exported.formats)
    chosen = exported.formats[form]
    content = chosen.write(exported.make(find(), **more))
    return ExportedFile(content, chosen.suffix, chosen.is_text)


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


def _write_rating(options: Chosen, say: Say) -> ExportedFile:
    """Write a table or chart of the rating, or all of them as one zip."""
    form = options["format"]
    name = "all" if form == "zip" else options.get("chart") or options["what"]
    return _write(RATING_FILES[name], form, lambda: _snapshot(options))


def _write_votes(options: Chosen, say: Say) -> ExportedFile:
    """Write the votes that the rating counted; of a cancelled study all that were given."""
    study = study_named(options["study"])
    if study.state == Study.State.CANCELLED:
        return _write(Export(VOTE_FORMATS, list_unrated), options["format"], lambda: study)
    return _write_rating(options, say)


def _write_preferences(options: Chosen, say: Say) -> ExportedFile:
    """Write the votes of a closed study with what was shown, and warn of licences."""
    study = study_named(options["study"])
    scenes = BaseScene.objects.filter(scenarios__studies=study).distinct()
    for warning in list_warnings(map(scene_source, scenes.defer("document", "recording"))):
        say(f"Warning: {warning}")
    exported = Export(PREFERENCE_FORMATS, preference_sheet)
    return _write(exported, options["format"], lambda: study, pairs=options["pairs"])


# --- Of a job ------------------------------------------------------------------------------------


def _write_table(name: str, chosen: Chosen, **more: Any) -> ExportedFile:
    return _write(JOB_FILES[name], chosen["format"], lambda: find_job(chosen["job"]), **more)


def _write_faults(options: Chosen, say: Say) -> ExportedFile:
    """Write the table of labels by hand, or of what was marked on ballots."""
    if options["from"] == "labels":
        return _write_table("faults", options)
    table = Export(JOB_FILES["faults"].formats, tabulate_votes)
    return _write(table, options["format"], lambda: find_job(options["job"]))


def _write_driving(options: Chosen, say: Say) -> ExportedFile:
    """Write mean scores of the drives that were made just so, or several planners' together."""
    job = find_job(options["job"])
    if options["planners"]:
        ways = ways_to_compare(job, options["planners"])
        return _write_table(f"planners-{options['score']}", options, options=ways)
    how = simulations.Options(
        planner=options["planner"], offsets=options["offsets"], is_reactive=options["reactive"]
    )
    ways = options_driven(drives_of_job(job))
    driven = [one for one in ways if replace(one, version=how.version) == how]
    if not driven:
        raise Conflict(f"Job {job.name!r} was not driven so; manage.py simulate does it.")
    newest = max(driven, key=lambda one: one.version)
    return _write_table(f"driving-{options['score']}", options, options=newest)


def _write_samples(options: Chosen, say: Say) -> ExportedFile:
    """Write the sheet in the format that is given or that the file's ending says."""
    form = options["format"] or Path(options["out"]).suffix.removeprefix(".")
    check_names("format", [form], SHEET_FORMATS)
    shown = {"scenarios": options["scenarios"], "contestants": options["contestants"]}
    cells = find_cells(find_job(options["job"]), sample=options["sample"], **shown)
    return ExportedFile(sample_sheet(cells, file_format=form, **shown), form, False)


def _write_scenarios(options: Chosen, say: Say) -> ExportedFile:
    """Write all scenarios of a job as a zip of files, and tell what is lost on the way."""
    exported = scenario_export.export_job(
        find_job(options["job"]), file_format=options["format"], contestant=options["contestant"]
    )
    written = exported.written
    losses_by_word = {
        "Left out": exported.missing,
        "Refused": written.refused,
        "Lost": written.losses,
    }
    for word, losses in losses_by_word.items():
        for loss in losses:
            say(f"{word}: {loss}.")
    for warning in exported.warnings:
        say(f"Warning: {warning}")
    say(
        f"{len(written.losses)} things could not be said as {exported.format}; "
        f"{len(written.refused)} refused."
    )
    made = pack_scenarios(exported, slugify(exported.origin.name) or exported.origin.code)
    return ExportedFile(made.content.read(), "zip", False, name=made.name)


# --- All of them ---------------------------------------------------------------------------------


Options = dict[str, dict[str, Any]]


def _option(flag: str, text: str, **how: Any) -> Options:
    return {flag: {"help": text} | how}


def _format(names: Iterable[str], **how: Any) -> Options:
    return _option("--format", f"one of {', '.join(names)}", **{"default": "csv"} | how)


_OF_RATING = _option("--rating", "the code of an older rating", type=UUID) | _option(
    "--early", "export from an open study; this is logged", action="store_true"
)
_CONTESTANT = _option("--contestant", "the slug of one; all unless given")
_DRIVEN = "as it was simulated with"
_FAULT_SOURCES = {"choices": ["labels", "votes"], "default": "labels"}

KINDS: dict[str, ExportKind] = {
    **{
        name: ExportKind(
            "study",
            RATING_FILES[name].help,
            write,
            _format([*RATING_FILES[name].formats, *more]) | _OF_RATING,
        )
        for name, write, more in (
            ("leaderboard", _write_rating, ["zip"]),
            ("agreement", _write_rating, []),
            ("votes", _write_votes, []),
        )
    },
    "preferences": ExportKind(
        "study",
        "the votes of a closed study with scenes and modifications, to train and test on",
        _write_preferences,
        _option("--pairs", "only preferences, as chosen and rejected", action="store_true")
        | _format(PREFERENCE_FORMATS, default="jsonl"),
    ),
    "methods": ExportKind(
        "study",
        "how the study was held and rated: a paragraph, or the sheet of HEDS",
        lambda options, say: _write(
            Export(METHODS_FORMATS, read_methods), options["format"], lambda: _snapshot(options)
        ),
        _format(METHODS_FORMATS, default="latex") | _OF_RATING,
    ),
    "chart": ExportKind(
        "study",
        "a chart of the newest rating beside the table's",
        _write_rating,
        _option("--chart", "which", choices=CHARTS, required=True)
        | _format(RATING_FILES["pairs"].formats, default="svg")
        | _OF_RATING,
    ),
    "displacement": ExportKind(
        "job",
        "how far from the references",
        lambda options, say: _write_table(_DISPLACEMENT[options["by"]], options),
        _option("--by", "grouped by, or a row an object", choices=_DISPLACEMENT, default="type")
        | _format(JOB_FILES["displacement-by-type"].formats),
    ),
    "samples": ExportKind(
        "job",
        "a sheet of pictures with captions",
        _write_samples,
        _option("--scenarios", "slugs, top to bottom", nargs="+", required=True)
        | _option("--contestants", "left to right", nargs="+", required=True)
        | _option("--sample", "which one of each cell", type=int, default=1)
        | _format([*SHEET_FORMATS, "or what the file's ending says"], default=None),
    ),
    "driving": ExportKind(
        "job",
        "mean driving scores of what was simulated",
        _write_driving,
        _option("--score", "whose rules", choices=list(SCORES), default="nuplan")
        | _option("--planner", _DRIVEN, default="pdm-closed")
        | _option("--offsets", _DRIVEN, default="paper")
        | _option(
            "--planners",
            "compare several, each a PLANNER or a PLANNER:OFFSETS, replayed, on the same drives",
            nargs="+",
        )
        | _option("--reactive", _DRIVEN, action="store_true")
        | _format(JOB_FILES["driving-nuplan"].formats),
    ),
    **{
        name: ExportKind(
            "job",
            table.help,
            lambda options, say: _write_table(options["what"], options),
            _format(table.formats, default=next(iter(table.formats))),
        )
        for name, table in JOB_FILES.items()
        if table.help
    },
    "faults": ExportKind(
        "job",
        JOB_FILES["faults"].help,
        _write_faults,
        _option("--from", "what experts labelled, or marked on ballots", **_FAULT_SOURCES)
        | _format(JOB_FILES["faults"].formats),
    ),
    "analyses": ExportKind(
        "job",
        "pairs of contestants, wordings, refusals",
        lambda options, say: _write_table(f"analyses-{options['part']}", options),
        _option("--part", "which", choices=list(ANALYSES), required=True)
        | _format(JOB_FILES["analyses-pairs"].formats),
    ),
    "scenarios": ExportKind(
        "job",
        "what a job made, in a standard format",
        _write_scenarios,
        _format([*scenario_export.FORMATS, "OUT is a folder"], required=True, default=None)
        | _CONTESTANT,
    ),
}


class Command(TerminalCommand):
    """One subcommand per kind of result."""

    help = "Write results to files; the same snapshot or job always gives the same bytes."
    failure = "Nothing was exported."

    def add_arguments(self, parser: CommandParser) -> None:
        """Add the kinds of export, the study or job, and the target."""
        kinds = parser.add_subparsers(dest="what", required=True, metavar="WHAT")
        for name, kind in KINDS.items():
            one = kinds.add_parser(name, help=kind.help)
            one.add_argument(kind.of, help="its name or its code")
            for flag, how in kind.options.items():
                one.add_argument(flag, **how)
            one.add_argument("--out", required=True, help="a file; - for standard output")
        whole = kinds.add_parser("study", help="a whole study")
        whole.add_argument("study", help="its name or its code; it is closed")
        handed_out = kinds.add_parser("benchmark", help="what entrants of a benchmark get")
        handed_out.add_argument("benchmark", help="its name, such as hard or hard@2, or its code")
        board = kinds.add_parser("board", help="all tables of a board, for any web host")
        board.add_argument("board", help="its name or its code")
        for one in (whole, handed_out, board):
            one.add_argument("--out", required=True, help="a folder; a new one but for boards")

    def handle(self, *args: Any, **options: Any) -> None:
        """Write the file."""
        if options["what"] in KINDS:
            self._deliver(KINDS[options["what"]].write(options, self.stderr.write), options["out"])
            return
        if options["what"] == "benchmark":
            row = find_benchmark(options["benchmark"])
            for warning in write_benchmark(row, Path(options["out"])):
                self.stderr.write(f"Warning: {warning}")
        elif options["what"] == "board":
            write_folder(board_folder(board_named(options["board"])), Path(options["out"]))
        else:
            study = study_named(options["study"])
            write_study(study, Path(options["out"]), say=self.stderr.write)
        self.stderr.write(f"Wrote {options['out']}.")

    def _deliver(self, written: ExportedFile, out: str) -> None:
        if out == "-":
            if not written.is_text:
                raise CommandError(f"A {written.suffix} file can't go to a terminal: name a file.")
            self.stdout.write_data(written.content.decode())
            return
        path = Path(out)
        if written.name and path.suffix != f".{written.suffix}":
            path.mkdir(parents=True, exist_ok=True)
            path /= written.name
        write_whole(path, written.content)
        self.stderr.write(f"Wrote {path}.")
