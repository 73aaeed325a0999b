"""Whether experts change while they vote: ties, pace, agreement, sides, by the place in a session.

A session is a row of votes of one expert without a pause of more than half an hour. Each measure
gets a straight line over the place in the session, with a level of its own for every session, so
that only what changes within sessions counts; its error is clustered by expert.

Notation: V votes, G experts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from arena.rating.comparisons import FloatArray, IntArray
from arena.rating.estimate import Estimate
from arena.rating.student import t_above, t_quantile

PAUSE_S = 1800.0
"""A longer one ends a session."""
STEP = 100
"""Slopes are told for so many votes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Drift:
    """How a measure changes within sessions.

    Attributes:
        measure: Its name.
        votes: With a value, in sessions of two such votes or more; `sessions` and `experts` there.
        early, late: The mean over the votes in the first and the last quarter of their sessions.
        slope: The change over 100 votes of a session; None where places do not differ.
        p_value: Of no change; None with fewer than two experts.
    """

    measure: str
    votes: int
    sessions: int
    experts: int
    early: float | None
    late: float | None
    slope: Estimate
    p_value: float | None


def number_sessions(
    expert: IntArray, at_s: FloatArray, position: FloatArray
) -> tuple[IntArray, IntArray]:
    """(V,) the session of each vote, and (V,) its place there, from 0.

    Args:
        expert: (V,) whose vote it is.
        at_s: (V,) when it was given, in seconds; not a number where unknown. An expert's votes
            without times are one session.
        position: (V,) the place in the expert's own order, where times are equal or unknown.
    """
    order = np.lexsort((position, np.where(np.isnan(at_s), np.inf, at_s), expert))
    pause = np.diff(at_s[order], prepend=np.nan)
    starts = (np.diff(expert[order], prepend=-1) != 0) | (np.nan_to_num(pause) > PAUSE_S)
    number = np.cumsum(starts) - 1
    first = np.flatnonzero(starts)
    session, place = np.empty((2, len(order)), dtype=np.int64)
    session[order] = number
    place[order] = np.arange(len(order)) - first[number] if len(order) else 0
    return session, place


def drifts(
    expert: IntArray, session: IntArray, place: IntArray, measures: Mapping[str, FloatArray]
) -> tuple[Drift, ...]:
    """The change of each measure within sessions.

    Args:
        expert: (V,) whose vote it is.
        session: (V,) of which session.
        place: (V,) there, from 0.
        measures: (V,) values by name; not a number where a vote has none.
    """
    return tuple(_drift(name, expert, session, place, values) for name, values in measures.items())


# --- Private -----------------------------------------------------------------------------------


def _drift(
    name: str, expert: IntArray, session: IntArray, place: IntArray, values: FloatArray
) -> Drift:
    longest = np.zeros(int(session.max(initial=-1)) + 1)
    np.maximum.at(longest, session, place)
    known = ~np.isnan(values)
    known &= np.bincount(session[known], minlength=len(longest))[session] > 1
    share = place[known] / np.maximum(longest[session[known]], 1.0)
    y = values[known]
    _, session_of = np.unique(session[known], return_inverse=True)
    experts, expert_of = np.unique(expert[known], return_inverse=True)
    x = _within(place[known] / STEP, session_of)
    slope, p_value = _slope(x, _within(y, session_of), expert_of, len(experts))
    early, late = y[share < 0.25], y[share >= 0.75]
    return Drift(
        measure=name,
        votes=len(y),
        sessions=int(session_of.max(initial=-1)) + 1,
        experts=len(experts),
        early=float(early.mean()) if len(early) else None,
        late=float(late.mean()) if len(late) else None,
        slope=slope,
        p_value=p_value,
    )


def _within(values: FloatArray, session_of: IntArray) -> FloatArray:
    """(V,) what a value has above the mean of its session."""
    mean = np.bincount(session_of, values) / np.maximum(np.bincount(session_of), 1)
    return np.asarray(values - mean[session_of])


def _slope(
    x: FloatArray, y: FloatArray, expert_of: IntArray, experts: int
) -> tuple[Estimate, float | None]:
    room = float(x @ x)
    if room <= 0.0:
        return Estimate(value=None), None
    value = float(x @ y) / room
    if experts < 2:
        return Estimate(value=value), None
    pulls = np.bincount(expert_of, x * (y - value * x))
    error = float(np.sqrt((pulls**2).sum() * experts / (experts - 1))) / room
    if error <= 0.0:
        return Estimate(value=value), None
    half = float(t_quantile(experts - 1)) * error
    estimate = Estimate(value=value, lower=value - half, upper=value + half)
    return estimate, float(2.0 * t_above(abs(value) / error, experts - 1))
