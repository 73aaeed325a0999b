"""manage.py rate_csv without Django: it rates a file and needs neither settings nor a database.

manage.py comes here directly; `call_command("rate_csv")` takes the same way.
"""

from __future__ import annotations

import json
import sys
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from arena.rating.bootstrap import Unit
from arena.rating.leaderboard import Intervals, Leaderboard, Line, Method, Order, rate
from arena.rating.printed import HEADS as PAPERS_HEADS
from arena.rating.printed import (
    escape,
    interval_text,
    latex_table,
    notes_by_reason,
    places_text,
    rank_text,
    rating_text,
)
from arena.rating.rules import METHOD_TEXTS, unit_for
from arena.rating.votes_file import VotesFile, VotesFileUnreadable, columns_of, read_votes
from arena.services.cells import csv_text
from augment.sentences import escape_controls

HELP = (
    "Rate votes from a file (CSV, JSON lines, Parquet): columns model_a, model_b, winner, and "
    "maybe judge and item."
)
RESAMPLES = {
    "vote": Unit.VOTE,
    "judge": Unit.EXPERT,
    "item": Unit.SCENARIO,
    "two-way": Unit.TWO_WAY,
}
METHODS = {one.value: one for one in Method}
INTERVALS = {"closed": Intervals.CLOSED_FORM, "resamples": Intervals.RESAMPLES}
MOST_PAIRS = 100_000
"""Above so many pairs JSON holds only those that are told apart."""
_CLUSTERS = {"vote": (), "judge": ("judge",), "item": ("item",), "two-way": ("judge", "item")}
ROUNDS, ROUNDS_OF_MANY, MANY_VOTES = 10_000, 1000, 500_000
MOST_ROUNDS = 100_000


class CsvNotRated(ValueError):
    """The file or the options are not what they should be; the text says what is allowed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RatedCsv:
    """What came out for a file, and how it was asked."""

    board: Leaderboard
    resample: str
    notes: tuple[str, ...]

    @property
    def standings(self) -> list[Line]:
        """Best first within each part; who has neither rating nor rank comes last."""
        return list(self.board.standings)

    @property
    def missing(self) -> list[str]:
        """What is missing in which lines, and why."""
        return notes_by_reason((line.name, line.note) for line in self.board.standings)

    @property
    def method_text(self) -> str:
        """How the numbers came about."""
        found = (
            f"in closed form (moderated sandwich by {self.resample}, Student's t)"
            if self.board.intervals is Intervals.CLOSED_FORM
            else f"by {self.board.rounds} resamples ({self.resample})"
        )
        return (
            f"{METHOD_TEXTS[self.board.method]}; 95 % intervals {found}, "
            f"seed {self.board.seed}; {self.board.votes} votes"
        )

    @property
    def cross_check(self) -> float | None:
        """By how many points the bounds of the plain sandwich differ at most."""
        gaps = [
            max(abs(line.check_lower - line.lower), abs(line.check_upper - line.upper))
            for line in self.board.lines
            if line.lower is not None and line.upper is not None
            if line.check_lower is not None and line.check_upper is not None
        ]
        return max(gaps, default=None)


def main(arguments: Sequence[str]) -> int:
    """Rate a file and print; the exit code is 1 where that can't be done."""
    parser = ArgumentParser(
        prog="manage.py rate_csv", description=HELP, formatter_class=RawDescriptionHelpFormatter
    )
    add_arguments(parser)
    options = vars(parser.parse_args(arguments))
    try:
        said = run(**options)
    except CsvNotRated as error:
        print(escape_controls(f"CommandError: {error}"), file=sys.stderr)
        return 1
    sys.stdout.write(escape_controls(said) if sys.stdout.isatty() else said)
    return 0


