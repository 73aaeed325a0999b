"""What the results say of authors: to staff both versions of the table, to experts nothing."""

from __future__ import annotations

from collections.abc import Sequence

from arena.exports.tables import LeaderboardTable, Row
from arena.models import Snapshot
from arena.queries.votes.sets import Filters
from arena.rating.lines import rating_text
from arena.rating.snapshot_document import BothRanks, PanelRater
from arena.web.results.ratings import Context


def both_versions(snapshot: Snapshot, table: LeaderboardTable) -> Context | None:
    """The table with and without the votes of authors on their own contestants.

    None where there are no such votes, or an older rating never looked.
    """
    own_votes = snapshot.results.own_votes
    if own_votes is None:
        return None
    lines = {line.slug: line for line in own_votes.lines}
    names = {row.slug: row.name for row in table.rows}
    return {
        "kept": own_votes,
        "lines": [in_both_versions(lines[row.slug], row) for row in table.rows],
        "reasons": own_votes.reasons,
        "places": own_votes.largest and own_votes.largest.places,
        "who": [names[slug] for slug in own_votes.largest.slugs] if own_votes.largest else [],
    }


def with_authors(snapshot: Snapshot, panel: Sequence[PanelRater]) -> list[Context]:
    """The experts' panel with who was author then, and the number of votes on their own."""
    authors = {judge for judge, _ in Filters.of_document(snapshot.filters).authors}
    own_votes = snapshot.results.own_votes
    own = own_votes.by_judge if own_votes else {}
    return [
        {"rater": rater, "is_author": rater.judge in authors, "own_votes": own.get(rater.judge, 0)}
        for rater in panel
    ]


def in_both_versions(line: BothRanks, row: Row) -> Context:
    """A contestant's line of both versions, and whether its rank differs."""
    first, second = line.rank_with, line.rank_without
    return {
        "kept": line,
        "name": row.name,
        "simulated": row.simulated,
        "elo_with": rating_text(line.rating_with),
        "elo_without": rating_text(line.rating_without),
        "moves": first is not None and second is not None and first != second,
    }
