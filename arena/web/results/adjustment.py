"""What the table's page says of a rating that is adjusted for what was shown."""

from __future__ import annotations

from arena.exports.tables import LeaderboardTable
from arena.models import Snapshot
from arena.web.results.authors import in_both_versions
from arena.web.results.rating_form import COVARIATE_LABELS
from arena.web.results.ratings import Context


def show_adjustment(snapshot: Snapshot, table: LeaderboardTable) -> Context | None:
    """Effects and both versions of the table; None where nothing was to be adjusted for."""
    found = snapshot.results.adjustment
    if found is None:
        return None
    lines = {line.slug: line for line in found.lines}
    names = {row.slug: row.name for row in table.rows}
    return {
        "effects": [
            {"label": COVARIATE_LABELS.get(one.name, one.name), "kept": one}
            for one in found.effects
        ],
        "lines": [in_both_versions(lines[row.slug], row) for row in table.rows],
        "places": found.largest and found.largest.places,
        "who": [names[slug] for slug in found.largest.slugs] if found.largest else [],
    }