def add_arguments(parser: ArgumentParser) -> None:
    """Which file, and how."""
    parser.add_argument(
        "file", metavar="FILE", help="UTF-8 or UTF-16; winner is model_a, model_b or tie"
    )
    parser.add_argument(
        "--method",
        choices=METHODS,
        default="bt",
        help="bt is Bradley-Terry, davidson its model of ties",
    )
    parser.add_argument(
        "--resample",
        choices=RESAMPLES,
        help="what hangs together: two-way where judge and item are there, else what there is",
    )
    parser.add_argument(
        "--intervals",
        choices=INTERVALS,
        help="closed form, or resamples; right for the method unless given",
    )
    parser.add_argument(
        "--order",
        choices=[one.value for one in Order],
        default=Order.SHUFFLED.value,
        help="online Elo's point: the median over shuffled rounds, or the order of the lines",
    )
    parser.add_argument(
        "--rounds",
        type=int,
        help=f"of the bootstrap; {ROUNDS}, above {MANY_VOTES} votes {ROUNDS_OF_MANY}",
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--format", choices=FORMATS, default="table")


def run(
    *,
    file: str,
    method: str = "bt",
    resample: str | None = None,
    intervals: str | None = None,
    order: str = "shuffled",
    rounds: int | None = None,
    seed: int = 0,
    format: str = "table",
) -> str:
    """What to print for a file.

    Raises:
        CsvNotRated: The file can't be read or the options don't fit it.
    """
    if rounds is not None and not 1 <= rounds <= MOST_ROUNDS:
        raise CsvNotRated(f"rounds go from 1 to {MOST_ROUNDS}, not {rounds}")
    if seed < 0:
        raise CsvNotRated(f"a seed is 0 or more, not {seed}")
    if method == "elo" and intervals == "closed":
        raise CsvNotRated("elo has no intervals in closed form, only resamples")
    path = Path(file)
    try:
        chosen, notes = _resample(columns_of(path), method, resample)
        votes = read_votes(path, clusters=_CLUSTERS[chosen])
    except VotesFileUnreadable as error:
        raise CsvNotRated(f"{path}: {error}") from error
    except OSError as error:
        raise CsvNotRated(f"{path}: {error.strerror}") from error
    many = votes.comparisons.votes > MANY_VOTES
    board = rate(
        votes.comparisons,
        method=METHODS[method],
        unit=RESAMPLES[chosen],
        intervals=INTERVALS[intervals] if intervals else None,
        order=Order(order),
        rounds=rounds or (ROUNDS_OF_MANY if many else ROUNDS),
        seed=seed,
    )
    rated = RatedCsv(board=board, resample=chosen, notes=_notes(board, votes, notes))
    return FORMATS[format](rated)


def _resample(columns: Sequence[str], method: str, wanted: str | None) -> tuple[str, list[str]]:
    """What to draw, and a note where that was not asked for and is less than there could be."""
    if method == "elo":
        if wanted not in (None, "vote"):
            raise CsvNotRated(f"elo resamples single votes only; {wanted!r} needs --method bt")
        return "vote", []
    if wanted is not None:
        missing = [name for name in _CLUSTERS[wanted] if name not in columns]
        if missing:
            raise VotesFileUnreadable(
                f"line 1: there is no column {missing[0]!r}, which --resample {wanted} needs"
            )
        return wanted, []
    unit = unit_for(judges="judge" in columns, items="item" in columns)
    chosen = next(name for name, one in RESAMPLES.items() if one is unit)
    return chosen, [_MISSING[chosen]] if chosen in _MISSING else []


_MISSING = {
    "vote": "The file does not name both judge and item: single votes are resampled as if they "
    "were independent, and if they are not, the intervals are too narrow.",
    "judge": "The file names no item: votes of one judge hang together, and if those on one item "
    "do as well, the intervals are too narrow.",
    "item": "The file names no judge: votes on one item hang together, and if those of one judge "
    "do as well, the intervals are too narrow.",
}


def _notes(board: Leaderboard, votes: VotesFile, notes: list[str]) -> tuple[str, ...]:
    said = [board.explanation, *notes, *map(_in_their_words, board.warnings)]
    if votes.repeats:
        said.append(
            f"{votes.repeats} votes repeat an earlier one of the same judge, item and pair; all "
            "are counted."
        )
    return tuple(filter(None, said))


def _in_their_words(warning: str) -> str:
    return warning.replace("expert", "judge").replace("scenario", "item")


COLUMNS = ("model", "rank", "rating", "lower", "upper", "votes", "note", "rank_best", "rank_worst")
"""Those of CSV and JSON; a new one comes at the end."""
_CHECKS = ("check_lower", "check_upper")

# --- Formats -------------------------------------------------------------------------------------


HEADS = (*PAPERS_HEADS, "95% ranks")


def _cells(rated: RatedCsv) -> Iterator[tuple[str, ...]]:
    """Model, rank, rating, interval, votes, rank set."""
    for line in rated.standings:
        yield (
            line.name,
            rank_text(line.rank),
            rating_text(line.rating),
            interval_text(line.rating, line.lower, line.upper),
            str(line.votes),
            places_text(line.rank_best, line.rank_worst),
        )


def _table(rated: RatedCsv) -> str:
    rows = [HEADS, *_cells(rated)]
    rows = [(escape_controls(" ".join(row[0].split())), *row[1:]) for row in rows]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join(
            [row[0].ljust(widths[0])]
            + [text.rjust(width) for text, width in zip(row[1:], widths[1:], strict=True)]
        )
        for row in rows
    ]
    lines = [lines[0], *_under_their_groups(rated, lines[1:])]
    ties = rated.board.tie_share
    said = [] if ties is None else [f"{rated.method_text}; {ties:.1%} ties."]
    missing = [" ".join(f"{line}.".split()) for line in rated.missing]
    said += _judged(rated)
    return "\n".join([*lines, "", *missing, *said, *rated.notes]) + "\n"


