"""Search in a rating's votes: its form in an address, and the matching rows."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any, Self

from django.db.models import Exists, OuterRef, Q, QuerySet

from arena.models import Snapshot, Vote
from arena.pairing.order import CHECK, REPEAT
from arena.rating.reliability import FAST_MS
from arena.results.queries import votes

EVERY, LEFT_OUT = "all", "left_out"
"""Marks of several: everything, and all that does not count."""

OUTCOMES = {
    "won": "The contestant won",
    "tied": "Tied",
    "lost": "The contestant lost",
    "left": "A is better",
    "equal": "Equal",
    "right": "B is better",
    "decided": "A or B is better",
    "both_miss": "Equal, both miss the instruction",
    "skip": "Skipped",
}
PARTS = {
    "commented": "With a comment",
    "fast": "Under 1 s",
    "repeats": "Hidden repeats of counted votes",
    "checks": "Attention checks answered",
}
ORDERS = {"disputed": "Most disputed"}
MARKS = {
    votes.COUNTED: "Counted",
    EVERY: "All",
    LEFT_OUT: "Left out",
    **{mark: f"Left out: {reason}" for mark, reason in votes.REASONS.items()},
    votes.AUTOMATIC_TIE: "Not shown: nobody can tell the pictures apart",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class VoteSearch:
    """Search for votes; an empty one finds all.

    Attributes:
        contestant, opponent: Slugs of who was shown.
        scenario: A slug, and `type` the type of scenarios.
        expert: The code of a judge.
        outcome: Of OUTCOMES; won, tied and lost are seen from the contestant.
        part: Of PARTS: what a number of the results stands for.
        mark: Of MARKS.
        order: Of ORDERS: what comes first; empty is the order in which the votes were given.
    """

    contestant: str = ""
    opponent: str = ""
    scenario: str = ""
    type: str = ""
    expert: str = ""
    outcome: str = ""
    part: str = ""
    mark: str = votes.COUNTED
    order: str = ""

    def as_query(self) -> dict[str, str]:
        """Return the search as an address has it, without fields at their default."""
        values = {name: getattr(self, name) for name in _DEFAULTS}
        return {name: text for name, text in values.items() if text != _DEFAULTS[name]}

    @classmethod
    def of_query(cls, query: Mapping[str, str]) -> Self:
        """Return the search from `as_query`; other words of the address are ignored."""
        return cls(**{name: query[name] for name in _DEFAULTS if query.get(name)})


def find_votes(snapshot: Snapshot, search: VoteSearch) -> QuerySet[Vote]:
    """The rows of a study of matchups, each with its `mark`; no order."""
    rows: QuerySet[Any] = votes.mark_votes(snapshot)
    if search.mark == LEFT_OUT:
        rows = rows.exclude(Q(mark=votes.COUNTED))
    elif search.mark != EVERY:
        rows = rows.filter(Q(mark=search.mark))
    if search.expert == votes.AUTOMATIC:
        return rows.none()
    if search.expert:
        rows = rows.filter(expert__in=votes.find_users([search.expert]).values())
    words = {"matchup__scenario__slug": search.scenario, "matchup__scenario__type": search.type}
    rows = rows.filter(**{path: word for path, word in words.items() if word})
    if search.outcome == "both_miss":
        rows = rows.filter(both_miss=True)
    rows = rows.filter(_shows(search))
    return _PARTS[search.part](rows, snapshot) if search.part else rows


def is_found(tie: votes.RatedVote, search: VoteSearch) -> bool:
    """Return whether it looks for a tie on a pair that nobody can tell apart."""
    if search.part:
        return False
    marks = {EVERY: True, LEFT_OUT: tie.mark not in (votes.COUNTED, votes.AUTOMATIC_TIE)}
    return (
        search.expert in ("", votes.AUTOMATIC)
        and search.outcome in ("", "tied", "equal")
        and {search.contestant, search.opponent} <= {"", tie.left, tie.right}
        and search.scenario in ("", tie.item)
        and search.type in ("", tie.type)
        and marks.get(search.mark, search.mark == tie.mark)
    )


# --- Private -----------------------------------------------------------------------------------

_DEFAULTS: dict[str, str] = {field.name: str(field.default) for field in fields(VoteSearch)}

_OUTCOMES: dict[str, list[str]] = {
    "left": ["left"],
    "right": ["right"],
    "equal": ["equal"],
    "tied": ["equal"],
    "decided": ["left", "right"],
    "skip": ["skip"],
}


def _shows(search: VoteSearch) -> Q:
    """Return the condition on the shown contestant and on the outcome as seen from it."""
    left, right = "shown_left__contestant__slug", "shown_right__contestant__slug"
    wanted = {"won": ("left", "right"), "lost": ("right", "left")}
    on_left, on_right = wanted.get(search.outcome, (search.outcome, search.outcome))
    shown = Q(pk=None)
    for own, other, outcome in ((left, right, on_left), (right, left, on_right)):
        side = Q(pk__isnull=False)
        if search.contestant:
            side &= Q(**{own: search.contestant})
        if search.opponent:
            side &= Q(**{other: search.opponent})
        if outcome in _OUTCOMES:
            side &= Q(outcome__in=_OUTCOMES[outcome])
        shown |= side
    return shown


def _repeats(rows: QuerySet[Vote], snapshot: Snapshot) -> QuerySet[Vote]:
    decided = rows.filter(matchup__kind=REPEAT, outcome__in=votes.RATED)
    current = decided.exclude(Q(mark=votes.LeftOut.SUPERSEDED.value))
    counted = votes.mark_votes(snapshot).filter(Q(mark=votes.COUNTED))
    return current.filter(Exists(counted.filter(matchup=OuterRef("matchup__repeat_of"))))


_PARTS: dict[str, Callable[[QuerySet[Vote], Snapshot], QuerySet[Vote]]] = {
    "commented": lambda rows, _: rows.exclude(comment=""),
    "fast": lambda rows, _: rows.filter(ms_visible__lt=FAST_MS),
    "repeats": _repeats,
    "checks": lambda rows, _: rows.filter(matchup__kind=CHECK, outcome__in=votes.RATED),
}
