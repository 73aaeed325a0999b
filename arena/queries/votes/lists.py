"""The votes behind a number of a rating: one page of them, all of them, or the ones beside one.

In: a snapshot and what is looked for. Out: votes with the mark that says why one does not count,
as `vote_sets` says it; the database finds them, so that a page costs the same for any number.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import overload
from uuid import UUID

from django.core.paginator import Page, Paginator
from django.db.models import Q, QuerySet

from arena.models import Snapshot, Vote
from arena.queries.remembering import Remembered, plan_types
from arena.queries.votes.evidence import read_evidence, sort_votes
from arena.queries.votes.judged import AUTOMATIC, Judged, is_imported, settled_ties, votes_up_to
from arena.queries.votes.listed import (
    ListedVote,
    imported_votes,
    of_automatic,
    of_imported,
    of_votes,
)
from arena.queries.votes.parts import find_part
from arena.queries.votes.search import (
    AUTOMATIC_TIE,
    COUNTED,
    EVERY,
    LEFT_OUT,
    SoughtOrder,
    SoughtOutcome,
    SoughtPart,
    VoteSearch,
)
from arena.queries.votes.sets import (
    Filters,
    counted_votes,
    made_up_contestants,
    marked_votes,
    users_of,
    why_left_out,
)
from augment.models import Augmentation

PER_PAGE = 25
CHUNK = 2000
"""So many votes are read at once for a file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Neighbours:
    """Where a vote stands among those looked for, from 1; `place` is None where it is none."""

    before: UUID | None
    after: UUID | None
    place: int | None
    total: int


def vote_page(snapshot: Snapshot, search: VoteSearch, number: int) -> Page[ListedVote]:
    """One page with the numbers beside its pictures; beyond the last is the last.

    Args:
        snapshot: With its study.
        search: What is looked for.
        number: From 1.
    """
    return Paginator(_Found(snapshot, search), PER_PAGE).get_page(number)


def each_vote(snapshot: Snapshot, search: VoteSearch) -> Iterator[ListedVote]:
    """All that are looked for, in the order of their pages."""
    return iter(_Found(snapshot, search))


def neighbours(snapshot: Snapshot, search: VoteSearch, vote: Vote) -> Neighbours:
    """The votes before and after one among those that are looked for."""
    keys = [pk for pk, _ in _Found(snapshot, search).keys]
    if vote.pk not in keys:
        return Neighbours(before=None, after=None, place=None, total=len(keys))
    place = keys.index(vote.pk)
    return Neighbours(
        before=_code_at(keys, place - 1),
        after=_code_at(keys, place + 1),
        place=place + 1,
        total=len(keys),
    )


def votes_behind(snapshot: Snapshot, search: VoteSearch) -> QuerySet[Vote]:
    """The rows of a study of matchups, each with its `mark`; no order."""
    rows = marked_votes(snapshot)
    if search.mark == LEFT_OUT:
        rows = rows.exclude(Q(mark=COUNTED))
    elif search.mark != EVERY:
        rows = rows.filter(Q(mark=search.mark))
    if search.expert == AUTOMATIC:
        return rows.none()
    if search.expert:
        rows = rows.filter(expert__in=users_of([search.expert]).values())
    words = {
        "matchup__scenario__slug": search.scenario,
        "matchup__right__sample": search.sample,  # both sides show the same one
        "matchup__scenario__type": search.type,
        "comment__icontains": search.comment,
        "aids__contains": search.aid,  # no aid's name is part of another's
    }
    rows = rows.filter(**{path: word for path, word in words.items() if word})
    rows = rows.filter(_shows(search), _came_out(search))
    return find_part(rows, snapshot, SoughtPart(search.part)) if search.part else rows


def settled_counted(snapshot: Snapshot) -> int:
    """Return how many ties of pairs that nobody was shown count in a rating."""
    is_possible = snapshot.study.rules.get("identical") and not is_imported(snapshot.study)
    if not is_possible or Filters.of_document(snapshot.filters).leave_out_settled:
        return 0
    return snapshot.votes_counted - counted_votes(snapshot).count()


# --- What is found -----------------------------------------------------------------------------


def _code_at(keys: Sequence[int], place: int) -> UUID | None:
    inside = 0 <= place < len(keys)
    return Vote.objects.values_list("key", flat=True).get(pk=keys[place]) if inside else None


