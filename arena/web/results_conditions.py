"""What the tabs show of types, sides and sessions: conditions under which votes were given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from django.utils.functional import Promise
from django.utils.translation import gettext_lazy as _

from arena.exports.tables import Row
from arena.rating.interactions import Effect, Interaction
from arena.rating.session import Drift

Context = dict[str, Any]

SURE = 0.05
"""Cells of a smaller adjusted p-value are marked."""

MEASURES: dict[str, tuple[str | Promise, str]] = {
    "ties": (_("Ties"), "percent"),
    "seconds": (_("Time on screen"), "seconds"),
    "agreement": (_("Agrees with others"), "percent"),
    "favourites": (_("Picks the others’ favourite"), "percent"),
    "left": (_("Left"), "percent"),
}
"""What is called how, and in what it is counted."""


def interaction(found: Interaction | None, rows: Sequence[Row]) -> Context | None:
    """A table of cells, a line a contestant in the order of the table; None without a test."""
    if found is None:
        return None
    cells = {(cell.contestant, cell.condition): cell for cell in found.cells}
    conditions = list(dict.fromkeys(cell.condition for cell in found.cells))
    return {
        "test": found,
        "conditions": conditions,
        "lines": [
            {"row": row, "cells": [_shown(cells.get((row.slug, one))) for one in conditions]}
            for row in rows
            if any((row.slug, one) in cells for one in conditions)
        ],
    }


def drifts(found: Sequence[Drift], behind: Mapping[str, int]) -> list[Context]:
    """A line a measure: at the start and at the end of sessions, and the change.

    Args:
        found: The measures of a rating.
        behind: How many votes there are by measure; where these are all that it is made of, and
            no session had only one of them, its number leads there.
    """
    return [
        {
            "label": MEASURES[one.measure][0],
            "unit": MEASURES[one.measure][1],
            "kept": one,
            "is_sure": one.p_value is not None and one.p_value < SURE,
            "are_behind": behind.get(one.measure) == one.votes,
            "outcome": "decided" if one.measure == "left" else "",
            "part": "shared" if one.measure == "agreement" else "",
        }
        for one in found
        if one.measure in MEASURES
    ]


# --- Private -----------------------------------------------------------------------------------


def _shown(cell: Effect | None) -> Mapping[str, Any]:
    if cell is None:
        return {"cell": None, "is_sure": False}
    return {"cell": cell, "is_sure": cell.p_value is not None and cell.p_value < SURE}
