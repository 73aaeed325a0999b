"""The scatter charts of a rating as numbers: pages and files draw the same points."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from arena.exports.tables import LeaderboardTable, Row
from arena.models import Snapshot

ELO = "Elo with 95 % interval"
METRES = "Median displacement (m)"
USD = "USD per scenario"
TOKENS = "Tokens per scenario"
VOTES = "Votes"
HALF_WIDTH = "Half-width of the interval (Elo)"


@dataclass(frozen=True, slots=True, kw_only=True)
class Given:
    """What is to be drawn; points of the same group look the same.

    Attributes:
        number: Of the point, its place in the table.
        lower, upper: The ends of the interval in y; one alone is open on the other side.
    """

    number: int
    name: str
    x: float
    y: float
    lower: float | None = None
    upper: float | None = None
    group: str = ""
    is_simulated: bool = False

    @property
    def has_bound(self) -> bool:
        """Whether there is an interval, be it open on one side."""
        return self.lower is not None or self.upper is not None


@dataclass(frozen=True, slots=True, kw_only=True)
class Plot:
    """A chart of one thing against another.

    Attributes:
        across, up: What the axes say.
        is_log: Whether the axis across is logarithmic.
        from_zero: Whether the axes begin at zero, a logarithmic one excepted.
        falls: Draws the curve `falls` / sqrt(x) behind the points, None without one.
    """

    across: str
    up: str
    points: Sequence[Given]
    is_log: bool = False
    from_zero: bool = False
    falls: float | None = None

    @property
    def curve(self) -> Callable[[float], float] | None:
        """Y by x, of what falls with the square root of x."""
        constant = self.falls
        return None if constant is None else lambda x: constant / math.sqrt(x)


def plots(snapshot: Snapshot, table: LeaderboardTable) -> dict[str, Plot]:
    """Every chart that has points, by the name that files and pages know it by."""
    by_name = {
        "width": _width(table),
        "displacement": _displacement(snapshot, table),
        **_cost(snapshot, table),
    }
    return {name: plot for name, plot in by_name.items() if plot.points}


# --- Private -----------------------------------------------------------------------------------


def _width(table: LeaderboardTable) -> Plot:
    """Half-widths against votes, with the curve that falls with the votes' square root."""
    points = [
        _given(n, row, x=float(row.votes), y=(row.upper - row.lower) / 2)
        for n, row in enumerate(table.rows, start=1)
        if row.lower is not None and row.upper is not None
    ]
    constants = sorted(point.y * point.x**0.5 for point in points)
    return Plot(
        across=VOTES,
        up=HALF_WIDTH,
        points=points,
        from_zero=True,
        falls=constants[len(constants) // 2] if constants else None,
    )


def _displacement(snapshot: Snapshot, table: LeaderboardTable) -> Plot:
    metres = {line.slug: line.median_m for line in snapshot.results.displacement}
    points = [
        _rated(n, row, far)
        for n, row in enumerate(table.rows, start=1)
        if row.rating is not None and (far := metres.get(row.slug)) is not None
    ]
    return Plot(across=METRES, up=ELO, points=points)


def _cost(snapshot: Snapshot, table: LeaderboardTable) -> dict[str, Plot]:
    metres = {line.slug: line.median_m for line in snapshot.results.displacement}
    costs = {line.slug: line for line in snapshot.results.cost}
    by_name = {}
    for what, label in (("usd", USD), ("tokens", TOKENS)):
        rows = [
            (n, row, spent, cost.model_class)
            for n, row in enumerate(table.rows, start=1)
            if (cost := costs.get(row.slug)) and (spent := getattr(cost, what))
        ]
        by_name[f"elo-{what}"] = Plot(
            across=label,
            up=ELO,
            points=[
                _rated(n, row, x, group) for n, row, x, group in rows if row.rating is not None
            ],
            is_log=True,
        )
        by_name[f"displacement-{what}"] = Plot(
            across=label,
            up=METRES,
            points=[
                _given(n, row, x=x, y=far, group=group)
                for n, row, x, group in rows
                if (far := metres.get(row.slug)) is not None
            ],
            is_log=True,
            from_zero=True,
        )
    return by_name


def _rated(number: int, row: Row, x: float, group: str = "") -> Given:
    assert row.rating is not None
    return _given(number, row, x=x, y=row.rating, interval=(row.lower, row.upper), group=group)


def _given(
    number: int,
    row: Row,
    *,
    x: float,
    y: float,
    interval: tuple[float | None, float | None] = (None, None),
    group: str = "",
) -> Given:
    return Given(
        number=number,
        name=row.name,
        x=x,
        y=y,
        lower=interval[0],
        upper=interval[1],
        group=group,
        is_simulated=row.simulated,
    )
