"""A snapshot as a table: what every writer, chart and page shows of it."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace

from django.db.models import F

from arena.models import Snapshot, Standing
from arena.models.ratings import stored_values
from arena.queries.votes.sets import LeftOut
from arena.rating.lines import Line, notes_by_reason
from arena.rating.rules import METHOD_TEXTS, UNIT_TEXTS, Intervals
from arena.studies.services.opening import preregistration_sha256
from arena.studies.services.plan import Answered, answer_hypotheses

SIMULATED = " (simulated)"
SIMULATED_TABLE = "Simulated: votes or contestants of this table are made by the machine."
EARLY_LOOK = "Early look: the study was still open."
NOT_RANKED = "Not enough votes to rank: no contestant can be told from any other."
APART = -1
"""The part of those who are rated with nobody."""


def shown_name(name: str, is_simulated: bool) -> str:
    """The name, with "(simulated)" where that is so."""
    return f"{name}{SIMULATED}" if is_simulated else name


@dataclass(frozen=True, slots=True, kw_only=True)
class Row(Line):
    """One contestant's line, and who that is; `name` is what people know.

    Attributes:
        variant: The recipe's name as it ends the contestant's name, empty without.
        options: How it asked, a JSON object with sorted names; empty for who asks no model.
    """

    slug: str
    kind: str
    simulated: bool
    variant: str = ""
    options: str = ""

    @property
    def model(self) -> str:
        """The name, with "(simulated)" where that is so."""
        return shown_name(self.name, self.simulated)


@dataclass(frozen=True, slots=True, kw_only=True)
class LeaderboardTable:
    """A snapshot's lines in order, and all that must be said with them.

    Attributes:
        reasons: Why ratings or intervals are missing, none if none is.
        early: The study was still open.
        notes: What else the method has to say about these votes.
        left_out: Votes that do not count, by reason.
        covariates: What the ratings are adjusted for.
        preregistration: The SHA-256 of the file that was frozen at the opening, empty without.
        hypotheses: What was expected, and what the rating says of it.
    """

    study: str
    rows: tuple[Row, ...]
    method: str
    rounds: int
    unit: str
    intervals: str = "resamples"
    seed: int
    degenerate_rounds: int
    votes: int
    left_out: dict[str, int]
    votes_sha256: str
    experts: int = 0
    scenarios: int = 0
    reasons: tuple[str, ...] = ()
    simulated: bool
    early: bool
    notes: tuple[str, ...] = ()
    covariates: tuple[str, ...] = ()
    preregistration: str = ""
    hypotheses: tuple[Answered, ...] = ()

    @property
    def status(self) -> str:
        """The reasons in one line, empty if nothing is missing."""
        return " ".join(self.reasons)

    @property
    def method_text(self) -> str:
        """How the numbers came about, in one line."""
        adjusted = f", adjusted for {', '.join(self.covariates)}" if self.covariates else ""
        return f"{METHOD_TEXTS[self.method]}{adjusted}, {intervals_text(self)}, seed {self.seed}"

    @property
    def intervals_note(self) -> dict[str, str]:
        """How intervals were found, for documents; older ratings had no word for resamples."""
        return {"intervals": self.intervals} if self.is_closed_form else {}

    @property
    def adjusted_note(self) -> dict[str, list[str]]:
        """What the ratings are adjusted for, for documents."""
        return {"covariates": list(self.covariates)} if self.covariates else {}

    @property
    def is_closed_form(self) -> bool:
        """Whether intervals come from a formula and not from resampled rounds."""
        return self.intervals == Intervals.CLOSED_FORM.value

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences that no reader may miss, for files."""
        marks = ((SIMULATED_TABLE, self.simulated), (EARLY_LOOK, self.early))
        said = [mark for mark, so in marks if so]
        return (*said, *((self.status,) if self.status else ()), *self.notes)

    @property
    def frozen_text(self) -> str:
        """What was frozen before the first vote, in one line; empty without."""
        return f"preregistered: sha256 {self.preregistration}" if self.preregistration else ""

    @property
    def missing(self) -> list[str]:
        """What is missing in which lines and why, for files."""
        return notes_by_reason((row.model, row.note) for row in self.rows)

    @property
    def has_parts(self) -> bool:
        """Whether there are groups that can't be compared with each other."""
        return len({row.part for row in self.rows if row.rating is not None}) > 1


