"""A published table of a board as a value, its codec, and what makes tables comparable.

In: the lines of a rating. Out: the same lines on the scale of the board's first table.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeVar

from arena.rating.lines import AnyLine, Line, votes_text

MEAN = 1000.0
"""Elo points: the mean of the contestants of the first study, in every table."""

PROVISIONAL_ABOVE = 50
"""Elo points: a wider half of an interval makes a line provisional; a board may say otherwise."""

AnyName = TypeVar("AnyName")


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardLine(Line):
    """One contestant's line; `name` is what people know.

    Attributes:
        votes, ties: Those that people gave; older tables count settled ties with them.
        since: The day of the first table that has it, as ISO 8601.
        authors: Of a submission, else none.
        is_open: Whether a submission's code and weights are public; None where nobody says.
        settled_ties: Ties on pairs that nobody was shown, which are rated as well.
        submitted, withdrawn: How many folders who submitted it sent for the benchmark by then, and
            took back; None for who is no submission, and in older tables.
        is_provisional: Whether its interval is still wider than the board's rule.
    """

    slug: str
    kind: str
    is_simulated: bool
    since: str
    authors: tuple[str, ...] = ()
    is_open: bool | None = None
    settled_ties: int = 0
    submitted: int | None = None
    withdrawn: int | None = None
    is_provisional: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class PooledStudy:
    """A study whose votes a table counts.

    Attributes:
        closed_at: In UTC as ISO 8601.
        preregistration: SHA-256 of the file that was frozen at its opening.
        challengers: Slugs of the contestants that it brought; none for the first study.
    """

    name: str
    code: str
    closed_at: str
    votes: int
    preregistration: str
    challengers: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardTableDocument:
    """All that a published table says.

    Attributes:
        made_at: In UTC as ISO 8601.
        benchmark: Its name and version, as in "merging@2"; empty for a board without one.
        benchmark_sha256: Its checksum, empty likewise.
        question: What the experts were asked.
        answer: What the table says, in one sentence.
        lines: Best first.
        founders: Slugs of the contestants whose ratings have the mean 1000.
        votes_sha256: Of the counted votes of all studies in one CSV file.
        left_out: How many votes do not count, by reason.
        notes: What must be said with the numbers.
        versions: Of what the numbers depend on, by name.
        settled_ties: On pairs that nobody was shown; None where `votes` counts them as well.
        provisional_above: The board's rule, half an interval in points; None in older tables.
    """

    format: Literal["scenario-arena/board-table"] = "scenario-arena/board-table"
    version: Literal[1] = 1
    board: str
    number: int
    made_at: str
    benchmark: str
    benchmark_sha256: str
    question: str
    method: str
    answer: str
    lines: tuple[BoardLine, ...]
    studies: tuple[PooledStudy, ...]
    founders: tuple[str, ...]
    votes: int
    votes_sha256: str
    left_out: dict[str, int]
    notes: tuple[str, ...]
    versions: dict[str, str]
    includes_simulated: bool
    settled_ties: int | None = None
    provisional_above: float | None = None

    @property
    def votes_text(self) -> str:
        """Number of counted votes and, apart from it, of ties on pairs that were not shown."""
        return votes_text(self.votes, self.settled_ties)

    @property
    def made_on(self) -> str:
        """The day, as ISO 8601."""
        return self.made_at[:10]


def anchor_lines(lines: Sequence[AnyLine], founders: Collection[str]) -> list[AnyLine]:
    """Move ratings and bounds so that the mean of the founders is 1000.

    Newcomers then move nobody else by being strong or weak. Where not everybody is rated together
    the lines stay as they are: their groups can't be compared anyway.

    Args:
        lines: Of a rating, named by slugs.
        founders: Names of those whose mean is fixed; who of them has no rating is passed over.
    """
    parts = {line.part for line in lines if line.rating is not None}
    fixed = [line.rating for line in lines if line.name in founders and line.rating is not None]
    if len(parts) != 1 or not fixed:
        return list(lines)
    # Ratings are known up to a shift: one that is the same for all moves no difference.
    shift = MEAN - sum(fixed) / len(fixed)

    def move(value: float | None) -> float | None:
        return None if value is None else value + shift

    return [
        replace(line, rating=move(line.rating), lower=move(line.lower), upper=move(line.upper))
        for line in lines
    ]


def is_provisional(line: Line, above: float) -> bool:
    """Return whether a line has no interval, or one wider than so many points each way."""
    if line.lower is None or line.upper is None:
        return True
    return line.upper - line.lower > 2.0 * above


def spread_over(ranked: Sequence[AnyName], most: int) -> list[AnyName]:
    """Return at most so many of a table's lines: the first, the last and evenly between."""
    last = len(ranked) - 1
    if last < most:
        return list(ranked)
    # Even steps from 0 to the last place, both included.
    return [ranked[round(step * last / (most - 1))] for step in range(most)]
