"""What the tabs show that set ratings against distances, money and tokens."""

from __future__ import annotations

from arena.exports.charts.plots import plots
from arena.exports.tables import LeaderboardTable
from arena.models import Snapshot
from arena.web.results.ratings import Context
from augment.models import EndpointModel

_CHARTS = {
    "elo-usd": ("Elo against money", "Up: Elo with its 95 % interval. Across: USD per scenario."),
    "elo-tokens": (
        "Elo against tokens",
        "Up: Elo with its 95 % interval. Across: tokens per scenario, in and out.",
    ),
    "displacement-usd": (
        "Displacement against money",
        "Up: median displacement in metres, less is better. Across: USD per scenario.",
    ),
    "displacement-tokens": (
        "Displacement against tokens",
        "Up: median displacement in metres, less is better. Across: tokens per scenario, in and"
        " out.",
    ),
}
"""Title and legend of each; all have a logarithmic axis across."""


def displacement(snapshot: Snapshot, table: LeaderboardTable) -> Context:
    """Elo against the distance from the references."""
    by_slug = {line.slug: line for line in snapshot.results.displacement}
    lines = [
        {"number": n, "row": row, "far": by_slug[row.slug]}
        for n, row in enumerate(table.rows, start=1)
        if row.slug in by_slug
    ]
    return {"lines": lines, "has_chart": "displacement" in plots(snapshot, table)}


def cost(snapshot: Snapshot, table: LeaderboardTable) -> Context:
    """Elo and displacement against money and tokens, by class of model."""
    spent = {line.slug: line for line in snapshot.results.cost}
    metres = {line.slug: line.median_m for line in snapshot.results.displacement}
    labels = {value: str(label) for value, label in EndpointModel.ModelClass.choices}
    lines = [
        {
            "number": n,
            "row": row,
            "spent": spent[row.slug],
            "class_label": labels.get(spent[row.slug].model_class, ""),
            "median_m": metres.get(row.slug),
        }
        for n, row in enumerate(table.rows, start=1)
        if row.slug in spent
    ]
    drawn = plots(snapshot, table)
    return {
        "lines": lines,
        "charts": [
            {"name": name, "title": title, "legend": legend}
            for name, (title, legend) in _CHARTS.items()
            if name in drawn
        ],
    }
