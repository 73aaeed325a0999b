"""What the tabs of the votes behind a rating show: who gave them, and how many there are."""

from __future__ import annotations

from arena.exports.heat import heat_map
from arena.exports.plots import plots
from arena.exports.tables import LeaderboardTable
from arena.models import Snapshot
from arena.queries.people import natural_order
from arena.web.charts import bars
from arena.web.results_authors import with_authors
from arena.web.results_conditions import drifts, interaction
from arena.web.results_ratings import Context
from arena.web.scatter import scatter


def raters(snapshot: Snapshot, table: LeaderboardTable) -> Context:
    """Agreement, repeats, sides, and the panel of experts."""
    lines = snapshot.results.trust.raters
    left = [(line.judge, line.left.lower, line.left.value, line.left.upper) for line in lines]
    panel = sorted(
        with_authors(snapshot, lines), key=lambda line: natural_order(line["rater"].name)
    )
    return {
        "trust": snapshot.results.trust,
        "panel": panel,
        "limit": next((line.bet.limit for line in lines if line.bet), None),
        "left_bars": bars(left, span=(0.0, 1.0)),
        "by_side": interaction(snapshot.results.trust.by_side, table.rows),
        "drifts": drifts(snapshot.results.trust.drifts),
    }


def coverage(snapshot: Snapshot, table: LeaderboardTable) -> Context:
    """Votes against the plan, widths against votes, and how many votes narrower ones need."""
    pairs = snapshot.results.pairs
    plot = plots(snapshot, table).get("width")
    return {
        "claims": snapshot.results.claims,
        "chart": scatter(plot),
        "points": plot.points if plot else (),
        "heat": heat_map(pairs, table.rows),
        "planned": sum(pair.planned or 0 for pair in pairs),
    }
