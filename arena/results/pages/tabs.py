"""What the tabs of the ratings show: the table, its pairs and its parts by scenario type."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import median_high
from typing import Any

from arena.models import Snapshot
from arena.models.votes import AIDS
from arena.queries.people import natural_order
from arena.rating.printed import rating_text
from arena.rating.snapshot_document import (
    BothRanks,
    Bounds,
    OnlinePlace,
    PairRecord,
    PanelRater,
    TypeStanding,
)
from arena.results.exports.charts import heat_map
from arena.results.exports.plots import plots
from arena.results.exports.tables import ON_PAGE, LeaderboardTable, Row
from arena.results.pages.ratings import COVARIATE_LABELS
from arena.results.queries.access import log_of, names_in_log, snapshots_of
from arena.results.queries.votes import AUTOMATIC, Filters
from arena.web.jobs.driving import driving
from augment.models import EndpointModel

Context = dict[str, Any]
"""What a tab's template needs."""

FEW = 30


def standings(snapshot: Snapshot, table: LeaderboardTable) -> Context:
    """The table with its intervals, and the lines that say how far it can be trusted."""
    trust = snapshot.results.trust
    moves = [line.moves for line in trust.raters if line.moves is not None]
    names = by_slug(table)
    removal = trust.removal
    claims, check = snapshot.results.claims, _cross_check(snapshot, table)
    return {
        "columns": ON_PAGE,
        "has_bounds": any(row.has_bound for row in table.rows),
        "largest_move": max(moves, default=None),
        "removal": removal,
        "rival": removal and names[removal.rival].name,
        "disagreements": _disagreements(trust.elo_order or (), names),
        "independent": _half_width(claims.independent),
        "design_effect": _said_effect(claims.design_effect),
        "check": None if check is None else round(check),
        "ties": round((trust.tie_share or 0.0) * snapshot.votes_counted),
        "all_tied": is_all_tied(snapshot),
        "has_places": any(row.rank_best != row.rank_worst for row in table.rows),
    }


def pairs(snapshot: Snapshot, table: LeaderboardTable) -> Context:
    """The heat map and every pair as a line."""
    names = by_slug(table)
    found = snapshot.results.pairs
    place = {row.slug: n for n, row in enumerate(table.rows)}
    above = snapshot.results.board.above
    apart = None if above is None else {frozenset(pair) for pair in above}
    p_values = {
        frozenset((value.a, value.b)): value.p for value in snapshot.results.board.p_values or ()
    }
    lines = [_pair(pair, names, place, apart, p_values) for pair in found]
    lines.sort(key=lambda line: (place[line["a"].slug], place[line["b"].slug]))
    return {
        "heat": heat_map(found, table.rows),
        "lines": lines,
        "few": FEW,
        "any_few": any(0 < line["votes"] < FEW for line in lines),
        "has_p_values": bool(p_values),
        "told_apart": None if apart is None else len(apart),
    }


def types(snapshot: Snapshot, table: LeaderboardTable) -> Context:
    """One chart of all scenario types, and a table each."""
    names = by_slug(table)
    parts: list[Context] = []
    for part in snapshot.results.types:
        rows = [_row(line, names[line.slug]) for line in part.lines if line.votes]
        if not snapshot.results.board.order:  # of an earlier version
            rows.sort(key=lambda row: (row.rating is None, -(row.rating or 0.0), row.slug))
        reasons = (part.status,) if part.reasons is None else part.reasons
        parts.append({"kept": part, "rows": rows, "reasons": reasons})
    return {
        "parts": parts,
        "few_votes": FEW,
        "any_few": any(row.votes < FEW for part in parts for row in part["rows"]),
    }


def is_all_tied(snapshot: Snapshot) -> bool:
    """Whether every vote is a tie: then much of what could be said says nothing."""
    return snapshot.results.trust.tie_share == 1.0


def by_slug(table: LeaderboardTable) -> Mapping[str, Row]:
    """The lines by their slug."""
    return {row.slug: row for row in table.rows}


