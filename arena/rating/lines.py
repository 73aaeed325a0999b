"""A line of the rated table, the same everywhere.

A snapshot stores the fields that `arena.models.Standing` has as well; files, pages and the API
show them.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

AnyLine = TypeVar("AnyLine", bound="Line")

UNKNOWN = "--"
MINUS = "\N{MINUS SIGN}"

_SYMMETRIC = 1e-6
"""Points by which sides may differ for the sake of rounding."""


def whole_percent(share: float) -> int:
    """A share in whole percent, the same wherever it stands; two shares of one make a hundred.

    A half goes to the even number, also where 100 times the share falls short of it: 0.575 of the
    votes are 58 %, and the 0.425 beside them 42 %.
    """
    # The inner rounding mends 57.49999999999999, the outer one takes halves to the even number.
    return round(round(100.0 * share, 9))


def interval_text(rating: float | None, lower: float | None, upper: float | None) -> str:
    """The interval: ±55, or as the paper prints it where its sides differ, -9/+11.

    Where a side would round to nothing, both have a decimal: no interval has the width zero. A
    side without a bound is infinite, and a bound without a rating stands as it is: ≥ 1118.
    """
    if lower is None and upper is None:
        return UNKNOWN
    if rating is None:
        return f"≤ {upper:.0f}" if lower is None else f"≥ {lower:.0f}"
    if lower is None or upper is None:
        below = "-∞" if lower is None else f"{min(round(lower) - round(rating), -1):+d}"
        above = "+∞" if upper is None else f"{max(round(upper) - round(rating), 1):+d}"
        return f"{below}/{above}"
    if abs((upper - rating) - (rating - lower)) < _SYMMETRIC:
        half = (upper - lower) / 2.0
        return f"±{half:.0f}" if round(half) else f"±{max(half, 0.1):.1f}"
    down, up = round(lower) - round(rating), round(upper) - round(rating)
    if down and up:
        return f"{down:+d}/{up:+d}"
    return f"-{max(rating - lower, 0.1):.1f}/+{max(upper - rating, 0.1):.1f}"


def join_counts(votes: int | None, settled: int | None) -> str:
    """Return votes as they were cast, and after a plus those that are ties nobody was shown."""
    return f"{(votes or 0) - settled} + {settled}" if settled else str(votes)


def with_minus(text: str) -> str:
    """A printed number as a page shows it: a real minus sign, a dash where it is unknown."""
    return "–" if text == UNKNOWN else text.replace("-", MINUS)


def notes_by_reason(notes: Iterable[tuple[str, str]]) -> list[str]:
    """Return the missing values of lines, grouped by reason: "a, b: too few votes".

    Args:
        notes: Names and what is missing in their lines, empty where nothing is.
    """
    names_by_note: dict[str, list[str]] = {}
    for name, note in notes:
        if note:
            names_by_note.setdefault(note, []).append(name)
    return [f"{', '.join(names)}: {note}" for note, names in names_by_note.items()]


def says_no_order(lines: Sequence["Line"]) -> bool:
    """Return whether all ranks are 1: no pair can be told apart, and no rank is shown."""
    ranks = [line.rank for line in lines if line.rank is not None]
    return len(lines) > 1 and len(ranks) != 1 and set(ranks) <= {1}


def hide_ranks(lines: Iterable[AnyLine]) -> list[AnyLine]:
    """Return the lines without ranks and places left."""
    return [replace(line, rank=None, rank_best=None, rank_worst=None) for line in lines]


def votes_text(votes: int, settled: int | None) -> str:
    """Return the number of counted votes and, apart from it, of ties that were not shown.

    Args:
        votes: Without these ties.
        settled: How many ties; None where they were not counted.
    """
    if settled is None:
        return f"{votes} votes"
    ties = f" and {count_text(settled, 'tie| on pairs that nobody was shown')}" if settled else ""
    return f"{count_text(votes, 'vote|')}{ties}"


def unshown_text(pairs: int, ties: str) -> str:
    """Return how many pairs were not shown, and as what ties they count; empty: left out."""
    was, is_, count = ("was", "is", "counts") if pairs == 1 else ("were", "are", "count")
    end = f"{count} as {ties}" if ties else f"{is_} left out"
    return f"{count_text(pairs, 'pair|')} that nobody can tell apart {was} not shown and {end}"


def count_text(number: int, what: str) -> str:
    """A number of things, whose plural has an s in the place of |."""
    return f"{number} {what.replace('|', '' if number == 1 else 's')}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """One contestant; None where the votes do not determine a number, and the note says why.

    Attributes:
        rating, lower, upper: Elo points; the mean of those rated together is 1000. A bound can
            stand alone: without the other one, and without a rating for who won or lost all.
        rank: As the paper defines it: 1 + the number of others whose lower bound is above `upper`.
            Nobody is first for want of bounds: see `ranking.decide_ranks`.
        rank_best, rank_worst: The simultaneous 95 % rank set: behind everybody who is shown to be
            above and ahead of everybody who is shown to be below, all pairs judged at once.
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
    votes: int = 0
    wins: int = 0
    ties: int = 0
    losses: int = 0
    part: int = 0
    note: str = ""

    @property
    def model(self) -> str:
        """The name, as it stands in files."""
        return self.name

    @property
    def votes_cast(self) -> int:
        """The votes that people gave."""
        return self.votes

    @property
    def ties_cast(self) -> int:
        """The ties among them."""
        return self.ties

    @property
    def interval(self) -> tuple[float | None, float | None, float | None]:
        """Lower bound, rating and upper bound, each None where it is not determined."""
        return self.lower, self.rating, self.upper

    @property
    def score_percent(self) -> int:
        """The mean score of a vote in percent, a tie half; 0 without votes."""
        return whole_percent((self.wins + self.ties / 2) / self.votes) if self.votes else 0

    @property
    def rank_text(self) -> str:
        """The rank, or two hyphens without one."""
        return UNKNOWN if self.rank is None else str(self.rank)

    @property
    def ranks_text(self) -> str:
        """The places that are left with all pairs judged at once: 1–3, or 1 alone."""
        if self.rank_best is None:
            return UNKNOWN
        is_one = self.rank_best == self.rank_worst
        return str(self.rank_best) if is_one else f"{self.rank_best}–{self.rank_worst}"

    @property
    def elo_text(self) -> str:
        """The rating as a whole number."""
        return UNKNOWN if self.rating is None else str(round(self.rating))

    @property
    def interval_text(self) -> str:
        """The interval: ±55, or -9/+11 around the printed rating."""
        return interval_text(self.rating, self.lower, self.upper)

    @property
    def has_bound(self) -> bool:
        """True if there is an interval, be it open on one side."""
        return self.lower is not None or self.upper is not None
