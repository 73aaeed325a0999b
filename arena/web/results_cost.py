"""What the tabs show that set ratings against distances, money and tokens."""

from __future__ import annotations

from arena.exports.plots import plots
from arena.exports.tables import LeaderboardTable
from arena.models import Snapshot
from arena.web.results_ratings import Context
from arena.web.scatter import NARROW, scatter
from augment.models import EndpointModel

_CLASSES = ("Frontier", "Utility", "Open weight")
"""What models call their classes."""


def displacement(snapshot: Snapshot, table: LeaderboardTable) -> Context:
    """Elo against the distance from the references."""
    by_slug = {line.slug: line for line in snapshot.results.displacement}
    lines = [
        {"number": n, "row": row, "far": by_slug[row.slug]}
        for n, row in enumerate(table.rows, start=1)
        if row.slug in by_slug
    ]
    return {"lines": lines, "chart": scatter(plots(snapshot, table).get("displacement"))}


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
    charts = plots(snapshot, table)
    return {
        "lines": lines,
        "metres_by_money": scatter(charts.get("displacement-usd"), width=NARROW),
        "metres_by_tokens": scatter(charts.get("displacement-tokens"), width=NARROW),
        "by_money": scatter(charts.get("elo-usd"), width=NARROW),
        "by_tokens": scatter(charts.get("elo-tokens"), width=NARROW),
        "keys": [
            {"group": group, "is_simulated": simulated, "label": labels.get(group, "")}
            for group, simulated in sorted(
                {
                    (spent[row.slug].model_class, row.simulated)
                    for row in table.rows
                    if row.slug in spent
                }
            )
        ],
    }
