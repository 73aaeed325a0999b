"""Exports of a study's rating: its table, its votes and its charts."""

from __future__ import annotations

from typing import Any
from uuid import UUID

from arena.errors import StudyStillOpen
from arena.exports.bundle import bundle
from arena.exports.charts.rating import CONTENT_TYPES, chart_bytes
from arena.exports.contact_sheet import contact_sheet, sheet_pdf
from arena.exports.formats import format_named
from arena.exports.tables import leaderboard_table
from arena.exports.votes import VOTE_FORMATS, unrated_votes, vote_table
from arena.exports.writers import FORMATS
from arena.exports.zips import ZIP
from arena.management.exporting.kinds import Chosen, ExportedFile, Say, add_format, add_kind, fill
from arena.models import Snapshot, Study
from arena.queries.studies.results import snapshot_to_export
from arena.queries.votes.judged import is_imported
from arena.services.early_looks import log_early_look
from arena.studies.queries import study_named
from augment.errors import Conflict


def add_studies(kinds: Any) -> None:
    """What can be written of a study's newest rating, or of an older one."""
    leaderboard = add_kind(
        kinds, "leaderboard", write_leaderboard, of="study", help="the newest rating of a study"
    )
    leaderboard.add_argument(
        "--format", default="csv", help=f"one of {', '.join([*FORMATS, ZIP])}"
    )
    votes = add_kind(
        *(kinds, "votes", write_votes),
        of="study",
        help="the votes of the newest rating, with pseudonyms",
    )
    add_format(votes, VOTE_FORMATS)
    chart = add_kind(
        *(kinds, "chart", write_chart),
        of="study",
        help="a chart of the newest rating beside the table's",
    )
    chart.add_argument(
        "--chart", required=True, help="pairs, types, width, displacement, elo-usd, ..."
    )
    chart.add_argument("--format", default="svg", help=f"one of {', '.join(CONTENT_TYPES)}")
    sheet = add_kind(
        *(kinds, "contact-sheet", write_contact_sheet),
        of="study",
        help="every contestant's picture of every scenario with the votes on it, as PDF",
    )
    sheet.set_defaults(format="pdf")
    for kind in (leaderboard, votes, chart, sheet):
        kind.add_argument("--rating", type=UUID, help="the code of an older rating")
        kind.add_argument(
            "--early", action="store_true", help="export from an open study; this is logged"
        )


def write_leaderboard(options: Chosen, say: Say) -> ExportedFile:
    """The table in one format, or everything of the rating as one zip."""
    if options["format"] == ZIP:
        return ExportedFile(bundle(_snapshot(options)), ZIP, False)
    chosen = format_named(FORMATS, options["format"])
    return fill(chosen, leaderboard_table(_snapshot(options)))


def write_votes(options: Chosen, say: Say) -> ExportedFile:
    """The votes that the rating counted; of a cancelled study all that were given."""
    chosen = format_named(VOTE_FORMATS, options["format"])
    study = study_named(options["study"])
    if study.state == Study.State.CANCELLED:
        return fill(chosen, unrated_votes(study))
    return fill(chosen, vote_table(_snapshot(options)))


def write_chart(options: Chosen, say: Say) -> ExportedFile:
    """One chart of the rating."""
    form = options["format"]
    snapshot = _snapshot(options)
    content = chart_bytes(snapshot, name=options["chart"], file_format=form)
    return ExportedFile(content, form, form == "svg")


def write_contact_sheet(options: Chosen, say: Say) -> ExportedFile:
    """All scenarios of the study, side by side."""
    snapshot = _snapshot(options)
    if is_imported(snapshot.study):
        raise Conflict("Votes from a file have no pictures, so there is no contact sheet.")
    scenarios = list(snapshot.study.scenarios.defer("reference").order_by("type", "slug"))
    sheet = contact_sheet(snapshot, leaderboard_table(snapshot), scenarios)
    return ExportedFile(sheet_pdf(sheet), "pdf", False)


def _snapshot(options: Chosen) -> Snapshot:
    """The rating that is asked for; looking into an open study is written to the log."""
    study = study_named(options["study"])
    snapshot = snapshot_to_export(study, options["rating"])
    if study.state == Study.State.OPEN:
        if not options["early"]:
            raise StudyStillOpen(study.name)
        what = f"{options['what']} as {options['format']}"
        log_early_look(study=study, actor=None, what=what)
    return snapshot
