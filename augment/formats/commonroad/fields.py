"""Numbers and references out of CommonRoad's elements."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from augment.errors import InvalidDocument
from augment.formats.documents import Element
from augment.formats.road_map import FURTHEST_M

WHAT = "CommonRoad scenario"


def fault(place: str, text: str) -> InvalidDocument:
    """What is wrong, and where."""
    return InvalidDocument(WHAT, [(place, text)])


def whole(text: str | None, place: str) -> int:
    """A whole number such as an id.

    Raises:
        InvalidDocument: It is none.
    """
    try:
        number = int((text or "").strip())
    except ValueError:
        raise fault(place, f"expected a whole number, got {(text or '')[:40]!r}") from None
    if abs(number) > 10**15:
        raise fault(place, f"{str(number)[:20]}... is too large")
    return number


def real(text: str, place: str) -> float:
    """A finite number.

    Raises:
        InvalidDocument: It is none.
    """
    try:
        number = float(text.strip())
    except ValueError:
        number = math.nan
    if not abs(number) <= FURTHEST_M:
        raise fault(place, f"expected a finite number up to {FURTHEST_M:.0e}, got {text[:40]!r}")
    return number


def value_of(parent: Element, name: str, place: str) -> float | None:
    """A value given exactly or as an interval, whose middle is taken; None where it is not given.

    Raises:
        InvalidDocument: It is no number.
    """
    element = parent.first(name)
    if element is None:
        return None
    exact = element.first("exact")
    if exact is not None:
        return real(exact.text, f"{place}.{name}")
    low, high = element.first("intervalStart"), element.first("intervalEnd")
    if low is not None and high is not None:
        ends = (real(low.text, f"{place}.{name}"), real(high.text, f"{place}.{name}"))
        return sum(ends) / 2.0
    return real(element.text, f"{place}.{name}")


def points_of(parent: Element, place: str) -> NDArray[np.float64]:
    """The points (P, 2) of a bound or polygon."""
    rows = [point_of(point, place) for point in parent.all("point")]
    return np.array(rows, dtype=np.float64).reshape(-1, 2)


def point_of(point: Element, place: str) -> tuple[float, float]:
    """X and y of a point.

    Raises:
        InvalidDocument: One is missing or no number.
    """
    x, y = point.first("x"), point.first("y")
    if x is None or y is None:
        raise fault(place, "a point needs x and y")
    return real(x.text, place), real(y.text, place)


def references(parent: Element, *names: str) -> Iterator[int]:
    """The ids that children of these names refer to."""
    for child in parent.all(*names):
        yield whole(child.attributes.get("ref"), f"{parent.name}.{child.name}")
