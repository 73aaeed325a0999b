"""Displacement errors as lines of a table, each with its box in the picture's own units."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import groupby

from arena.exports.displacement_table import DisplacementTable
from arena.exports.published import PublishedBox
from augment.services.judging.displacement import BoxSummary, Group, Summary

LEFT, RIGHT = 6.0, 226.0
"""Where the axis begins and ends; the picture is 240 wide. Beyond stands what is farther out."""

Scale = Callable[[float], float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawn:
    """A box in units of the picture.

    Attributes:
        beyond: How many values lie beyond the end of the axis.
    """

    low: float
    q1: float
    median: float
    q3: float
    high: float
    mean: float | None
    outliers: tuple[float, ...]
    beyond: int

    @property
    def width(self) -> float:
        """Of the box itself, never nothing."""
        return max(self.q3 - self.q1, 0.8)


@dataclass(frozen=True, slots=True, kw_only=True)
class BoxLine:
    """One contestant's line, or one box of the paper; what is unknown is None."""

    name: str
    is_simulated: bool
    is_paper: bool
    median_m: float | None
    q1_m: float | None
    q3_m: float | None
    mean_m: float | None
    counts: Summary | None
    drawn: Drawn | None


@dataclass(frozen=True, slots=True, kw_only=True)
class BoxPart:
    """Lines with the same heading; an empty heading where each line is its own group."""

    heading: str
    lines: list[BoxLine]


@dataclass(frozen=True, slots=True, kw_only=True)
class BoxSheet:
    """All parts on one axis that begins at zero.

    Attributes:
        end_m: What the right end of the axis stands for.
    """

    parts: list[BoxPart]
    end_m: float


def box_sheet(table: DisplacementTable) -> BoxSheet | None:
    """The lines of a table, None if nothing was measured."""
    if not table.groups:
        return None
    boxes = [group.summary.box for group in table.groups if group.summary.box is not None]
    ends = [max(box.high_m, box.mean_m) for box in boxes]
    end_m = max([*ends, *(box.high_m for box in table.published), 1.0])

    def at(value_m: float) -> float:
        return round(LEFT + (RIGHT - LEFT) * value_m / end_m, 1)

    if table.by == "contestant":
        lines = [_line(group, at, end_m) for group in table.groups]
        return BoxSheet(parts=[BoxPart(heading="", lines=lines)], end_m=end_m)
    parts = [
        BoxPart(heading=heading, lines=[_line(group, at, end_m) for group in some])
        for heading, some in groupby(table.groups, lambda group: group.heading)
    ]
    if table.published:
        published = [_from_paper(box, at) for box in table.published]
        parts.append(BoxPart(heading="Read from the paper’s figure", lines=published))
    return BoxSheet(parts=parts, end_m=end_m)


# Private


def _line(group: Group, at: Scale, end_m: float) -> BoxLine:
    box = group.summary.box
    return BoxLine(
        name=group.contestant,
        is_simulated=group.is_simulated,
        is_paper=False,
        median_m=None if box is None else box.median_m,
        q1_m=None if box is None else box.q1_m,
        q3_m=None if box is None else box.q3_m,
        mean_m=None if box is None else box.mean_m,
        counts=group.summary,
        drawn=None if box is None else _drawn(box, at, end_m),
    )


def _drawn(box: BoxSummary, at: Scale, end_m: float) -> Drawn:
    inside = [outlier for outlier in box.outliers_m if outlier <= end_m]
    return Drawn(
        low=at(box.low_m),
        q1=at(box.q1_m),
        median=at(box.median_m),
        q3=at(box.q3_m),
        high=at(box.high_m),
        mean=at(box.mean_m),
        outliers=tuple(at(one) for one in inside),
        beyond=len(box.outliers_m) - len(inside),
    )


def _from_paper(box: PublishedBox, at: Scale) -> BoxLine:
    return BoxLine(
        name=f"{box.model} {box.variant}",
        is_simulated=False,
        is_paper=True,
        median_m=box.median_m,
        q1_m=box.q1_m,
        q3_m=box.q3_m,
        mean_m=None,
        counts=None,
        drawn=Drawn(
            low=at(box.q1_m),
            q1=at(box.q1_m),
            median=at(box.median_m),
            q3=at(box.q3_m),
            high=at(box.high_m),
            mean=None,
            outliers=(),
            beyond=0,
        ),
    )