class _Found(Sequence[ListedVote]):
    """Rows of the database, and after them the pairs that nobody can tell apart."""

    def __init__(self, snapshot: Snapshot, search: VoteSearch) -> None:
        self._snapshot, self._search = snapshot, search
        self._imported = is_imported(snapshot.study)
        self._automatic = [] if self._imported else _automatic(snapshot, search)
        self._lines = imported_votes(snapshot, search) if self._imported else None

    def __len__(self) -> int:
        return self._stored + len(self._automatic)

    @overload
    def __getitem__(self, place: int) -> ListedVote: ...

    @overload
    def __getitem__(self, place: slice) -> list[ListedVote]: ...

    def __getitem__(self, place: int | slice) -> ListedVote | list[ListedVote]:
        """The votes from one place up to another, from 0, with what is known of their pictures."""
        if isinstance(place, int):
            return self[place : place + 1][0]
        if self._lines is not None:
            return of_imported(self._lines[place], self._snapshot)
        listed = of_votes(self.keys[place], self._snapshot, read_evidence(self._snapshot))
        start, stop, _ = place.indices(len(self))
        rest = self._automatic[max(start - self._stored, 0) : max(stop - self._stored, 0)]
        return listed + of_automatic(rest, self._snapshot)

    def __iter__(self) -> Iterator[ListedVote]:
        """All of them; what is found is found once, whatever its number."""
        if self._lines is not None:
            yield from of_imported(self._lines.iterator(CHUNK), self._snapshot)
            return
        for start in range(0, self._stored, CHUNK):
            yield from of_votes(self.keys[start : start + CHUNK], self._snapshot)
        yield from of_automatic(self._automatic, self._snapshot)

    @cached_property
    def keys(self) -> list[tuple[int, str]]:
        """Every vote that is looked for, with its mark; a rating's votes never change."""
        if self._lines is not None:
            return []
        rating, search = self._snapshot, self._search
        if search.order == SoughtOrder.FAULTS:  # labels are given later
            return self._find()
        types = plan_types(rating.study)
        found = (rating.code, rating.last_vote, json.dumps(rating.filters), search, types)
        return _FOUND.get(found, self._find)

    @cached_property
    def _stored(self) -> int:
        return len(self.keys) if self._lines is None else self._lines.count()

    def _find(self) -> list[tuple[int, str]]:
        return sort_votes(votes_behind(self._snapshot, self._search), self._snapshot, self._search)


_FOUND: Remembered[list[tuple[int, str]]] = Remembered(3)
_TIES: Remembered[list[Judged]] = Remembered(3)


def _settled_ties(snapshot: Snapshot) -> list[Judged]:
    """The ties on pairs that nobody was shown, as the rating's votes give them."""
    study, last = snapshot.study, snapshot.last_vote
    if not study.rules.get("identical"):
        return []
    key = (snapshot.code, last, plan_types(study))
    return _TIES.get(key, lambda: settled_ties(study, votes_up_to(study, last)[0]))


def _automatic(snapshot: Snapshot, search: VoteSearch) -> list[tuple[Judged, str]]:
    """Pairs that nobody can tell apart, with their mark, by the same search."""
    judged = search.comment or search.part or search.aid or search.sample
    if judged or search.expert not in ("", AUTOMATIC):
        return []
    if search.outcome not in ("", SoughtOutcome.TIED, SoughtOutcome.EQUAL):
        return []
    filters = Filters.of_document(snapshot.filters)
    simulated = set(made_up_contestants(snapshot.study).values_list("slug", flat=True))
    found = []
    for line in _settled_ties(snapshot):
        reason = why_left_out(line, filters, simulated, snapshot.study.allow_simulated)
        counted = reason.value if reason else COUNTED
        mark = AUTOMATIC_TIE if filters.leave_out_settled else counted
        if _fits(line, mark, search):
            found.append((line, mark))
    return found


def _fits(line: Judged, mark: str, search: VoteSearch) -> bool:
    shown = {line.left, line.right}
    wanted = {slug for slug in (search.contestant, search.opponent) if slug}
    marks = {EVERY: True, LEFT_OUT: mark not in (COUNTED, AUTOMATIC_TIE)}
    return (
        wanted <= shown
        and search.scenario in ("", line.item)
        and search.type in ("", line.type)
        and marks.get(search.mark, search.mark == mark)
    )


# --- The database's part -----------------------------------------------------------------------


def _side(side: str, slug: str) -> Q:
    """Who was shown on a side; a list of their pictures is quicker than a look at each vote's."""
    own = Augmentation.objects.filter(contestant__slug=slug).values("pk")
    return Q(**{f"shown_{side}__in": own}) if slug else Q()


def _shows(search: VoteSearch) -> Q:
    first, second = search.contestant, search.opponent
    if not first and not second:
        return Q()
    return (_side("left", first) & _side("right", second)) | (
        _side("right", first) & _side("left", second)
    )


def _came_out(search: VoteSearch) -> Q:
    wanted, slug = search.outcome, search.contestant
    if wanted in (SoughtOutcome.WON, SoughtOutcome.LOST):
        on_left, on_right = ("left", "right") if wanted == SoughtOutcome.WON else ("right", "left")
        return (_side("left", slug) & Q(outcome=on_left)) | (
            _side("right", slug) & Q(outcome=on_right)
        )
    if wanted in (SoughtOutcome.TIED, SoughtOutcome.EQUAL):
        return Q(outcome="equal")
    if wanted == SoughtOutcome.DECIDED:
        return Q(outcome__in=("left", "right"))
    if wanted == SoughtOutcome.BOTH_MISS:
        return Q(both_miss=True)
    return Q(outcome=wanted) if wanted else Q()
