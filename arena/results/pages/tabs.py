"""The tabs of the results page, each made of a snapshot and its table."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from arena.jobs.pages.measures import driving
from arena.models import Snapshot
from arena.models.votes import AIDS
from arena.people.queries import natural_order
from arena.rating.snapshot_document import PairRecord, PanelRater, TypeStanding
from arena.results.exports.charts import FEW, heat_map
from arena.results.exports.plots import plots
from arena.results.exports.tables import ON_PAGE, LeaderboardTable, Row
from arena.results.queries.access import log_of, names_in_log, snapshots_of
from arena.results.queries.votes import AUTOMATIC, Filters
from augment.models import EndpointModel

Context = dict[str, Any]
"""What a tab's template needs."""

LOG_LINES = 200

COVARIATE_LABELS = {
    "side": "being on the left",
    "objects": "the number of objects",
    "vehicles": "the number of vehicles",
}

_MONEY, _TOKENS = "USD per scenario.", "tokens per scenario, in and out."
_ELO, _METRES = "Elo with its 95 % interval", "median displacement in metres, less is better"
_CHARTS = {
    "elo-usd": ("Elo against money", f"Up: {_ELO}. Across: {_MONEY}"),
    "elo-tokens": ("Elo against tokens", f"Up: {_ELO}. Across: {_TOKENS}"),
    "displacement-usd": ("Displacement against money", f"Up: {_METRES}. Across: {_MONEY}"),
    "displacement-tokens": ("Displacement against tokens", f"Up: {_METRES}. Across: {_TOKENS}"),
}
"""Title and legend of each; all have a logarithmic axis across."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tab:
    """A tab of the page.

    Attributes:
        staff: Whether only analysts and admins see it.
        fill: Makes what its template needs.
    """

    name: str
    staff: bool
    fill: Callable[[Snapshot, LeaderboardTable], Context]

    @property
    def label(self) -> str:
        """What it is called on the page."""
        return self.name.capitalize()

    @property
    def template(self) -> str:
        """Where it is written."""
        return f"results/{self.name}.html"


def standings(snapshot: Snapshot, table: LeaderboardTable) -> Context:
    """The table with its intervals, and the lines that say how far it can be trusted."""
    trust = snapshot.results.trust
    moves = [line.moves for line in trust.raters if line.moves is not None]
    return {
        "columns": ON_PAGE,
        "has_bounds": any(row.has_bound for row in table.rows),
        "largest_move": max(moves, default=None),
        "ties": round((trust.tie_share or 0.0) * snapshot.votes_counted),
        "all_tied": trust.tie_share == 1.0,
        "has_places": any(row.rank_best != row.rank_worst for row in table.rows),
    }


def pairs(snapshot: Snapshot, table: LeaderboardTable) -> Context:
    """The heat map and every pair as a line."""
    board = snapshot.results.board
    place = {row.slug: n for n, row in enumerate(table.rows)}
    apart = None if board.above is None else {frozenset(pair) for pair in board.above}
    p_values = {frozenset((value.a, value.b)): value.p for value in board.p_values or ()}

    def line_of(pair: PairRecord) -> Context:
        """A pair from the view of the one that stands higher."""
        first, second, wins, losses = pair.a, pair.b, pair.wins, pair.losses
        if place[second] < place[first]:
            first, second, wins, losses = second, first, losses, wins
        both = frozenset((first, second))
        return {
            "a": table.rows[place[first]],
            "b": table.rows[place[second]],
            "wins": wins,
            "ties": pair.ties,
            "losses": losses,
            "both_miss": pair.both_miss,
            "votes": pair.votes,
            "p": p_values.get(both),
            "apart": None if apart is None else both in apart,
        }

    lines = [line_of(pair) for pair in snapshot.results.pairs]
    lines.sort(key=lambda line: (place[line["a"].slug], place[line["b"].slug]))
    return {
        "heat": heat_map(snapshot.results.pairs, table.rows),
        "lines": lines,
        "few": FEW,
        "any_few": any(0 < line["votes"] < FEW for line in lines),
        "has_p_values": bool(p_values),
        "told_apart": None if apart is None else len(apart),
    }


def types(snapshot: Snapshot, table: LeaderboardTable) -> Context:
    """One chart of all scenario types, and a table each."""
    whole = _by_slug(table)
    parts: list[Context] = []
    for part in snapshot.results.types:
        rows = [_row_of_type(line, whole[line.slug]) for line in part.lines if line.votes]
        if not snapshot.results.board.order:  # of an earlier version
            rows.sort(key=lambda row: (row.rating is None, -(row.rating or 0.0), row.slug))
        reasons = (part.status,) if part.reasons is None else part.reasons
        parts.append({"kept": part, "rows": rows, "reasons": reasons})
    return {
        "parts": parts,
        "few_votes": FEW,
        "any_few": any(row.votes < FEW for part in parts for row in part["rows"]),
    }


def raters(snapshot: Snapshot, table: LeaderboardTable) -> Context:
    """Agreement, repeats, sides, and the panel of experts."""
    trust = snapshot.results.trust
    lines = [line for line in trust.raters if line.judge != AUTOMATIC]
    used = {name for line in lines for name, _ in line.aids}
    aids = [name for name in AIDS if name in used]
    authors = {judge for judge, _ in Filters.of_document(snapshot.filters).authors}
    return {
        "trust": trust,
        "all_tied": trust.tie_share == 1.0,
        "panel": [
            {"rater": line, "is_author": line.judge in authors, **_counts(line, aids)}
            for line in sorted(lines, key=lambda line: natural_order(line.name))
        ],
        "aids": aids,
        "automatic": sum(line.votes for line in trust.raters if line.judge == AUTOMATIC),
        "automatic_judge": AUTOMATIC,
    }


def coverage(snapshot: Snapshot, table: LeaderboardTable) -> Context:
    """Votes against the plan, and widths against votes."""
    plot = plots(snapshot, table).get("width")
    points = plot.points if plot else ()
    return {
        "points": [(point, table.rows[point.number - 1]) for point in points],
        "heat": heat_map(snapshot.results.pairs, table.rows),
        "planned": sum(pair.planned or 0 for pair in snapshot.results.pairs),
    }


def displacement(snapshot: Snapshot, table: LeaderboardTable) -> Context:
    """Elo against the distance from the references."""
    metres = {line.slug: line for line in snapshot.results.displacement}
    lines = [
        {"number": n, "row": row, "far": metres[row.slug]}
        for n, row in enumerate(table.rows, start=1)
        if row.slug in metres
    ]
    return {"lines": lines, "has_chart": "displacement" in plots(snapshot, table)}


def cost(snapshot: Snapshot, table: LeaderboardTable) -> Context:
    """Elo and displacement against money and tokens, by class of model."""
    spent = {line.slug: line for line in snapshot.results.cost}
    metres = {line.slug: line.median_m for line in snapshot.results.displacement}
    labels = {value: str(label) for value, label in EndpointModel.ModelClass.choices}
    drawn = plots(snapshot, table)
    return {
        "lines": [
            {
                "number": n,
                "row": row,
                "spent": spent[row.slug],
                "class_label": labels.get(spent[row.slug].model_class, ""),
                "median_m": metres.get(row.slug),
            }
            for n, row in enumerate(table.rows, start=1)
            if row.slug in spent
        ],
        "charts": [
            {"name": name, "title": title, "legend": legend}
            for name, (title, legend) in _CHARTS.items()
            if name in drawn
        ],
    }


def log(snapshot: Snapshot, table: LeaderboardTable) -> Context:
    """What was done to the study, and every rating of it."""
    study = snapshot.study
    return {
        "events": log_of(study, most=LOG_LINES),
        "names": {row.slug: row.model for row in table.rows} | names_in_log(study),
        "most": LOG_LINES,
        "ratings": list(snapshots_of(study).defer("results").select_related("made_by__person")),
    }


TABS = {
    tab.name: tab
    for tab in (
        Tab(name="table", staff=False, fill=standings),
        Tab(name="pairs", staff=False, fill=pairs),
        Tab(name="types", staff=False, fill=types),
        Tab(name="raters", staff=True, fill=raters),
        Tab(name="coverage", staff=True, fill=coverage),
        Tab(name="displacement", staff=True, fill=displacement),
        Tab(name="driving", staff=True, fill=driving),
        Tab(name="cost", staff=True, fill=cost),
        Tab(name="log", staff=True, fill=log),
    )
}


def show_adjustment(snapshot: Snapshot) -> list[Context] | None:
    """What the covariates are worth; None where nothing was to be adjusted for."""
    kept = snapshot.results.adjustment
    if kept is None:
        return None
    return [
        {"label": COVARIATE_LABELS.get(effect.name, effect.name), "kept": effect}
        for effect in kept.effects
    ]


# --- Private -----------------------------------------------------------------------------------


def _by_slug(table: LeaderboardTable) -> Mapping[str, Row]:
    return {row.slug: row for row in table.rows}


def _row_of_type(line: TypeStanding, row: Row) -> Row:
    """A contestant's row among the votes of one type."""
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
