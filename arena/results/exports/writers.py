"""The leaderboard as LaTeX, in the form of the paper's table."""

from __future__ import annotations

import json
from typing import Any

from arena.exports.formats import Format, drawings, formats, parquet_bytes, round_value
from arena.rating.printed import caption_text, escape, latex_table
from arena.results.exports.charts import interval_chart
from arena.results.exports.tables import (
    IN_FILES,
    IN_JSON,
    PRINTED,
    LeaderboardTable,
    Row,
    hypotheses_document,
    hypothesis_line,
)
from arena.services.cells import csv_text

__all__ = ["escape", "latex"]


def latex(table: LeaderboardTable) -> str:
    """The table with its comments: needs booktabs and xcolor with the option `table`."""
    marks = [word for word, so in (("simulated", table.simulated), ("early", table.early)) if so]
    caption = caption_text(
        table.method_text, votes=table.votes, experts=table.experts, scenarios=table.scenarios
    )
    return latex_table(
        (
            [_model(row), *(column.text(row) for column in PRINTED if not column.identifies)]
            for row in table.rows
        ),
        heads=[column.printed for column in PRINTED],
        comments=(
            f"{table.study}: {table.votes} votes; {table.method_text}",
            f"votes sha256 {table.votes_sha256}",
            *((table.frozen_text,) if table.frozen_text else ()),
            *table.warnings,
        ),
        notes=table.missing,
        caption=f"{caption} ({', '.join(marks)})" if marks else caption,
    )


def _model(row: Row) -> str:
    """The model's name, its variant in typewriter letters as in the paper."""
    if not row.variant:
        return escape(row.model)
    before, _, after = row.model.rpartition(row.variant)
    return rf"{escape(before)}\texttt{{{escape(row.variant)}}}{escape(after)}"


def csv_bytes(table: LeaderboardTable) -> bytes:
    """One line a contestant; what is unknown is empty, numbers have two decimals."""
    return csv_text([column.name for column in IN_FILES], _values(table)).encode()


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
            **table.intervals_note,
            "rounds": table.rounds,
            "degenerate_rounds": table.degenerate_rounds,
            "seed": table.seed,
        },
        "votes": {
            "counted": table.votes,
            "left_out": table.left_out,
            "sha256": table.votes_sha256,
        },
        "preregistration": table.preregistration or None,
        "hypotheses": hypotheses_document(table.hypotheses),
        "status": table.status,
        "standings": [_standing(table, row) for row in table.rows],
    }
    return (json.dumps(document, indent=2, ensure_ascii=False) + "\n").encode()


def parquet_of(table: LeaderboardTable) -> bytes:
    """The columns of the CSV file, typed; numbers as they are."""
    return parquet_bytes({column.name: column.kind for column in IN_FILES}, _values(table))


def plain_text(table: LeaderboardTable) -> str:
    """The table for a terminal, with its method and warnings beneath."""
    head = [column.printed for column in PRINTED]
    body = [[column.text(row) for column in PRINTED] for row in table.rows]
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
    if table.frozen_text:
        lines.append(f"{table.frozen_text[0].upper()}{table.frozen_text[1:]}.")
    lines += [hypothesis_line(one) for one in table.hypotheses]
    return "\n".join([*lines, *table.warnings])


FORMATS: dict[str, Format[LeaderboardTable]] = formats(
    csv=csv_bytes,
    json=json_bytes,
    parquet=parquet_of,
    latex=lambda table: latex(table).encode(),
    **drawings(interval_chart),
)


def _standing(table: LeaderboardTable, row: Row) -> dict[str, Any]:
    values = {column.key: column.value_of(table, row) for column in IN_JSON}
    part = {"part": row.part} if table.has_parts else {}
    return {
        key: round_value(value) if isinstance(value, float) else value
        for key, value in values.items()
    } | part


def _values(table: LeaderboardTable) -> list[list[object]]:
    return [[column.value_of(table, row) for column in IN_FILES] for row in table.rows]
