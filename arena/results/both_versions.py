"""A rating in two versions, as a snapshot keeps them: without own votes, and adjusted."""

from __future__ import annotations

from dataclasses import dataclass

from arena.rating.estimate import Estimate
from arena.results.kept import Kept


@dataclass(frozen=True, slots=True, kw_only=True)
class LargestMove:
    """By how many ranks somebody moves at most, and who does."""

    places: int
    slugs: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class BothRanks:
    """A contestant in two versions of a rating, with and without something."""

    slug: str
    rank_with: int | None
    rating_with: float | None
    rank_without: int | None
    rating_without: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnVotes:
    """The rating with and without the votes of authors on their own contestants.

    Attributes:
        left_out: Whether the table leaves them out.
        votes, experts: How many there are, and by how many.
        of_experts: How many experts there are in all.
        rounds: Of the version that the table does not show; `reasons` are about that one.
        largest: None where nobody has a rank in both versions.
        by_judge: Their number by the judge's code.
    """

    left_out: bool
    votes: int
    experts: int
    of_experts: int
    rounds: int
    reasons: tuple[Kept, ...]
    largest: LargestMove | None
    lines: tuple[BothRanks, ...]
    by_judge: dict[str, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class CovariateEffect:
    """What one unit of a covariate is worth, in Elo points, and how likely that is by chance."""

    name: str
    points: Estimate
    p_value: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Adjustment:
    """What a rating was adjusted for, and what that changes.

    Attributes:
        effects: None where the votes do not determine them; then the table is not adjusted.
        lines: With it and without it.
        largest: None where nobody has a rank in both versions.
    """

    effects: tuple[CovariateEffect, ...]
    lines: tuple[BothRanks, ...]
    largest: LargestMove | None
