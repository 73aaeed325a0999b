"""The columns of a leaderboard: one list for every file, the terminal and the page.

In: a table and a row of it. Out: the value of each column, with its name wherever it stands. A new
column is an entry at the end of COLUMNS, so that what reads files by position goes on; one that is
stored needs a field of `arena.rating.lines.Line` and, with a migration, of `Standing`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

from arena.exports.parquet import NUMBER, TEXT, WHOLE, YES_NO
from arena.exports.tables import LeaderboardTable, Row

ELO_POINTS, VOTES, PLACE, PERCENT = "Elo points", "votes", "place", "%"


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """A column, and where it stands: nowhere where the name for a place is empty.

    Attributes:
        name: In CSV and Parquet.
        kind: What Parquet holds.
        unit: Empty for words.
        value: Of a contestant's row; of the whole table with `of_table`.
        key: In JSON.
        printed: Its head in LaTeX and in the terminal.
        page: Its head on the page.
        text: How a value is printed, in LaTeX, in the terminal and on the page.
        identifies: Says whose line it is, which stands first in JSON and where it is printed.
    """

    value: Callable[[Any], object]
    kind: str = TEXT
    unit: str = ""
    name: str = ""
    key: str = ""
    printed: str = ""
    page: str | None = None
    text: Callable[[Row], str] = str
    identifies: bool = False
    of_table: bool = False

    def value_of(self, table: LeaderboardTable, row: Row) -> object:
        """What stands in files."""
        return self.value(table if self.of_table else row)


def _column(name: str, kind: str = TEXT, field: str = "", **more: Any) -> Column:
    """Of a field of the row, called alike in JSON."""
    field = field or name
    settings: dict[str, Any] = {"key": name, "text": lambda row: str(getattr(row, field))} | more
    return Column(name=name, kind=kind, value=attrgetter(field), **settings)


COLUMNS = (
    _column("rank", WHOLE, unit=PLACE, printed="Rank", page="Rank",
            text=attrgetter("rank_text")),
    _column("model", printed="Model", page="Contestant", identifies=True),
    _column("elo", NUMBER, "rating", unit=ELO_POINTS, key="rating", printed="Elo",
            page="Elo", text=attrgetter("elo_text")),
    _column("lower", NUMBER, unit=ELO_POINTS),
    _column("upper", NUMBER, unit=ELO_POINTS),
    Column(value=attrgetter("interval_text"), unit=ELO_POINTS, printed="95% CI",
           page="95 % CI", text=attrgetter("interval_text")),
    _column("votes", WHOLE, unit=VOTES, printed="Votes", page="Votes"),
    Column(value=attrgetter("score_percent"), unit=PERCENT, page="Score",
           text=lambda row: f"{row.score_percent} %" if row.votes else "–"),
    _column("wins", WHOLE, unit=VOTES, page="Won"),
    _column("ties", WHOLE, unit=VOTES, page="Tied"),
    _column("losses", WHOLE, unit=VOTES, page="Lost"),
    _column("slug", identifies=True),
    _column("kind", identifies=True),
    _column("simulated", YES_NO, identifies=True),
    _column("note"),
    _column("study", key="", of_table=True),
    _column("method", field="method_text", key="", of_table=True),
    _column("study_simulated", YES_NO, "simulated", key="", of_table=True),
    _column("early", YES_NO, key="", of_table=True),
    _column("rank_best", WHOLE, unit=PLACE),
    _column("rank_worst", WHOLE, unit=PLACE),
    _column("preregistration", key="", of_table=True),
    Column(value=attrgetter("ranks_text"), unit=PLACE, printed="95% ranks",
           text=attrgetter("ranks_text")),
    _column("options"),
)  # fmt: skip

IN_FILES = tuple(column for column in COLUMNS if column.name)
ON_PAGE = tuple(column for column in COLUMNS if column.page)
_WHOSE_FIRST = sorted(COLUMNS, key=lambda column: not column.identifies)
IN_JSON = tuple(column for column in _WHOSE_FIRST if column.key)
PRINTED = tuple(column for column in _WHOSE_FIRST if column.printed)
