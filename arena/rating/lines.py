"""A line of the rated table, the same everywhere.

A snapshot stores the fields that `arena.models.Standing` has as well; files, pages and the API
show them.
"""

from __future__ import annotations

from dataclasses import dataclass

from arena.rating.printed import interval_text, places_text, rank_text, rating_text, whole_percent


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
        return rank_text(self.rank)

    @property
    def ranks_text(self) -> str:
        """The places that are left with all pairs judged at once: 1–3, or 1 alone."""
        return places_text(self.rank_best, self.rank_worst)

    @property
    def elo_text(self) -> str:
        """The rating as a whole number."""
        return rating_text(self.rating)

    @property
    def interval_text(self) -> str:
        """The interval: ±55, or -9/+11 around the printed rating."""
        return interval_text(self.rating, self.lower, self.upper)

    @property
    def has_bound(self) -> bool:
        """Whether there is an interval, be it open on one side."""
        return self.lower is not None or self.upper is not None
