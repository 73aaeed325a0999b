"""Who scored what against whom, as the cells of a table: pages and files show the same."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from arena.exports.tables import Row
from arena.rating.lines import whole_percent
from arena.rating.snapshot_document import PairRecord

STRONG = 0.3
"""So far from even a score has the full colour: experts who tie often leave little beyond."""
STEPS = 10
FEW = 30


@dataclass(frozen=True, slots=True, kw_only=True)
class HeatCell:
    """One contestant against another.

    Attributes:
        share: The row's mean score, a tie half; None without votes.
        step: How far towards the row it is, 0 to 10; the colour.
        planned: How often the pair was to be judged, None where nothing was planned.
    """

    other: Row
    share: float | None
    step: int
    votes: int
    planned: int | None
    is_few: bool

    @property
    def percent(self) -> int | None:
        """The share in percent."""
        return None if self.share is None else whole_percent(self.share)


@dataclass(frozen=True, slots=True, kw_only=True)
class HeatRow:
    """A row of the table; the cell against itself is None."""

    number: int
    row: Row
    cells: list[HeatCell | None]


def heat_map(pairs: Sequence[PairRecord], rows: Sequence[Row]) -> list[HeatRow]:
    """The table, contestants in the given order both ways.

    Args:
        pairs: As a snapshot keeps them: wins, ties and losses of `a` against `b`.
        rows: The contestants.
    """
    found: dict[tuple[str, str], tuple[float, int, int | None]] = {}
    for pair in pairs:
        score = pair.wins + pair.ties / 2
        found[pair.a, pair.b] = (score, pair.votes, pair.planned)
        found[pair.b, pair.a] = (pair.votes - score, pair.votes, pair.planned)
    return [
        HeatRow(number=n, row=row, cells=[_cell(row, other, found) for other in rows])
        for n, row in enumerate(rows, start=1)
    ]


def _step(share: float) -> int:
    towards = (share - 0.5) / STRONG
    return round(STEPS * (min(max(towards, -1.0), 1.0) + 1.0) / 2.0)


def _cell(
    row: Row, other: Row, found: dict[tuple[str, str], tuple[float, int, int | None]]
) -> HeatCell | None:
    if row.slug == other.slug:
        return None
    score, votes, planned = found.get((row.slug, other.slug), (0.0, 0, None))
    share = score / votes if votes else None
    return HeatCell(
        other=other,
        share=share,
        step=_step(0.5 if share is None else share),
        votes=votes,
        planned=planned,
        is_few=votes < FEW,
    )
