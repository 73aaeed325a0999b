"""The votes behind a number of a rating, with their pictures: pages of them, all, or a single one.

In: a snapshot and what is looked for. Out: votes with the mark that says why one does not count.
The database finds them, so that a page costs the same for any number.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from typing import overload
from uuid import UUID

from django.core.paginator import Page, Paginator

from arena.models import ImportedVote, Report, Snapshot, Vote
from arena.results.queries.scores import (
    Evidence,
    Faults,
    PictureKey,
    VoteScore,
    pair_key,
    rating_key,
    read_evidence,
    read_faults,
    sort_votes,
)
from arena.results.queries.search import EVERY, VoteSearch, find_lines, find_votes, is_found
from arena.results.queries.votes import (
    AUTOMATIC,
    IMPORTED,
    IMPORTED_OUTCOMES,
    Filters,
    Judged,
    counted_votes,
    current_votes,
    is_imported,
    settled_ties,
)
from arena.voting.queries.remembering import Remembered
from augment.models import Augmentation

PER_PAGE = 25
CHUNK = 2000
"""So many votes are read at once for a file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownSide:
    """Who was shown on a side.

    Attributes:
        place: left or right.
        augmentation: Its code, None where there is no picture.
        sample: Of the picture, 0 unless each is judged on its own.
        score: The picture's votes that count, None where the list does not show them.
    """

    place: str
    won: bool
    slug: str
    name: str
    is_simulated: bool = False
    augmentation: UUID | None = None
    sample: int = 0
    score: VoteScore | None = None
    faults: Faults | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ListedVote:
    """One line of a list of votes.

    Attributes:
        code: Of the vote, None where it has no page: from a file, or settled without anybody.
        line: Of the file that it came from.
        judge: The pseudonym as the rating kept it, empty where nobody decided.
        kind: Of the matchup, or `automatic` or `imported`.
        matchup: The code of the showing.
        sides: Left and right.
        outcome: left, equal, right or skip.
        reason: Why it was skipped.
        mark: Why it does not count, or that it does.
        pair: The votes on both pictures that count, as one of the two sees them.
    """

    code: UUID | None = None
    line: int | None = None
    at: datetime | None = None
    judge: str = ""
    scenario: str
    scenario_code: UUID | None = None
    instruction: str = ""
    type: str = ""
    kind: str
    matchup: UUID | None = None
    position: int | None = None
    sides: tuple[ShownSide, ShownSide]
    outcome: str
    both_miss: bool = False
    reason: str = ""
    ms_visible: int | None = None
    aids: str = ""
    comment: str = ""
    is_simulated: bool = False
    mark: str
    pair: VoteScore | None = None

    @property
    def left(self) -> ShownSide:
        """Who was shown on the left."""
        return self.sides[0]

    @property
    def right(self) -> ShownSide:
        """Who was shown on the right."""
        return self.sides[1]


