"""What `rate_csv` prints of a rating: a table, CSV, JSON or LaTeX."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from arena.rating.leaderboard import Intervals, Leaderboard, Line
from arena.rating.lines import HEADS as PAPERS_HEADS
from arena.rating.lines import caption_text, escape, latex_table, notes_by_reason
from arena.rating.logistic import Coefficient
from arena.rating.ranking import Separation
from arena.rating.rules import METHOD_TEXTS, Unit
from arena.services.cells import csv_text
from augment.escaping import escape_controls

COLUMNS = ("model", "rank", "elo", "lower", "upper", "votes", "note", "rank_best", "rank_worst")
"""Those of CSV and JSON; a new one comes at the end."""
_CHECKS = ("check_lower", "check_upper")
HEADS = (*PAPERS_HEADS, "95% ranks")
_CLUSTERED = {
    Unit.VOTE: "single votes",
    Unit.EXPERT: "clustered by judge",
    Unit.SCENARIO: "clustered by item",
    Unit.TWO_WAY: "clustered by judge and item",
}
MOST_PAIRS = 100_000
"""Above so many pairs JSON holds only those that are told apart."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RatedCsv:
    """What came out for a file, and how it was asked.

    Attributes:
        knows_clusters: Whether the intervals know of every column by which votes hang together.
    """

    board: Leaderboard
    notes: tuple[str, ...]
    knows_clusters: bool
    covariates: tuple[str, ...] = ()

    @property
    def standings(self) -> list[Line]:
        """Best first within each part; who has neither rating nor rank comes last."""
        return list(self.board.standings)

    @property
    def told_apart(self) -> Separation | None:
        """The pairs that differ with all judged at once; None where that can't be said."""
        return self.board.told_apart if self.knows_clusters else None

    @property
    def missing(self) -> list[str]:
        """What is missing in which lines, and why."""
        return notes_by_reason((line.name, line.note) for line in self.board.standings)

    @property
    def method_text(self) -> str:
        """How the numbers came about, and of how many votes."""
        return f"{self.how}; {self.board.votes} votes"

    @property
    def how(self) -> str:
        """How the numbers came about."""
        found = (
            f"in closed form ({_CLUSTERED[self.board.unit]})"
            if self.board.intervals is Intervals.CLOSED_FORM
            else f"by {self.board.rounds} resamples ({self.board.unit.value})"
        )
        adjusted = f", adjusted for {', '.join(self.covariates)}" if self.coefficients else ""
        text = f"{METHOD_TEXTS[self.board.method]}{adjusted}; 95 % intervals {found}"
        return f"{text}, seed {self.board.seed}"

    @property
    def coefficients(self) -> list[tuple[str, Coefficient]]:
        """What is adjusted for; none where the votes do not determine what it is worth."""
        return list(zip(self.covariates, self.board.coefficients, strict=False))

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


def _cells(rated: RatedCsv) -> Iterator[tuple[str, ...]]:
    """Model, rank, rating, interval, votes, rank set."""
    for line in rated.standings:
        yield (
            line.name,
            line.rank_text,
            line.elo_text,
            line.interval_text,
            str(line.votes),
            line.ranks_text,
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
    said += [_adjusted(name, one) for name, one in rated.coefficients]
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
    found = rated.told_apart
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


def _adjusted(name: str, one: Coefficient) -> str:
    points, p_value = one.points, one.p_value
    if points.lower is None or p_value is None:
        return f"{name}: {points.value:+.1f} points for one."
    said = f"{points.value:+.1f} points for one, 95 % {points.lower:+.1f} to {points.upper:+.1f}"
    return f"{name}: {said}, p {p_value:.2g}."


def _csv(rated: RatedCsv) -> str:
    """One line a model; what is unknown is empty. Notes go to the other formats."""
    for note in rated.notes:
        print(escape_controls(note), file=sys.stderr)
    return csv_text(
        COLUMNS, ([_value(line, column) for column in COLUMNS] for line in rated.standings)
    )


def _json(rated: RatedCsv) -> str:
    board = rated.board
    parts = {line.part for line in board.lines if line.rating is not None}
    document: dict[str, Any] = {
        "method": board.method.value,
        "resample": board.unit.value,
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
        "pairs": _pairs(board, rated.told_apart),
    }
    if rated.covariates:
        document["covariates"] = [
            {
                "name": name,
                "points": _rounded(one.points.value),
                "lower": _rounded(one.points.lower),
                "upper": _rounded(one.points.upper),
                "p": _rounded(one.p_value),
            }
            for name, one in rated.coefficients
        ]
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


def _latex(rated: RatedCsv) -> str:
    in_paper = rated.board.intervals is Intervals.RESAMPLES  # whose table has no rank sets
    heads = PAPERS_HEADS if in_paper else HEADS
    rows = ((escape(name), *rest)[: len(heads)] for name, *rest in _cells(rated))
    comments = (rated.method_text, *rated.notes)
    board = rated.board
    caption = caption_text(
        rated.how, votes=board.votes, experts=board.experts, scenarios=board.scenarios
    )
    return latex_table(rows, comments=comments, heads=heads, notes=rated.missing, caption=caption)


def _pairs(board: Leaderboard, found: Separation | None) -> list[dict[str, Any]] | None:
    """Pairs with p-values adjusted for all of them; None where these were not judged."""
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
            "lower": _rounded(float(found.difference[i, j] - found.half[i, j])),
            "upper": _rounded(float(found.difference[i, j] + found.half[i, j])),
            "p_adjusted": float(found.p_value[i, j]),
            "told_apart": bool(found.above[i, j] or found.above[j, i]),
        }
        for i, j in zip(low.tolist(), high.tolist(), strict=True)
        if not np.isnan(found.p_value[i, j])
    ]


def _value(line: Line, column: str, *, digits: int | None = None) -> object:
    """What a line has in a column of CSV and JSON."""
    value = getattr(line, {"model": "name", "elo": "rating"}.get(column, column))
    return round(value, digits) if digits is not None and isinstance(value, float) else value


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 4)


FORMATS: dict[str, Callable[[RatedCsv], str]] = {
    "table": _table,
    "csv": _csv,
    "json": _json,
    "latex": _latex,
}
