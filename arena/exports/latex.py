"""The leaderboard as LaTeX, in the form of the paper's table."""

from __future__ import annotations

from arena.exports.columns import PRINTED
from arena.exports.tables import LeaderboardTable, Row
from arena.rating.lines import caption_text, escape, latex_table

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
