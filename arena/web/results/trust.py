"""What the tabs of the votes behind a rating show: who gave them, and how many there are."""

from __future__ import annotations

from arena.exports.charts.heat_map import heat_map
from arena.exports.charts.plots import plots
from arena.exports.tables import LeaderboardTable
from arena.models import Snapshot
from arena.models.votes import AIDS
from arena.people.queries import natural_order
from arena.queries.votes.judged import AUTOMATIC
from arena.rating.snapshot_document import PanelRater
from arena.web.results.authors import with_authors
from arena.web.results.ratings import Context, is_all_tied


def raters(snapshot: Snapshot, table: LeaderboardTable) -> Context:
    """Agreement, repeats, sides, and the panel of experts."""
    kept = snapshot.results.trust.raters
    lines = [line for line in kept if line.judge != AUTOMATIC]
    used = {name for line in lines for name, _ in line.aids}
    aids = [name for name in AIDS if name in used]
    panel = sorted(
        (line | _counts(line["rater"], aids) for line in with_authors(snapshot, lines)),
        key=lambda line: natural_order(line["rater"].name),
    )
    return {
        "trust": snapshot.results.trust,
        "all_tied": is_all_tied(snapshot),
        "panel": panel,
        "aids": aids,
        "automatic": sum(line.votes for line in kept if line.judge == AUTOMATIC),
        "automatic_judge": AUTOMATIC,
    }


def coverage(snapshot: Snapshot, table: LeaderboardTable) -> Context:
    """Votes against the plan, widths against votes, and how many votes narrower ones need."""
    pairs = snapshot.results.pairs
    plot = plots(snapshot, table).get("width")
    rows = table.rows
    return {
        "claims": snapshot.results.claims,
        "points": [(point, rows[point.number - 1]) for point in plot.points] if plot else [],
        "heat": heat_map(pairs, table.rows),
        "planned": sum(pair.planned or 0 for pair in pairs),
    }


# --- Private -----------------------------------------------------------------------------------


def _counts(rater: PanelRater, aids: list[str]) -> Context:
    """How many votes the shares of an expert stand for; of the favourites only where all do."""
    ties = round(rater.ties * rater.votes)
    decided = rater.votes - ties
    left, used = rater.left.value, dict(rater.aids)
    return {
        "aids": [(name, used.get(name, 0)) for name in aids],
        "ties": ties,
        "left": None if left is None else round(left * decided),
        "all_foreseen": rater.decided == decided,
    }
