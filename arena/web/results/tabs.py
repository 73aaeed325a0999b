"""The tabs of the results page, each made of a snapshot alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from arena.exports.tables import LeaderboardTable
from arena.jobs.pages.measures import driving
from arena.models import Snapshot
from arena.queries.studies.results import log_of, names_in_log, snapshots_of
from arena.web.results.cost import cost, displacement
from arena.web.results.ratings import Context, pairs, standings, types
from arena.web.results.trust import coverage, raters

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
