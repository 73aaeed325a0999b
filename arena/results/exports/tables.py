"""A snapshot as a table: what every writer, chart and page shows of it."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

from django.db.models import F

from arena.exports.formats import NUMBER, TEXT, WHOLE, YES_NO
from arena.models import Snapshot, Standing
from arena.models.ratings import stored_values
from arena.rating.lines import Line
from arena.rating.printed import notes_by_reason
from arena.rating.rules import METHOD_TEXTS, UNIT_TEXTS, Intervals
from arena.results.queries.votes import LeftOut
from arena.services.hypotheses import Answered, answer_hypotheses
from arena.services.preregistration import preregistration_sha256

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


ELO_POINTS, VOTES, PLACE, PERCENT = "Elo points", "votes", "place", "%"


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """A column, and where it stands: nowhere where the name for a place is empty.

    Attributes:
        name: In CSV and Parquet.
        kind: What Parquet holds.
        unit: Empty for words.
        value: Of a contestant's row; of the whole table with `of_table`.
        key: In JSON.
        printed: Its head in LaTeX and in the terminal.
        page: Its head on the page.
        text: How a value is printed, in LaTeX, in the terminal and on the page.
        identifies: Says whose line it is, which stands first in JSON and where it is printed.
    """

    value: Callable[[Any], object]
    kind: str = TEXT
    unit: str = ""
    name: str = ""
    key: str = ""
    printed: str = ""
    page: str | None = None
    text: Callable[[Row], str] = str
    identifies: bool = False
    of_table: bool = False

    def value_of(self, table: LeaderboardTable, row: Row) -> object:
        """What stands in files."""
        return self.value(table if self.of_table else row)


def _column(name: str, kind: str = TEXT, field: str = "", **more: Any) -> Column:
    """Of a field of the row, called alike in JSON."""
    field = field or name
    settings: dict[str, Any] = {"key": name, "text": lambda row: str(getattr(row, field))} | more
    return Column(name=name, kind=kind, value=attrgetter(field), **settings)


COLUMNS = (
    _column("rank", WHOLE, unit=PLACE, printed="Rank", page="Rank",
            text=attrgetter("rank_text")),
    _column("model", printed="Model", page="Contestant", identifies=True),
    _column("elo", NUMBER, "rating", unit=ELO_POINTS, key="rating", printed="Elo",
            page="Elo", text=attrgetter("elo_text")),
    _column("lower", NUMBER, unit=ELO_POINTS),
    _column("upper", NUMBER, unit=ELO_POINTS),
    Column(value=attrgetter("interval_text"), unit=ELO_POINTS, printed="95% CI",
           page="95 % CI", text=attrgetter("interval_text")),
    _column("votes", WHOLE, unit=VOTES, printed="Votes", page="Votes"),
    Column(value=attrgetter("score_percent"), unit=PERCENT, page="Score",
           text=lambda row: f"{row.score_percent} %" if row.votes else "–"),
    _column("wins", WHOLE, unit=VOTES, page="Won"),
    _column("ties", WHOLE, unit=VOTES, page="Tied"),
    _column("losses", WHOLE, unit=VOTES, page="Lost"),
    _column("slug", identifies=True),
    _column("kind", identifies=True),
    _column("simulated", YES_NO, identifies=True),
    _column("note"),
    _column("study", key="", of_table=True),
    _column("method", field="method_text", key="", of_table=True),
    _column("study_simulated", YES_NO, "simulated", key="", of_table=True),
    _column("early", YES_NO, key="", of_table=True),
    _column("rank_best", WHOLE, unit=PLACE),
    _column("rank_worst", WHOLE, unit=PLACE),
    _column("preregistration", key="", of_table=True),
    Column(value=attrgetter("ranks_text"), unit=PLACE, printed="95% ranks",
           text=attrgetter("ranks_text")),
    _column("options"),
)  # fmt: skip

IN_FILES = tuple(column for column in COLUMNS if column.name)
ON_PAGE = tuple(column for column in COLUMNS if column.page)
_WHOSE_FIRST = sorted(COLUMNS, key=lambda column: not column.identifies)
IN_JSON = tuple(column for column in _WHOSE_FIRST if column.key)
PRINTED = tuple(column for column in _WHOSE_FIRST if column.printed)


HYPOTHESIS_COLUMNS = ("hypothesis", "better", "other", "verdict", "difference", "p_adjusted")


def hypothesis_row(one: Answered) -> list[object]:
    """A line of a table; what no number answers is empty."""
    better, other = one.hypothesis.above or ("", "")
    return [one.hypothesis.text, better, other, one.verdict or "", one.difference, one.p]


def hypotheses_document(answered: Sequence[Answered]) -> list[dict[str, Any]]:
    """For JSON."""
    return [
        {
            "hypothesis": one.hypothesis.text,
            "above": list(one.hypothesis.above) if one.hypothesis.above else None,
            "verdict": one.verdict,
            "difference": None if one.difference is None else round(one.difference, 2),
            "p_adjusted": one.p,
        }
        for one in answered
    ]


def hypothesis_line(one: Answered) -> str:
    """For a terminal."""
    if one.verdict is None:
        return f"Hypothesis: {one.hypothesis.text}"
    numbers = [] if one.difference is None else [f"{one.difference:+.0f} points"]
    if one.p is not None:
        numbers.append(f"p {one.p:.3f} adjusted")
    return f"Hypothesis: {one.hypothesis.text}: {one.verdict} ({', '.join(numbers) or 'unrated'})."
