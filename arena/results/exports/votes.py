"""Votes as files: those of a rating in the column form of Chatbot Arena, and a list of any."""

from collections.abc import Iterator

from arena.exports.cells import csv_parts, csv_text
from arena.exports.formats import Dtype, Sheet, formats, sheet_csv, sheet_parquet
from arena.models import Snapshot, Study
from arena.rating import vote_columns
from arena.results.queries.evidence import ListedVote, each_vote
from arena.results.queries.judges import judge_name, list_answered_pairs
from arena.results.queries.search import VoteSearch
from arena.results.queries.votes import RATED, Filters, RatedVote, current_votes, last_vote_id
from arena.results.services import vote_files
from arena.results.services.ratings import read_votes, votes_version
from augment.models import JudgeRun
from augment.services.running import exchange

_KINDS = {"ms_visible": Dtype.WHOLE, "simulated": Dtype.YES_NO, "position": Dtype.WHOLE}

LIST_COLUMNS = (*vote_columns.vote_columns(4), "mark", "reason", "vote", "faults")
"""Those of the rating's own file, with why a vote does not count ("counted" where it does), why it
was skipped, and the code in its address."""

VOTE_FORMATS = formats(csv=sheet_csv, parquet=sheet_parquet)


def vote_table(snapshot: Snapshot) -> Sheet:
    """Return the votes that the rating is made of.

    Raises:
        Conflict: They are not what they were.
    """
    rows = vote_files.vote_rows(read_votes(snapshot).counted, snapshot.results.judges)
    return _sheet(rows, votes_version(snapshot))


def list_unrated(study: Study) -> Sheet:
    """Return the votes of a study that nobody rates, repeats and checks too; no skips."""
    last = last_vote_id(study)
    questions = [Filters(question=question) for question in study.questions]
    current = [vote for filters in questions for vote in current_votes(study, filters, last)]
    decided = [vote for vote in current if vote.outcome in RATED]
    names = {vote.judge: vote.judge_name for vote in decided}
    return _sheet(vote_files.vote_rows(decided, names), vote_columns.VERSION)


def _sheet(rows: Iterator[vote_files.Row], version: int) -> Sheet:
    names = vote_columns.vote_columns(version)
    return Sheet(
        name="votes",
        columns={name: _KINDS.get(name, Dtype.TEXT) for name in names},
        rows=[row[: len(names)] for row in rows],
    )


def vote_list_csv(snapshot: Snapshot, search: VoteSearch) -> Iterator[bytes]:
    """Yield all votes that are looked for, some lines at a time; names are pseudonyms."""
    return csv_parts(LIST_COLUMNS, map(_list_row, each_vote(snapshot, search)))


def _list_row(line: ListedVote) -> tuple[object, ...]:
    vote = line.given
    if isinstance(vote, RatedVote):  # whoever the tie counts for has not judged it
        *row, faults = next(vote_files.vote_rows([vote], {vote.judge: ""}))
        return (*row, line.mark, None, None, faults)
    left, right, matchup = vote.shown_left, vote.shown_right, vote.matchup
    return (
        *(left.contestant.slug, right.contestant.slug),
        vote_files.BOTH_BAD if vote.both_miss else vote_files.WINNERS.get(vote.outcome),
        *(line.judge, matchup.scenario.slug, matchup.scenario.type, matchup.kind),
        vote.outcome if vote.outcome in ("left", "right") else None,
        *(vote.ms_visible, vote.is_simulated, vote.at.isoformat(timespec="milliseconds")),
        *(matchup.position, vote.aids, vote.comment, left.code, right.code, vote.strength),
        vote.question,
        *(line.mark, vote.reason, vote.key, vote_files.faults_text(vote.faults)),
    )


COLUMNS = (
    *("judge", "question", "scenario", "order", "picture_a", "picture_b"),
    *("augmentation_a", "augmentation_b", "answer", "exchange", "reason"),
)
"""A and B are what the judge was shown first and second; `exchange` says of both answers about a
pair whether their preference was kept."""


def judge_answers_csv(run: JudgeRun) -> bytes:
    """Return all answers of a judge in the order of their pairs."""
    rows: list[tuple[object, ...]] = []
    for row in list_answered_pairs(run):
        about = judge_name(run), run.question, row.left.scenario.slug
        became = exchange(row.first, row.second).value
        for order, a, b, answer, reason in (
            (1, row.left, row.right, row.first, row.first_reason),
            (2, row.right, row.left, row.second, row.second_reason),
        ):
            shown = a.contestant.slug, b.contestant.slug, a.code, b.code
            rows.append((*about, order, *shown, answer, became, reason))
    return csv_text(COLUMNS, rows).encode()
