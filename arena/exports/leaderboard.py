"""The columns of a leaderboard: of a study's rating, of a board's table, of a rated file of votes.

Every writer takes its columns from here, so that one of them has one name wherever it stands. No
Django.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

from arena.exports.cells import Columns, Dtype, Value

RATING, BOARD, VOTES_FILE = "rating", "board", "votes file"
PLACES = "95% ranks"
_ALL = (RATING, BOARD, VOTES_FILE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """A column of leaderboards.

    A new one is an entry at the end of COLUMNS, so that what reads files by position goes on; one
    that is stored needs a field of `arena.rating.lines.Line` and, with a migration, of `Standing`.

    Attributes:
        name: In CSV, JSON and Parquet; empty for what is only printed.
        kind: What Parquet holds.
        field: Of a line; of a whole table where there is no key.
        of: The leaderboards whose files have it.
        key: In the JSON of a rating; empty where a whole table says it once.
        printed: Its head in LaTeX and on a terminal, and the field that stands there.
        identifies: Says whose line it is, which stands first where it is printed.
        is_old: Also of ratings that did not count settled ties apart.
    """

    name: str
    kind: Dtype
    field: Value
    of: tuple[str, ...]
    key: str
    printed: tuple[str, str] | None = None
    identifies: bool = False
    is_old: bool = True


def _column(name: str, kind: Dtype = Dtype.TEXT, *of: str, **more: Any) -> Column:
    """Return a column that unless said otherwise is called the same everywhere."""
    usual = {"name": name, "kind": kind, "field": name, "key": name, "of": of or (RATING,)}
    return Column(**usual | more)


COLUMNS = (
    _column("rank", Dtype.WHOLE, *_ALL, printed=("Rank", "rank_text")),
    _column("model", Dtype.TEXT, RATING, VOTES_FILE, printed=("Model", "model"), identifies=True),
    _column("contestant", Dtype.TEXT, BOARD, field="name"),
    _column("elo", Dtype.NUMBER, *_ALL, field="rating", key="rating", printed=("Elo", "elo_text")),
    _column("lower", Dtype.NUMBER, *_ALL),
    _column("upper", Dtype.NUMBER, *_ALL),
    _column("", printed=("95% CI", "interval_text")),
    _column("votes", Dtype.WHOLE, *_ALL, field="votes_cast", printed=("Votes", "votes_cast")),
    _column("wins", Dtype.WHOLE, RATING, BOARD),
    _column("ties", Dtype.WHOLE, RATING, BOARD, field="ties_cast"),
    _column("losses", Dtype.WHOLE, RATING, BOARD),
    _column("slug", Dtype.TEXT, RATING, BOARD, identifies=True),
    _column("kind", Dtype.TEXT, RATING, BOARD, identifies=True),
    _column("simulated", Dtype.YES_NO, RATING, BOARD, field="is_simulated", identifies=True),
    _column("since", Dtype.TEXT, BOARD),
    _column("authors", Dtype.TEXT, BOARD, field=lambda line: "; ".join(line.authors)),
    _column("open", Dtype.YES_NO, BOARD, field="is_open"),
    _column("note", Dtype.TEXT, *_ALL),
    _column("study", key="", field="snapshot.study.name"),
    _column("method", key="", field="method_text"),
    _column("study_simulated", Dtype.YES_NO, key="", field="snapshot.includes_simulated"),
    _column("early", Dtype.YES_NO, key="", field="snapshot.is_early"),
    _column("rank_best", Dtype.WHOLE, *_ALL),
    _column("rank_worst", Dtype.WHOLE, *_ALL),
    _column("preregistration", key=""),
    _column("", printed=(PLACES, "ranks_text")),
    _column("options"),
    _column("question", key="", field="snapshot.question"),
    _column("sends"),
    _column("settled_ties", Dtype.WHOLE, RATING, BOARD, is_old=False),
    _column("votes_sha256", key="", field="snapshot.votes_sha256", is_old=False),
    _column("remarks", Dtype.TEXT, BOARD, key="", field=lambda table: " ".join(table.notes)),
    _column("submitted", Dtype.WHOLE, BOARD),
    _column("withdrawn", Dtype.WHOLE, BOARD),
    _column("provisional", Dtype.YES_NO, BOARD, field="is_provisional"),
)
WHOSE_FIRST = sorted(COLUMNS, key=lambda column: not column.identifies)
_PRINTED = dict(column.printed for column in WHOSE_FIRST if column.printed)


def print_lines(lines: Sequence[Any], *, has_places: bool = True) -> list[list[str]]:
    """Return the heads, then what is printed of each line, its name first.

    Args:
        lines: Those of a rating or of a file.
        has_places: Whether the places left are among them.
    """
    fields = {head: field for head, field in _PRINTED.items() if has_places or head != PLACES}
    cells = ([str(getattr(line, field)) for field in fields.values()] for line in lines)
    return [list(fields), *cells]


def list_columns(leaderboard: str, *, is_old: bool = False) -> list[Column]:
    """Return the columns of a leaderboard, those that say whose line it is first."""
    return [
        column
        for column in WHOSE_FIRST
        if leaderboard in column.of and (column.is_old or not is_old)
    ]


def file_columns(leaderboard: str, table: Any, *, is_old: bool = False) -> Columns:
    """Return the columns of a leaderboard's files, as sheets take them.

    Args:
        leaderboard: Which.
        table: That whose lines are written; some columns have the same value in all of them.
        is_old: Whether it is of before settled ties were counted apart.
    """
    chosen = list_columns(leaderboard, is_old=is_old)
    return {
        column.name: (column.field if column.key else _once(column.field, table), column.kind)
        for column in sorted(chosen, key=COLUMNS.index)
        if column.name
    }


def _once(field: Value, table: Any) -> Value:
    """Return a reader of a field of the table, the same for every line."""
    read = field if callable(field) else attrgetter(field)
    return lambda line: read(table)