def intervals_text(table: LeaderboardTable) -> str:
    """How intervals were found."""
    unit = UNIT_TEXTS[table.unit]
    if table.is_closed_form:
        return f"95 % intervals in closed form, clustered by {unit}"
    return f"95 % intervals by {table.rounds} resamples of {unit}"


def leaderboard_table(snapshot: Snapshot) -> LeaderboardTable:
    """The table of a snapshot, best first; one query."""
    lines = snapshot.standings.select_related("contestant")
    standings = list(lines.order_by(F("rating").desc(nulls_last=True), "slug"))
    board = snapshot.results.board
    reasons = (snapshot.reason,) if board.reasons is None else board.reasons
    last = len(standings)
    standings.sort(key=lambda standing: board.parts.get(standing.slug, last))
    if board.order:
        standings.sort(key=lambda standing: board.order.index(standing.slug))
    rows = [
        _row(standing, board.parts.get(standing.slug, APART) if board.parts else 0)
        for standing in standings
    ]
    ranks = [row.rank for row in rows if row.rank is not None]
    if len(rows) > 1 and len(ranks) != 1 and set(ranks) <= {1}:
        rows = [replace(row, rank=None, rank_best=None, rank_worst=None) for row in rows]
        reasons = (*reasons, NOT_RANKED)
    return LeaderboardTable(
        study=snapshot.study.name,
        rows=tuple(rows),
        method=snapshot.method,
        rounds=snapshot.rounds,
        unit=snapshot.resampling_unit,
        intervals=snapshot.intervals,
        seed=snapshot.seed,
        degenerate_rounds=snapshot.degenerate_rounds,
        votes=snapshot.votes_counted,
        left_out=dict(sorted(snapshot.votes_left_out.items())),
        votes_sha256=snapshot.votes_sha256,
        experts=board.experts,
        scenarios=board.scenarios,
        reasons=tuple(filter(None, reasons)),
        simulated=snapshot.includes_simulated,
        early=snapshot.is_early,
        notes=tuple(filter(None, board.warnings)),
        covariates=_covariates(snapshot),
        preregistration=preregistration_sha256(snapshot.study),
        hypotheses=answer_hypotheses(snapshot),
    )


def for_experts(table: LeaderboardTable) -> LeaderboardTable:
    """The same table without a word of authors: what is left out for that was not asked for."""
    left_out = dict(table.left_out)
    own = left_out.pop(LeftOut.OWN.value, 0)
    if own:
        left_out[LeftOut.FILTERED.value] = left_out.get(LeftOut.FILTERED.value, 0) + own
    return replace(table, left_out=left_out)


def _covariates(snapshot: Snapshot) -> tuple[str, ...]:
    """None where the votes do not determine what these are worth."""
    found = snapshot.results.adjustment
    return tuple(one.name for one in found.effects) if found else ()


def _options(standing: Standing) -> str:
    """What a contestant was fixed to when it first ran, which nothing changes any more."""
    who = standing.contestant
    fixed = None if who is None else who.frozen_options
    return json.dumps(fixed, sort_keys=True) if fixed else ""


def _row(standing: Standing, part: int) -> Row:
    name, variant = standing.name, standing.variant
    last_word = name.rpartition(" ")[2]
    return Row(
        name=name,
        variant=last_word if variant and last_word.lower() == variant.lower() else "",
        slug=standing.slug,
        kind=standing.kind,
        simulated=standing.is_simulated,
        part=part,
        options=_options(standing),
        **stored_values(standing),
    )
