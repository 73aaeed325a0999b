"""What the tabs of the ratings show: the table, its pairs and its parts by scenario type."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from statistics import median_high
from typing import Any

from arena.exports.charts.heat_map import heat_map
from arena.exports.columns import ON_PAGE
from arena.exports.tables import LeaderboardTable, Row
from arena.models import Snapshot
from arena.rating.snapshot_document import Bounds, OnlinePlace, PairRecord, TypeStanding

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
