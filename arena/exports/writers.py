"""The leaderboard as a file. The same snapshot always gives the same bytes."""

from __future__ import annotations

import json
from typing import Any

from arena.exports.charts import interval_chart
from arena.exports.formats import Format, drawings, formats, rounded
from arena.exports.latex import latex
from arena.exports.parquet import NUMBER, TEXT, WHOLE, YES_NO, parquet_bytes
from arena.exports.tables import LeaderboardTable, Row
from arena.services.cells import csv_text

COLUMNS = (
    "rank", "model", "elo", "lower", "upper", "votes", "wins", "ties", "losses",
    "slug", "kind", "simulated", "note", "study", "method", "study_simulated", "early",
)  # fmt: skip

_KINDS = {
    name: {
        "rank": WHOLE, "elo": NUMBER, "lower": NUMBER, "upper": NUMBER, "votes": WHOLE,
        "wins": WHOLE, "ties": WHOLE, "losses": WHOLE, "simulated": YES_NO,
        "study_simulated": YES_NO, "early": YES_NO,
    }.get(name, TEXT)
    for name in COLUMNS
}  # fmt: skip


def csv_bytes(table: LeaderboardTable) -> bytes:
    """One line a contestant; what is unknown is empty, numbers have two decimals."""
    return csv_text(COLUMNS, (_values(table, row) for row in table.rows)).encode()


def json_bytes(table: LeaderboardTable) -> bytes:
    """An object whose `standings` is a list of {model, rank, rating, lower, upper, votes, ...}."""
    document: dict[str, Any] = {
        "format": "scenario-arena/leaderboard",
        "version": 1,
        "study": table.study,
        "simulated": table.simulated,
        "early": table.early,
        "method": {
            "name": table.method,
            "text": table.method_text,
            "resampling_unit": table.unit,
            "rounds": table.rounds,
            "degenerate_rounds": table.degenerate_rounds,
            "seed": table.seed,
        },
        "votes": {
            "counted": table.votes,
            "left_out": table.left_out,
            "sha256": table.votes_sha256,
        },
        "status": table.status,
        "standings": [_standing(table, row) for row in table.rows],
    }
    return (json.dumps(document, indent=2, ensure_ascii=False) + "\n").encode()


def parquet_of(table: LeaderboardTable) -> bytes:
    """The columns of the CSV file, typed; numbers as they are."""
    return parquet_bytes(_KINDS, [_values(table, row) for row in table.rows])


def plain_text(table: LeaderboardTable) -> str:
    """The table for a terminal, with its method and warnings beneath."""
    head = ("Model", "Rank", "Elo", "95% CI", "Votes")
    body = [
        (row.model, row.rank_text, row.elo_text, row.interval_text, str(row.votes))
        for row in table.rows
    ]
    widths = [max(len(line[column]) for line in (head, *body)) for column in range(len(head))]
    lines = [
        "  ".join(
            cell.ljust(width) if column == 0 else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(line, widths, strict=True))
        )
        for line in (head, *body)
    ]
    left_out = ", ".join(f"{number} {reason}" for reason, number in table.left_out.items())
    lines += ["", *(f"{line}." for line in table.missing)]
    lines.append(f"{table.votes} votes counted; left out: {left_out or 'none'}.")
    lines.append(f"{table.method_text}.")
    return "\n".join([*lines, *table.warnings])


FORMATS: dict[str, Format[LeaderboardTable]] = formats(
    csv=csv_bytes,
    json=json_bytes,
    parquet=parquet_of,
    latex=lambda table: latex(table).encode(),
    **drawings(interval_chart),
)


def _standing(table: LeaderboardTable, row: Row) -> dict[str, Any]:
    part = {"part": row.part} if table.has_parts else {}
    return {
        "model": row.model,
        "slug": row.slug,
        "kind": row.kind,
        "simulated": row.simulated,
        "rank": row.rank,
        "rating": rounded(row.elo),
        "lower": rounded(row.lower),
        "upper": rounded(row.upper),
        "votes": row.votes,
        "wins": row.wins,
        "ties": row.ties,
        "losses": row.losses,
        "note": row.note,
    } | part


def _values(table: LeaderboardTable, row: Row) -> tuple[object, ...]:
    """In the order of COLUMNS."""
    return (
        row.rank, row.model, row.elo, row.lower, row.upper,
        row.votes, row.wins, row.ties, row.losses,
        row.slug, row.kind, row.simulated, row.note,
        table.study, table.method_text, table.simulated, table.early,
    )  # fmt: skip