def _under_their_groups(rated: RatedCsv, lines: list[str]) -> Iterator[str]:
    """The lines of models, with a head over each group where they were never compared."""
    parts = [line.part for line in rated.standings]
    several = len({part for part in parts if part >= 0}) > 1
    for place, (part, line) in enumerate(zip(parts, lines, strict=True)):
        if several and (place == 0 or part != parts[place - 1]):
            yield f"group {part + 1}, rated by itself:" if part >= 0 else "not rated:"
        yield line


def _judged(rated: RatedCsv) -> list[str]:
    """How many pairs are told apart, and how far the cross-check differs."""
    said = []
    found = rated.board.told_apart
    if found is not None:
        models = len(rated.board.lines)
        said.append(
            f"{int(found.above.sum())} of {models * (models - 1) // 2} pairs are told apart with "
            "all of them judged at once, at 5 % for the whole table."
        )
    if rated.cross_check is not None:
        said.append(
            f"Bounds by the plain sandwich differ from these by at most {rated.cross_check:.0f} "
            "points."
        )
    return said


def _csv(rated: RatedCsv) -> str:
    """One line a model; what is unknown is empty. Notes go to the other formats."""
    for note in rated.notes:
        print(escape_controls(note), file=sys.stderr)
    return csv_text(
        COLUMNS,
        ([_value(line, column) for column in COLUMNS] for line in rated.standings),
    )


def _json(rated: RatedCsv) -> str:
    board = rated.board
    parts = {line.part for line in board.lines if line.rating is not None}
    document: dict[str, Any] = {
        "method": board.method.value,
        "resample": rated.resample,
        "intervals": board.intervals.value,
        "rounds": board.rounds,
        "degenerate_rounds": board.degenerate_rounds,
        "seed": board.seed,
        "votes": board.votes,
        "tie_share": _rounded(board.tie_share),
        "status": board.status.value,
        "notes": list(rated.notes),
        "standings": [
            {column: _value(line, column, digits=4) for column in (*COLUMNS, *_CHECKS)}
            | ({"part": line.part} if len(parts) > 1 else {})
            for line in rated.standings
        ],
        "pairs": _pairs(board),
    }
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


def _latex(rated: RatedCsv) -> str:
    in_paper = rated.board.intervals is Intervals.RESAMPLES  # whose table has no rank sets
    heads = PAPERS_HEADS if in_paper else HEADS
    rows = ((escape(name), *rest)[: len(heads)] for name, *rest in _cells(rated))
    comments = (rated.method_text, *rated.notes)
    return latex_table(rows, comments=comments, heads=heads, notes=rated.missing)


def _pairs(board: Leaderboard) -> list[dict[str, Any]] | None:
    """Pairs with p-values adjusted for all of them; None where these were not judged."""
    found = board.told_apart
    if found is None:
        return None
    low, high = np.triu_indices(len(board.lines), 1)
    if len(low) > MOST_PAIRS:
        apart = (found.above | found.above.T)[low, high]
        low, high = low[apart], high[apart]
    return [
        {
            "a": board.lines[i].name,
            "b": board.lines[j].name,
            "difference": _rounded(float(found.difference[i, j])),
            "p_adjusted": _rounded(float(found.p_value[i, j])),
            "told_apart": bool(found.above[i, j] or found.above[j, i]),
        }
        for i, j in zip(low.tolist(), high.tolist(), strict=True)
        if not np.isnan(found.p_value[i, j])
    ]


def _value(line: Line, column: str, *, digits: int | None = None) -> object:
    """What a line has in a column of CSV and JSON."""
    value = getattr(line, "name" if column == "model" else column)
    return round(value, digits) if digits is not None and isinstance(value, float) else value


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 4)


FORMATS: dict[str, Callable[[RatedCsv], str]] = {
    "table": _table,
    "csv": _csv,
    "json": _json,
    "latex": _latex,
}