@dataclass(frozen=True, slots=True, kw_only=True)
class SingleVote:
    """A vote as a rating saw it.

    Attributes:
        judge: The pseudonym as the rating kept it.
        mark: Why it does not count, or that it does.
        before, after: The votes that it changed, and by which it was changed until the rating.
        reports: What the expert reported about the pair.
    """

    vote: Vote
    judge: str
    mark: str
    before: Vote | None
    after: Vote | None
    reports: tuple[Report, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Neighbours:
    """Where a vote stands among those looked for, from 1; `place` is None where it is none."""

    before: UUID | None = None
    after: UUID | None = None
    place: int | None = None
    total: int


# --- Lists of votes ----------------------------------------------------------------------------


def vote_page(snapshot: Snapshot, search: VoteSearch, number: int) -> Page[ListedVote]:
    """One page with the numbers beside its pictures; beyond the last is the last."""
    return Paginator(_Found(snapshot, search), PER_PAGE).get_page(number)


def each_vote(snapshot: Snapshot, search: VoteSearch) -> Iterator[ListedVote]:
    """All that are looked for, in the order of their pages."""
    return iter(_Found(snapshot, search))


def neighbours(snapshot: Snapshot, search: VoteSearch, vote: Vote) -> Neighbours:
    """The votes before and after one among those that are looked for."""
    keys = [pk for pk, _ in _Found(snapshot, search).keys]
    if vote.pk not in keys:
        return Neighbours(total=len(keys))
    place = keys.index(vote.pk)
    beside = {"before": keys[max(place - 1, 0) : place], "after": keys[place + 1 : place + 2]}
    codes = {
        name: Vote.objects.get(pk=found[0]).key if found else None
        for name, found in beside.items()
    }
    return Neighbours(**codes, place=place + 1, total=len(keys))


def vote_in(snapshot: Snapshot, code: UUID) -> SingleVote | None:
    """The vote of that code if it was given before the rating; six queries at most."""
    rows = find_votes(snapshot, VoteSearch(mark=EVERY)).filter(key=code)
    vote = (
        rows.select_related(
            "matchup__scenario",
            "expert__person",
            "supersedes",
            "shown_left__contestant",
            "shown_right__contestant",
        )
        .defer(
            "matchup__scenario__reference", "shown_left__modification", "shown_right__modification"
        )
        .first()
    )
    if vote is None:
        return None
    later = Vote.objects.filter(supersedes=vote, pk__lte=snapshot.last_vote or 0)
    return SingleVote(
        vote=vote,
        judge=_judge_of(vote, snapshot),
        mark=vote.mark,  # type: ignore[attr-defined]
        before=vote.supersedes,
        after=later.first(),
        reports=tuple(vote.matchup.reports.order_by("pk")),
    )


def count_settled(snapshot: Snapshot) -> int:
    """Return how many ties of pairs that nobody was shown count in a rating."""
    is_possible = snapshot.study.rules.get("identical") and not is_imported(snapshot.study)
    if not is_possible or Filters.of_document(snapshot.filters).leave_out_settled:
        return 0
    return snapshot.votes_counted - counted_votes(snapshot).count()


class _Found(Sequence[ListedVote]):
    """What is looked for: rows of the database, then the pairs that nobody can tell apart."""

    def __init__(self, snapshot: Snapshot, search: VoteSearch) -> None:
        self._snapshot, self._search = snapshot, search
        self._lines = find_lines(snapshot, search) if is_imported(snapshot.study) else None
        ties = _settled_ties(snapshot) if self._lines is None else []
        self._ties = [tie for tie in ties if is_found(tie, search)]

    def __len__(self) -> int:
        return self._stored + len(self._ties)

    @overload
    def __getitem__(self, place: int) -> ListedVote: ...

    @overload
    def __getitem__(self, place: slice) -> list[ListedVote]: ...

    def __getitem__(self, place: int | slice) -> ListedVote | list[ListedVote]:
        """The votes from one place up to another, from 0, with what is known of their pictures."""
        if isinstance(place, int):
            return self[place : place + 1][0]
        if self._lines is not None:
            return [_list_line(line) for line in self._lines[place]]
        listed = _list_votes(self.keys[place], self._snapshot, with_evidence=True)
        start, stop, _ = place.indices(len(self))
        ties = self._ties[max(start - self._stored, 0) : max(stop - self._stored, 0)]
        return listed + _list_ties(ties, self._snapshot)

    def __iter__(self) -> Iterator[ListedVote]:
        """All of them; what is found is found once, whatever its number."""
        if self._lines is not None:
            yield from map(_list_line, self._lines.iterator(CHUNK))
            return
        for start in range(0, self._stored, CHUNK):
            yield from _list_votes(self.keys[start : start + CHUNK], self._snapshot)
        yield from _list_ties(self._ties, self._snapshot)

    @cached_property
    def keys(self) -> list[tuple[int, str]]:
        """Every vote that is looked for, with its mark; a rating's votes never change."""
        if self._lines is not None:
            return []
        if self._search.order == "faults":  # labels are given later
            return sort_votes(self._snapshot, self._search)
        key = (*rating_key(self._snapshot), self._search)
        return _FOUND.get(key, lambda: sort_votes(self._snapshot, self._search))

    @cached_property
    def _stored(self) -> int:
        return len(self.keys) if self._lines is None else self._lines.count()


def _list_votes(
    marks: Sequence[tuple[int, str]], snapshot: Snapshot, *, with_evidence: bool = False
) -> list[ListedVote]:
    """The rows of these keys with their marks, in their order; two more queries with evidence."""
    related = (
        *("matchup__scenario", "expert__person"),
        *("shown_left__contestant", "shown_right__contestant"),
    )
    unread = (
        *("matchup__view", "matchup__descriptions", "matchup__scenario__reference"),
        *("matchup__scenario__intent", "shown_left__modification", "shown_right__modification"),
    )
    rows = Vote.objects.select_related(*related).defer(*unread)
    votes = rows.in_bulk([pk for pk, _ in marks])
    evidence, faults = Evidence(pictures={}, pairs={}), {}
    if with_evidence:
        evidence = read_evidence(snapshot)
        shown = {pk for vote in votes.values() for pk in (vote.shown_left_id, vote.shown_right_id)}
        faults = read_faults(shown)
    return [_list_vote(votes[pk], mark, snapshot, evidence, faults) for pk, mark in marks]


def _list_vote(
    vote: Vote, mark: str, snapshot: Snapshot, evidence: Evidence, faults: Mapping[int, Faults]
) -> ListedVote:
    matchup, scenario = vote.matchup, vote.matchup.scenario
    has_samples = snapshot.study.shows_all_samples

    def side(place: str, shown: Augmentation) -> ShownSide:
        who, sample = shown.contestant, shown.sample if has_samples else 0
        return ShownSide(
            place=place,
            won=vote.outcome == place,
            slug=who.slug,
            name=who.name,
            is_simulated=who.is_simulated,
            augmentation=shown.code,
            sample=sample,
            score=evidence.pictures.get(PictureKey(scenario.pk, sample, who.pk)),
            faults=faults.get(shown.pk),
        )

    left, right = side("left", vote.shown_left), side("right", vote.shown_right)
    contestants = vote.shown_left.contestant_id, vote.shown_right.contestant_id
    return ListedVote(
        code=vote.key,
        at=vote.at,
        judge=_judge_of(vote, snapshot),
        scenario=scenario.slug,
        scenario_code=scenario.code,
        instruction=scenario.instruction,
        type=scenario.type,
        kind=matchup.kind,
        matchup=matchup.code,
        position=matchup.position,
        sides=(left, right),
        outcome=vote.outcome,
        both_miss=vote.both_miss,
        reason=vote.reason,
        ms_visible=vote.ms_visible,
        aids=vote.aids,
        comment=vote.comment,
        is_simulated=vote.is_simulated,
        mark=mark,
        pair=evidence.pairs.get(pair_key(scenario.pk, right.sample, contestants)),
    )


def _list_ties(ties: Sequence[Judged], snapshot: Snapshot) -> list[ListedVote]:
    """Pairs that nobody was shown; one query where there are any."""
    names = dict(snapshot.standings.values_list("slug", "name")) if ties else {}
    return [
        ListedVote(
            scenario=tie.item,
            type=tie.type,
            kind=AUTOMATIC,
            outcome=tie.outcome,
            mark=tie.mark,
            sides=(_name_side("left", tie.left, names), _name_side("right", tie.right, names)),
        )
        for tie in ties
    ]


def _list_line(line: ImportedVote) -> ListedVote:
    outcome = IMPORTED_OUTCOMES[line.outcome]
    return ListedVote(
        line=line.line,
        judge=line.judge,
        scenario=line.item,
        kind=IMPORTED,
        sides=(
            _name_side("left", line.first, won=outcome == "left"),
            _name_side("right", line.second, won=outcome == "right"),
        ),
        outcome=outcome,
        both_miss=line.outcome == ImportedVote.Outcome.BOTH_BAD,
        mark=line.mark,  # type: ignore[attr-defined]
    )


def _name_side(
    place: str, slug: str, names: Mapping[str, str] | None = None, *, won: bool = False
) -> ShownSide:
    return ShownSide(place=place, won=won, slug=slug, name=(names or {}).get(slug, slug))


def _judge_of(vote: Vote, snapshot: Snapshot) -> str:
    person = vote.expert.person
    return snapshot.results.judges.get(str(person.code), person.pseudonym)


# --- Private -----------------------------------------------------------------------------------

_FOUND: Remembered[list[tuple[int, str]]] = Remembered(3)
_TIES: Remembered[list[Judged]] = Remembered(3)


def _settled_ties(snapshot: Snapshot) -> list[Judged]:
    """The ties on pairs that nobody was shown, as the rating's votes give them."""
    study, filters = snapshot.study, Filters.of_document(snapshot.filters)
    if not study.rules.get("identical"):
        return []

    def read() -> list[Judged]:
        return settled_ties(study, current_votes(study, filters, snapshot.last_vote), filters)

    return _TIES.get(rating_key(snapshot), read)
