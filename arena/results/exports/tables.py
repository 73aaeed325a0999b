"""A snapshot as a table: what every writer, chart and page shows of it.

In: a snapshot. Out: its lines in order with all that must be said with them.
"""

import json
from dataclasses import dataclass, replace
from typing import Any

from django.db.models import F

from arena.exports.cells import show_name
from arena.models import Question, Snapshot, Standing
from arena.models.ratings import snapshot_values
from arena.rating.lines import Line, hide_ranks, notes_by_reason, says_no_order, votes_text
from arena.rating.remarks import NOT_RANKED
from arena.rating.rules import METHOD_TEXTS, Intervals, text_of_intervals
from arena.rating.snapshot_document import BoardRemarks
from arena.results.queries.votes import LeftOut
from arena.studies.services.opening import preregistration_sha256
from arena.studies.services.plan import HypothesisAnswer, answer_hypotheses

SIMULATED_TABLE = "Simulated: votes or contestants of this table are made by the machine."
EARLY_LOOK = "Early look: the study was still open."
APART = -1
"""The part of those who are rated with nobody."""


def method_text(rating: Snapshot) -> str:
    """Return the method behind its numbers, in one line."""
    # Earlier ratings could be adjusted for what was shown.
    adjusted = f", adjusted for {', '.join(rating.covariates)}" if rating.covariates else ""
    intervals = text_of_intervals(rating.intervals, rating.resampling_unit, rating.rounds)
    method = METHOD_TEXTS[rating.method]
    is_usual = rating.study.questions == [Question.INSTRUCTION]
    question = "" if is_usual else f", question {rating.question}"
    # Nothing is drawn for a closed form; earlier ratings name the seed all the same.
    is_old = rating.state == Snapshot.State.READY and rating.settled_ties is None
    is_drawn = is_old or rating.intervals != Intervals.CLOSED_FORM.value
    seed = f", seed {rating.seed}" if is_drawn else ""
    return f"{method}{adjusted}, {intervals}{seed}{question}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Row(Line):
    """One contestant's line, and who that is; `name` is what people know.

    Attributes:
        variant: The recipe's name as it ends the contestant's name, empty without.
        options: How it asked, a JSON object with sorted names; empty for who asks no model.
        sends: What of that its models take, by role, in the same form.
        settled_ties: How many of `votes` and `ties` are of pairs that nobody was shown.
        card: Who made a submission and how; None for all others.
    """

    slug: str
    kind: str
    is_simulated: bool
    variant: str = ""
    options: str = ""
    sends: str = ""
    settled_ties: int = 0
    card: dict[str, Any] | None = None

    @property
    def model(self) -> str:
        """The name, with "(simulated)" where that is so."""
        return show_name(self)

    @property
    def votes_cast(self) -> int:
        """The votes that people gave."""
        return self.votes - self.settled_ties

    @property
    def ties_cast(self) -> int:
        """The ties among them."""
        return self.ties - self.settled_ties


@dataclass(frozen=True, slots=True, kw_only=True)
class LeaderboardTable:
    """A snapshot's lines in order, and all that must be said with them.

    Attributes:
        reasons: Why ratings or intervals are missing, none if none is.
        left_out: Votes that do not count, by reason.
        preregistration: The SHA-256 of the file that was frozen at the opening, empty without.
        hypotheses: What was expected, and what the rating says of it.
        name_notes: What contestants' names say of variants that are called otherwise now.
    """

    snapshot: Snapshot
    rows: tuple[Row, ...]
    left_out: dict[str, int]
    reasons: tuple[str, ...] = ()
    preregistration: str = ""
    hypotheses: tuple[HypothesisAnswer, ...] = ()
    name_notes: tuple[str, ...] = ()

    @property
    def votes_text(self) -> str:
        """Number of counted votes and, apart from it, of ties on pairs that were not shown."""
        return votes_text(self.snapshot.votes_cast, self.snapshot.settled_ties)

    @property
    def method_text(self) -> str:
        """Method behind the numbers, in one line."""
        return method_text(self.snapshot)

    @property
    def warnings(self) -> list[str]:
        """Sentences that no reader may miss, for files."""
        rating = self.snapshot
        marks = {SIMULATED_TABLE: rating.includes_simulated, EARLY_LOOK: rating.is_early}
        remarks = [mark for mark, holds in marks.items() if holds]
        return [*remarks, *filter(None, [" ".join(self.reasons)]), *self.notes]

    @property
    def notes(self) -> list[str]:
        """Further remarks of the method on these votes."""
        return list(filter(None, (*self.snapshot.results.board.warnings, *self.name_notes)))

    @property
    def frozen_text(self) -> str:
        """Preregistered rules in one line; empty without any."""
        return f"preregistered: sha256 {self.preregistration}" if self.preregistration else ""

    @property
    def missing(self) -> list[str]:
        """Missing values with their lines and reasons, for files."""
        return notes_by_reason((row.model, row.note) for row in self.rows)

    @property
    def has_parts(self) -> bool:
        """True if there are groups that can't be compared with each other."""
        return len({row.part for row in self.rows if row.rating is not None}) > 1


def leaderboard_table(snapshot: Snapshot) -> LeaderboardTable:
    """Return the table of a snapshot, best first; one query."""
    lines = snapshot.standings.select_related("contestant")
    standings = list(lines.order_by(F("rating").desc(nulls_last=True), "slug"))
    board = snapshot.results.board
    reasons = (snapshot.reason,) if board.reasons is None else board.reasons
    last = len(standings)
    standings.sort(key=lambda standing: board.parts.get(standing.slug, last))
    if board.order:
        standings.sort(key=lambda standing: board.order.index(standing.slug))
    rows = [_row(standing, board) for standing in standings]
    if says_no_order(rows):
        rows = hide_ranks(rows)
        reasons = (*reasons, NOT_RANKED)
    return LeaderboardTable(
        snapshot=snapshot,
        rows=tuple(rows),
        left_out=dict(sorted(snapshot.votes_left_out.items())),
        reasons=tuple(filter(None, reasons)),
        preregistration=preregistration_sha256(snapshot.study),
        hypotheses=answer_hypotheses(snapshot),
        name_notes=tuple(row.contestant.name_note for row in standings if row.contestant),
    )


def for_experts(table: LeaderboardTable) -> LeaderboardTable:
    """The same table without a word of authors: what is left out for that was not asked for."""
    left_out = dict(table.left_out)
    own = left_out.pop(LeftOut.OWN.value, 0)
    if own:
        left_out[LeftOut.FILTERED.value] = left_out.get(LeftOut.FILTERED.value, 0) + own
    return replace(table, left_out=left_out)


def _row(standing: Standing, board: BoardRemarks) -> Row:
    name, variant, who = standing.name, standing.variant, standing.contestant
    last_word = name.rpartition(" ")[2]
    options, sends = (who.frozen_options, who.sends) if who else (None, None)
    return Row(
        name=name,
        variant=last_word if variant and last_word.lower() == variant.lower() else "",
        slug=standing.slug,
        kind=standing.kind,
        is_simulated=standing.is_simulated,
        part=board.parts.get(standing.slug, APART) if board.parts else 0,
        settled_ties=(board.settled or {}).get(standing.slug, 0),
        options=json.dumps(options, sort_keys=True) if options else "",
        sends=json.dumps(sends, sort_keys=True) if sends else "",
        card=who.card if who else None,
        **snapshot_values(standing),
    )
