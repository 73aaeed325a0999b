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

from arena.rating.bootstrap import Unit
from arena.rating.leaderboard import Leaderboard, Line, Method, rate
from arena.rating.printed import (
    escape,
    interval_text,
    latex_table,
    notes_by_reason,
    rank_text,
    rating_text,
)
from arena.rating.votes_file import VotesFile, VotesFileUnreadable, columns_of, read_votes
from arena.services.cells import csv_text
from augment.sentences import escape_controls

HELP = "Rate votes from a CSV file: columns model_a, model_b, winner, and maybe judge and item."
RESAMPLES = {
    "vote": Unit.VOTE,
    "judge": Unit.EXPERT,
    "item": Unit.SCENARIO,
    "two-way": Unit.TWO_WAY,
}
METHODS = {"bt": Method.BRADLEY_TERRY, "elo": Method.ELO}
METHOD_TEXTS = {"bt": "Bradley-Terry on the Elo scale", "elo": "online Elo, median over resamples"}
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
        return (
            f"{METHOD_TEXTS[self.board.method]}; 95 % intervals by {self.board.rounds} resamples "
            f"({self.resample}), seed {self.board.seed}; {self.board.votes} votes"
        )


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
    parser.add_argument("file", metavar="FILE", help="UTF-8; winner is model_a, model_b or tie")
    parser.add_argument("--method", choices=METHODS, default="bt", help="bt is Bradley-Terry")
    parser.add_argument(
        "--resample",
        choices=RESAMPLES,
        help="what the bootstrap draws; two-way where judge and item are there, else vote",
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
        rounds=rounds or (ROUNDS_OF_MANY if many else ROUNDS),
        seed=seed,
        details=False,
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
    if len(columns) == len(_CLUSTERS["two-way"]):
        return "two-way", []
    return "vote", [
        "The file does not name both judge and item: single votes are resampled as if they were "
        "independent, and if they are not, the intervals are too narrow."
    ]


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


# --- Formats -------------------------------------------------------------------------------------


def _cells(rated: RatedCsv) -> Iterator[tuple[str, str, str, str, str]]:
    """Model, rank, rating, interval, votes."""
    for line in rated.standings:
        yield (
            line.name,
            rank_text(line.rank),
            rating_text(line.rating),
            interval_text(line.rating, line.lower, line.upper),
            str(line.votes),
        )


def _table(rated: RatedCsv) -> str:
    rows = [("Model", "Rank", "Elo", "95% CI", "Votes"), *_cells(rated)]
    rows = [(escape_controls(" ".join(row[0].split())), *row[1:]) for row in rows]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join(
            [row[0].ljust(widths[0])]
            + [text.rjust(width) for text, width in zip(row[1:], widths[1:], strict=True)]
        )
        for row in rows
    ]
    ties = rated.board.tie_share
    said = [] if ties is None else [f"{rated.method_text}; {ties:.1%} ties."]
    missing = [" ".join(f"{line}.".split()) for line in rated.missing]
    return "\n".join([*lines, "", *missing, *said, *rated.notes]) + "\n"


def _csv(rated: RatedCsv) -> str:
    """One line a model; what is unknown is empty. Notes go to the other formats."""
    for note in rated.notes:
        print(escape_controls(note), file=sys.stderr)
    return csv_text(
        ("model", "rank", "rating", "lower", "upper", "votes", "note"),
        (
            (line.name, line.rank, line.rating, line.lower, line.upper, line.votes, line.note)
            for line in rated.standings
        ),
    )


def _json(rated: RatedCsv) -> str:
    board = rated.board
    parts = {line.part for line in board.lines if line.rating is not None}
    document: dict[str, Any] = {
        "method": board.method.value,
        "resample": rated.resample,
        "rounds": board.rounds,
        "degenerate_rounds": board.degenerate_rounds,
        "seed": board.seed,
        "votes": board.votes,
        "tie_share": _rounded(board.tie_share),
        "status": board.status.value,
        "notes": list(rated.notes),
        "standings": [
            {
                "model": line.name,
                "rank": line.rank,
                "rating": _rounded(line.rating),
                "lower": _rounded(line.lower),
                "upper": _rounded(line.upper),
                "votes": line.votes,
                "note": line.note,
            }
            | ({"part": line.part} if len(parts) > 1 else {})
            for line in rated.standings
        ],
    }
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


def _latex(rated: RatedCsv) -> str:
    rows = ((escape(name), *rest) for name, *rest in _cells(rated))
    comments = (rated.method_text, *rated.notes)
    return latex_table(rows, comments=comments, notes=rated.missing)


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 4)


FORMATS: dict[str, Callable[[RatedCsv], str]] = {
    "table": _table,
    "csv": _csv,
    "json": _json,
    "latex": _latex,
}