# --- Private -----------------------------------------------------------------------------------


def _pair(
    pair: PairRecord,
    names: Mapping[str, Row],
    place: Mapping[str, int],
    apart: set[frozenset[str]] | None,
    p_values: Mapping[frozenset[str], float],
) -> Context:
    """A pair from the view of the one that stands higher."""
    first, second, wins, losses = pair.a, pair.b, pair.wins, pair.losses
    if place[second] < place[first]:
        first, second, wins, losses = second, first, losses, wins
    return {
        "a": names[first],
        "b": names[second],
        "wins": wins,
        "ties": pair.ties,
        "losses": losses,
        "both_miss": pair.both_miss,
        "votes": pair.votes,
        "p": p_values.get(frozenset((first, second))),
        "apart": None if apart is None else frozenset((first, second)) in apart,
    }


def _row(line: TypeStanding, row: Row) -> Row:
    """A line among the votes of one type."""
    return replace(
        row,
        rank=line.rank,
        rank_best=None,
        rank_worst=None,
        rating=line.rating,
        lower=line.lower,
        upper=line.upper,
        votes=line.votes,
        note=line.note or "",
    )


def _disagreements(order: Sequence[OnlinePlace], names: Mapping[str, Row]) -> list[Context]:
    """Who stands elsewhere by online Elo."""
    return [
        {"name": names[line.slug].name, "place": place, "online": line.place}
        for place, line in enumerate(order, start=1)
        if line.place != place
    ]


def _said_effect(effect: float | None) -> float | None:
    """How many votes weigh as much as one, None where it would be said to be one."""
    return None if effect is None or round(effect, 1) <= 1.0 else round(effect, 1)


def _half_width(bounds: Mapping[str, Bounds]) -> float | None:
    """The middle one of the intervals."""
    widths = [(upper - lower) / 2 for lower, upper in bounds.values()]
    return median_high(widths) if widths else None


def _cross_check(snapshot: Snapshot, table: LeaderboardTable) -> float | None:
    """By how many points the bounds in closed form differ at most."""
    check = snapshot.results.board.check
    gaps = [
        max(abs(check[row.slug][0] - row.lower), abs(check[row.slug][1] - row.upper))
        for row in table.rows
        if row.slug in check and row.lower is not None and row.upper is not None
    ]
    return max(gaps, default=None)


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


LOG_LINES = 200


@dataclass(frozen=True, slots=True, kw_only=True)
class Tab:
    """A tab of the page.

    Attributes:
        staff: Whether only analysts and admins see it.
        fill: Makes what its template needs.
    """

    name: str
    label: Any
    staff: bool
    fill: Callable[[Snapshot, LeaderboardTable], Context]

    @property
    def template(self) -> str:
        """Where it is written."""
        return f"results/{self.name}.html"


def log(snapshot: Snapshot, table: LeaderboardTable) -> Context:
    """What was done to the study, and every rating of it."""
    study = snapshot.study
    return {
        "events": log_of(study, most=LOG_LINES),
        "names": {row.slug: row.model for row in table.rows} | names_in_log(study),
        "most": LOG_LINES,
        "ratings": list(snapshots_of(study).defer("results").select_related("made_by__person")),
    }


TABS = (
    Tab(name="table", label="Table", staff=False, fill=standings),
    Tab(name="pairs", label="Pairs", staff=False, fill=pairs),
    Tab(name="types", label="Types", staff=False, fill=types),
    Tab(name="raters", label="Raters", staff=True, fill=raters),
    Tab(name="coverage", label="Coverage", staff=True, fill=coverage),
    Tab(name="displacement", label="Displacement", staff=True, fill=displacement),
    Tab(name="driving", label="Driving", staff=True, fill=driving),
    Tab(name="cost", label="Cost", staff=True, fill=cost),
    Tab(name="log", label="Log", staff=True, fill=log),
)
