"""The lines of a board: one a contestant, filled part by part."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from arena.rating import remarks
from arena.rating.bradley_terry import MEAN_ELO
from arena.rating.connectivity import Diagnosis
from arena.rating.parts import Rated
from arena.rating.rules import Method, Rules
from arena.rating.tiers import Tiers, outer_bounds, ranks_across

_NO_VOTES = "no votes"


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """One contestant; None where the votes do not determine a number, and the note says why.

    Attributes:
        rating, lower, upper: Elo points; the mean of those rated together is 1000. A bound can
            stand alone: without the other one, and without a rating for who won or lost all.
        rank: As the paper defines it: 1 + the number of others whose lower bound is above `upper`.
            Nobody is first for want of bounds: see `ranking.shown_ranks`.
        rank_best, rank_worst: The simultaneous 95 % rank set: behind everybody who is shown to be
            above and ahead of everybody who is shown to be below, all pairs judged at once.
        check_lower, check_upper: The interval by the plain sandwich (Bradley-Terry only), to
            compare.
        part: Who have the same number here are rated together; ratings and ranks of different
            parts can't be compared.
    """

    name: str
    rating: float | None = None
    lower: float | None = None
    upper: float | None = None
    rank: int | None = None
    rank_best: int | None = None
    rank_worst: int | None = None
    check_lower: float | None = None
    check_upper: float | None = None
    votes: int = 0
    wins: int = 0
    ties: int = 0
    losses: int = 0
    part: int = 0
    note: str = ""


def blank_lines(
    names: tuple[str, ...], counted: list[list[int]], present: list[int], diagnosis: Diagnosis
) -> list[Line]:
    """The lines without ratings; whoever is alone in a part keeps the note that says why."""
    notes = dict(zip(present, diagnosis.notes, strict=False))
    return [
        Line(
            name=name,
            votes=sum(row),
            wins=row[0],
            ties=row[1],
            losses=row[2],
            part=-1,
            note=notes.get(index, "") if any(row) else _NO_VOTES,
        )
        for index, (name, row) in enumerate(zip(names, counted, strict=True))
    ]


def fill(lines: list[Line], members: list[int], number: int, found: Rated) -> None:
    """Put the numbers of a part into its lines."""
    for place, index in enumerate(members):
        values: dict[str, Any] = {
            column: _known(column, values[place].item())
            for column, values in found.columns().items()
            if values is not None
        }
        note = found.notes[place] if found.notes else ""
        lines[index] = replace(lines[index], part=number, note=note, **values)


def _known(column: str, value: float) -> float | None:
    """None for a bound that is not a number and a withheld rank."""
    missing = value == 0 if column.startswith("rank") else math.isnan(value)
    return None if missing else value


def rank_across(lines: list[Line], present: list[int], across: Tiers, rules: Rules) -> None:
    """Ranks over all parts that met, and what the votes say of those who are alone in theirs."""
    counting = [lines[index] for index in present]
    inner = np.array([line.rank or 0 for line in counting])
    lower, upper = (
        np.array([_from_mean(line, bound) for line in counting]) for bound in ("lower", "upper")
    )
    ranks = ranks_across(across, inner, lower, upper).tolist()
    least, most = outer_bounds(across)
    for place, (index, line) in enumerate(zip(present, counting, strict=True)):
        rank = ranks[place] or None
        note = remarks.note_with_rank(line.note, rank)
        moved: dict[str, Any] = {
            "rank": rank, "rank_best": None, "rank_worst": None, "note": note
        }  # fmt: skip
        if line.rating is None and rules.method is Method.BRADLEY_TERRY:
            moved["lower"] = _known("lower", MEAN_ELO + least[place].item())
            moved["upper"] = _known("upper", MEAN_ELO + most[place].item())
        lines[index] = replace(line, **moved)


def _from_mean(line: Line, bound: str) -> float:
    """How far a bound is from the mean of its part; zero for who is alone in one."""
    if line.part < 0:
        return 0.0
    value: float | None = getattr(line, bound)
    return math.nan if value is None else value - MEAN_ELO
