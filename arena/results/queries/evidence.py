"""What experts made of the pictures of a rating: votes on each, disagreement, fault labels.

Everything is counted over the votes of the rating; a picture is that of a showing, as it was then.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from typing import NamedTuple, overload
from uuid import UUID

from django.core.paginator import Page, Paginator
from django.db.models import Count, F, Max, Q, QuerySet, Value

from arena.models import FaultLabel, ImportedVote, Matchup, Report, Snapshot, Vote
from arena.pairing.order import MAIN
from arena.queries.remembering import Remembered, plan_types
from arena.results.queries.search import (
    AUTOMATIC_TIE,
    COUNTED,
    EVERY,
    LEFT_OUT,
    SoughtOrder,
    SoughtOutcome,
    SoughtPart,
    VoteSearch,
    find_part,
)
from arena.results.queries.votes import (
    AUTOMATIC,
    IMPORTED,
    Filters,
    Judged,
    LeftOut,
    counted_votes,
    is_imported,
    made_up_contestants,
    marked_votes,
    settled_ties,
    users_of,
    votes_up_to,
    why_left_out,
)
from augment.models import Augmentation, Contestant


@dataclass(frozen=True, slots=True, kw_only=True)
class VoteScore:
    """Votes of one contestant, as it is seen from it."""

    wins: int = 0
    ties: int = 0
    losses: int = 0

    @property
    def votes(self) -> int:
        """All of them."""
        return self.wins + self.ties + self.losses

    @property
    def lost_share(self) -> float:
        """The mean score that went to the others, a tie half; 0 without votes."""
        return (self.losses + self.ties / 2) / self.votes if self.votes else 0.0

    @property
    def disagreement(self) -> float:
        """The mean distance of two judgements: a win against a loss is 1, against a tie a half."""
        n = self.votes
        if n < 2:
            return 0.0
        far = self.wins * self.losses + (self.wins + self.losses) * self.ties / 2
        return far / (n * (n - 1) / 2)

    def plus(self, other: VoteScore) -> VoteScore:
        """Both together."""
        return VoteScore(
            wins=self.wins + other.wins,
            ties=self.ties + other.ties,
            losses=self.losses + other.losses,
        )


class Faults(NamedTuple):
    """How many experts looked for faults in a picture, and how many found some."""

    labels: int = 0
    faulty: int = 0


class PictureKey(NamedTuple):
    """A contestant's picture of a scenario; `sample` is 0 unless each is judged on its own."""

    scenario: int
    sample: int
    contestant: int


class PairKey(NamedTuple):
    """Two pictures of a scenario, the contestant of the lower key first."""

    scenario: int
    sample: int
    low: int
    high: int

    @classmethod
    def of(cls, scenario: int, sample: int, *contestants: int) -> PairKey:
        """The key of the pair, whoever was shown on the left."""
        return cls(scenario, sample, min(contestants), max(contestants))


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """The scores of a rating's pictures, and of its pairs as seen from the lower contestant."""

    pictures: Mapping[PictureKey, VoteScore]
    pairs: Mapping[PairKey, VoteScore]


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureShown:
    """A contestant's picture on a scenario, as a showing had it.

    Attributes:
        image: Its name in the storage.
    """

    contestant: Contestant
    image: str
    score: VoteScore


def read_evidence(snapshot: Snapshot) -> Evidence:
    """Count the votes of a rating by picture and by pair; two queries, one the next time."""
    key = (
        snapshot.code, snapshot.last_vote, json.dumps(snapshot.filters),
        plan_types(snapshot.study),
    )  # fmt: skip
    return _EVIDENCE.get(key, lambda: _count_evidence(snapshot))


def read_faults(augmentations: Collection[int]) -> dict[int, Faults]:
    """Return the fault labels of those pictures that have some; one query."""
    fault = Q(position=True) | Q(heading=True) | Q(logic=True)
    rows = FaultLabel.objects.filter(augmentation__in=augmentations).order_by()
    counted = rows.values_list("augmentation").annotate(
        labels=Count("pk"), faulty=Count("pk", filter=fault)
    )
    return {pk: Faults(labels, faulty) for pk, labels, faulty in counted}


def sort_votes(
    rows: QuerySet[Vote], snapshot: Snapshot, search: VoteSearch
) -> list[tuple[int, str]]:
    """Return keys and marks of votes in the order that the search asks for."""
    if not search.order:
        return list(rows.order_by("pk").values_list("pk", F("mark")))
    votes = [_Sortable(*row) for row in rows.values_list(*_sort_columns(snapshot))]
    sort_key = _sort_key(votes, snapshot, search)
    return [(vote.pk, vote.mark) for vote in sorted(votes, key=sort_key)]


def sheet_rows(snapshot: Snapshot, scenarios: Sequence[int]) -> dict[int, dict[str, PictureShown]]:
    """The pictures of these scenarios by contestant's slug; two queries."""
    scores: defaultdict[tuple[int, int], VoteScore] = defaultdict(VoteScore)
    shown: dict[tuple[int, int], int] = {}
    for count in _counts(snapshot, scenarios=scenarios):
        for contestant in (count.left, count.right):
            key = (count.scenario, contestant)
            scores[key] = scores[key].plus(_score_of(count, contestant))
            shown[key] = max(shown.get(key, 0), count.matchup)
    rows = _matchups(shown.values())
    sheet: dict[int, dict[str, PictureShown]] = {place: {} for place in scenarios}
    for (place, contestant), pk in shown.items():
        picture = _picture(rows[pk], contestant, scores[place, contestant])
        sheet[place][picture.contestant.slug] = picture
    return sheet


# --- Private -----------------------------------------------------------------------------------

_EVIDENCE: Remembered[Evidence] = Remembered(3)


class _Count(NamedTuple):
    """So many votes of one outcome on two contestants of a scenario, and one of the showings.

    Attributes:
        sample: Which one both showed where every sample is judged on its own, else 0.
    """

    scenario: int
    sample: int
    left: int
    right: int
    outcome: str
    number: int
    matchup: int


class _Sortable(NamedTuple):
    """What of a vote says its place among others."""

    pk: int
    mark: str
    slug: str
    scenario: int
    sample: int
    left: int
    right: int
    left_picture: int
    right_picture: int

    @property
    def pair(self) -> PairKey:
        return PairKey.of(self.scenario, self.sample, self.left, self.right)

    def pictures(self, only: int | None) -> list[tuple[PictureKey, int]]:
        """Both pictures with their rows, or the one of a contestant."""
        both = (self.left, self.left_picture), (self.right, self.right_picture)
        return [
            (PictureKey(self.scenario, self.sample, contestant), row)
            for contestant, row in both
            if only in (None, contestant)
        ]


_Key = Callable[[_Sortable], tuple[object, ...]]


def _count_evidence(snapshot: Snapshot) -> Evidence:
    pictures: defaultdict[PictureKey, VoteScore] = defaultdict(VoteScore)
    pairs: defaultdict[PairKey, VoteScore] = defaultdict(VoteScore)
    for count in _counts(snapshot):
        pair = PairKey.of(count.scenario, count.sample, count.left, count.right)
        pairs[pair] = pairs[pair].plus(_score_of(count, pair.low))
        for contestant in (count.left, count.right):
            picture = PictureKey(count.scenario, count.sample, contestant)
            pictures[picture] = pictures[picture].plus(_score_of(count, contestant))
    return Evidence(pictures=dict(pictures), pairs=dict(pairs))


def _sample_of(snapshot: Snapshot) -> F | Value:
    return F("matchup__right__sample") if snapshot.study.shows_all_samples else Value(0)


def _sort_columns(snapshot: Snapshot) -> tuple[str | F | Value, ...]:
    return (
        *("pk", F("mark"), "matchup__scenario__slug", "matchup__scenario", _sample_of(snapshot)),
        *("shown_left__contestant", "shown_right__contestant", "shown_left", "shown_right"),
    )


def _sort_key(votes: Sequence[_Sortable], snapshot: Snapshot, search: VoteSearch) -> _Key:
    evidence = read_evidence(snapshot)
    if search.order == SoughtOrder.SCENARIO:
        return lambda vote: (vote.slug, vote.pair, vote.pk)
    if search.order == SoughtOrder.DISPUTED:
        return lambda vote: _by_disagreement(vote, evidence.pairs.get(vote.pair, VoteScore()))
    wanted = Contestant.objects.filter(slug=search.contestant).values_list("pk", flat=True)
    only = wanted.first() if search.contestant else None
    faults: Mapping[int, Faults] = {}
    if is_by_faults := search.order == SoughtOrder.FAULTS:
        faults = read_faults({row for vote in votes for _, row in vote.pictures(only)})

    def worst_picture(vote: _Sortable) -> tuple[object, ...]:
        both = (
            (_by_faults(faults.get(row)) if is_by_faults else _by_losses(evidence, key), key)
            for key, row in vote.pictures(only)
        )
        return (*min(both), vote.pk)

    return worst_picture


def _by_disagreement(vote: _Sortable, score: VoteScore) -> tuple[object, ...]:
    return (-score.disagreement, -score.votes, vote.slug, vote.pair, vote.pk)


def _by_losses(evidence: Evidence, key: PictureKey) -> tuple[float, float]:
    score = evidence.pictures.get(key)
    return (-score.lost_share, -score.votes) if score else (1.0, 0.0)


def _by_faults(found: Faults | None) -> tuple[float, float]:
    return (-found.faulty / found.labels, -found.labels) if found else (1.0, 0.0)


def _counts(snapshot: Snapshot, *, scenarios: Sequence[int] | None = None) -> Iterable[_Count]:
    rows = counted_votes(snapshot)
    if scenarios is not None:
        rows = rows.filter(matchup__scenario__in=scenarios)
    grouped = rows.values_list(
        *("matchup__scenario", _sample_of(snapshot)),
        *("shown_left__contestant", "shown_right__contestant", "outcome"),
    ).annotate(number=Count("pk"), shown=Max("matchup"))
    return (_Count(*row) for row in grouped)


def _score_of(count: _Count, contestant: int) -> VoteScore:
    if count.outcome == "equal":
        return VoteScore(ties=count.number)
    won = (count.outcome == "left") == (count.left == contestant)
    return VoteScore(wins=count.number) if won else VoteScore(losses=count.number)


def _matchups(keys: Iterable[int]) -> dict[int, Matchup]:
    rows = Matchup.objects.select_related("left__contestant", "right__contestant")
    unread = ("left__modification", "right__modification", "descriptions")
    return rows.defer(*unread).in_bulk(list(set(keys)))


def _picture(row: Matchup, contestant: int, score: VoteScore) -> PictureShown:
    is_left = row.left.contestant_id == contestant
    augmentation = row.left if is_left else row.right
    kept = row.left_image if is_left else row.right_image
    return PictureShown(
        contestant=augmentation.contestant, image=kept or augmentation.image, score=score
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownSide:
    """Who was shown on a side.

    Attributes:
        augmentation: Its code, None where there is no picture.
        sample: Of the picture, 0 unless each is judged on its own.
        score: The picture's votes that count, None where the list does not show them.
    """

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
        outcome: left, equal, right or skip.
        reason: Why it was skipped.
        mark: Why it does not count, or that it does.
        pair: The votes on both pictures that count, as one of the two sees them.
    """

    code: UUID | None
    line: int | None = None
    at: datetime | None = None
    judge: str
    scenario: str
    scenario_code: UUID | None = None
    instruction: str = ""
    type: str = ""
    kind: str
    matchup: UUID | None = None
    position: int | None = None
    left: ShownSide
    right: ShownSide
    outcome: str
    both_miss: bool
    reason: str = ""
    ms_visible: int | None = None
    aids: str = ""
    comment: str = ""
    is_simulated: bool = False
    mark: str
    pair: VoteScore | None = None

    @property
    def sides(self) -> tuple[ShownHere, ShownHere]:
        """Left and right, as a template walks through them."""
        left, right = (
            ShownHere(name=name, shown=shown, won=self.outcome == name)
            for name, shown in (("left", self.left), ("right", self.right))
        )
        return left, right


class ShownHere(NamedTuple):
    """A side by its name."""

    name: str
    shown: ShownSide
    won: bool


def of_votes(
    marks: Sequence[tuple[int, str]], snapshot: Snapshot, evidence: Evidence | None = None
) -> list[ListedVote]:
    """The rows of these keys with their marks, in their order; one query.

    Args:
        marks: Key and mark of each.
        snapshot: Whose votes they are.
        evidence: Adds what is known of the pictures; another query.
    """
    rows = (
        Vote.objects.filter(pk__in=[pk for pk, _ in marks])
        .select_related(
            "matchup__scenario", "expert__person", "shown_left__contestant",
            "shown_right__contestant",
        )
        .only(
            "key", "at", "outcome", "both_miss", "reason", "ms_visible", "aids", "comment",
            "is_simulated", "matchup__code", "matchup__kind", "matchup__position",
            "matchup__scenario__slug", "matchup__scenario__type", "matchup__scenario__code",
            "matchup__scenario__instruction", "shown_left__sample", "shown_right__sample",
            "shown_left__contestant__kind", "shown_right__contestant__kind",
            "expert__person__code", "expert__person__pseudonym", "shown_left__code",
            "shown_right__code", "shown_left__contestant__slug", "shown_left__contestant__name",
            "shown_right__contestant__slug", "shown_right__contestant__name",
        )
    )  # fmt: skip
    found = {row.pk: row for row in rows}
    known = _Known(snapshot, evidence, found.values())
    return [_of_vote(found[pk], mark, known) for pk, mark in marks]


def of_automatic(lines: Iterable[tuple[Judged, str]], snapshot: Snapshot) -> list[ListedVote]:
    """Pairs that nobody was shown, with their marks; one query where there are any."""
    listed = list(lines)
    names = dict(snapshot.standings.values_list("slug", "name")) if listed else {}
    return [
        ListedVote(
            code=None, judge="", scenario=line.item, type=line.type, kind=AUTOMATIC,
            left=ShownSide(slug=line.left, name=names.get(line.left, line.left)),
            right=ShownSide(slug=line.right, name=names.get(line.right, line.right)),
            outcome=line.outcome, both_miss=False, mark=mark,
        )
        for line, mark in listed
    ]  # fmt: skip


def of_imported(rows: Iterable[ImportedVote], snapshot: Snapshot) -> list[ListedVote]:
    """Lines of a file; one query."""
    filters = Filters.of_document(snapshot.filters)
    return [
        ListedVote(
            code=None, line=row.line, judge=row.judge, scenario=row.item, kind=IMPORTED,
            left=ShownSide(slug=row.first, name=row.first),
            right=ShownSide(slug=row.second, name=row.second),
            outcome=_OUTCOMES[row.outcome], both_miss=row.outcome == _FILE.BOTH_BAD.value,
            mark=_mark_of_line(row, filters),
        )
        for row in rows
    ]  # fmt: skip


def imported_votes(snapshot: Snapshot, search: VoteSearch) -> QuerySet[ImportedVote]:
    """The lines of a study's file that are looked for, in their order.

    A file has no types, times, comments and skips, so nothing is found by these.
    """
    rows = ImportedVote.objects.filter(
        file__study=snapshot.study_id, pk__lte=snapshot.last_vote or 0
    )
    rows = _by_mark(rows, Filters.of_document(snapshot.filters), search.mark)
    if search.type or search.part or search.comment:
        return rows.none()
    if search.expert:
        rows = rows.filter(judge=search.expert)
    if search.scenario:
        rows = rows.filter(item=search.scenario)
    return rows.filter(_shows(search), _came_out(search)).order_by("line")


# --- Private -----------------------------------------------------------------------------------

_FILE = ImportedVote.Outcome
_OUTCOMES = {
    _FILE.FIRST.value: "left",
    _FILE.SECOND.value: "right",
    _FILE.TIE.value: "equal",
    _FILE.BOTH_BAD.value: "equal",
}


class _Known:
    """What a rating knows of the votes and pictures that are listed."""

    def __init__(
        self, snapshot: Snapshot, evidence: Evidence | None, rows: Collection[Vote]
    ) -> None:
        self.judges = snapshot.results.judges
        self._evidence, self._has_samples = evidence, snapshot.study.shows_all_samples
        shown = {pk for row in rows for pk in (row.shown_left_id, row.shown_right_id)}
        self._faults = read_faults(shown) if evidence else {}

    def pair(self, row: Vote) -> VoteScore | None:
        left, right = row.shown_left, row.shown_right
        key = PairKey.of(
            row.matchup.scenario_id, self._sample(right), left.contestant_id, right.contestant_id
        )
        return self._evidence.pairs.get(key) if self._evidence else None

    def side(self, row: Vote, shown: Augmentation) -> ShownSide:
        contestant, sample = shown.contestant, self._sample(shown)
        key = PictureKey(row.matchup.scenario_id, sample, contestant.pk)
        return ShownSide(
            slug=contestant.slug,
            name=contestant.name,
            is_simulated=contestant.is_simulated,
            augmentation=shown.code,
            sample=sample,
            score=self._evidence.pictures.get(key) if self._evidence else None,
            faults=self._faults.get(shown.pk),
        )

    def _sample(self, shown: Augmentation) -> int:
        return shown.sample if self._has_samples else 0


def _of_vote(row: Vote, mark: str, known: _Known) -> ListedVote:
    matchup, person = row.matchup, row.expert.person
    return ListedVote(
        code=row.key,
        at=row.at,
        judge=known.judges.get(str(person.code), person.pseudonym),
        scenario=matchup.scenario.slug,
        scenario_code=matchup.scenario.code,
        instruction=matchup.scenario.instruction,
        type=matchup.scenario.type,
        kind=matchup.kind,
        matchup=matchup.code,
        position=matchup.position,
        left=known.side(row, row.shown_left),
        right=known.side(row, row.shown_right),
        outcome=row.outcome,
        both_miss=row.both_miss,
        reason=row.reason,
        ms_visible=row.ms_visible,
        aids=row.aids,
        comment=row.comment,
        is_simulated=row.is_simulated,
        mark=mark,
        pair=known.pair(row),
    )


def _mark_of_line(row: ImportedVote, filters: Filters) -> str:
    judged = not filters.experts or row.judge in filters.experts
    is_asked_for = judged and not filters.types and MAIN in filters.kinds
    return COUNTED if is_asked_for else LeftOut.FILTERED.value


def _by_mark(rows: QuerySet[ImportedVote], filters: Filters, mark: str) -> QuerySet[ImportedVote]:
    nothing = bool(filters.types) or MAIN not in filters.kinds
    asked_for = Q(pk=None) if nothing else Q()
    if filters.experts:
        asked_for &= Q(judge__in=filters.experts)
    if mark == EVERY:
        return rows
    if mark == COUNTED:
        return rows.filter(asked_for)
    if mark in (LEFT_OUT, LeftOut.FILTERED) and asked_for:
        return rows.exclude(asked_for)
    return rows.none()


def _shows(search: VoteSearch) -> Q:
    pairs = (search.contestant, search.opponent), (search.opponent, search.contestant)
    found = Q(pk=None)
    for first, second in pairs:
        found |= (Q(first=first) if first else Q()) & (Q(second=second) if second else Q())
    return found if search.contestant or search.opponent else Q()


def _came_out(search: VoteSearch) -> Q:
    first, second = _FILE.FIRST.value, _FILE.SECOND.value
    ties = [_FILE.TIE.value, _FILE.BOTH_BAD.value]
    own, other = Q(first=search.contestant), Q(second=search.contestant)
    return {
        "": Q(),
        SoughtOutcome.WON: (own & Q(outcome=first)) | (other & Q(outcome=second)),
        SoughtOutcome.LOST: (own & Q(outcome=second)) | (other & Q(outcome=first)),
        SoughtOutcome.TIED: Q(outcome__in=ties),
        SoughtOutcome.EQUAL: Q(outcome__in=ties),
        SoughtOutcome.LEFT: Q(outcome=first),
        SoughtOutcome.RIGHT: Q(outcome=second),
        SoughtOutcome.DECIDED: Q(outcome__in=[first, second]),
        SoughtOutcome.BOTH_MISS: Q(outcome=_FILE.BOTH_BAD.value),
        SoughtOutcome.SKIP: Q(pk=None),
    }[search.outcome]


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
    rows = rows.filter(_shows_lists(search), _came_out_lists(search))
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


def _shows_lists(search: VoteSearch) -> Q:
    first, second = search.contestant, search.opponent
    if not first and not second:
        return Q()
    return (_side("left", first) & _side("right", second)) | (
        _side("right", first) & _side("left", second)
    )


def _came_out_lists(search: VoteSearch) -> Q:
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


def vote_in(snapshot: Snapshot, code: UUID) -> SingleVote | None:
    """The vote of that code if it was given before the rating; six queries at most."""
    rows = votes_behind(snapshot, VoteSearch(mark=EVERY)).filter(key=code)
    vote = (
        rows.select_related(
            "matchup__scenario", "expert__person", "supersedes", "shown_left__contestant",
            "shown_right__contestant",
        )
        .defer(
            "matchup__scenario__reference", "shown_left__modification",
            "shown_right__modification",
        )
        .first()
    )  # fmt: skip
    if vote is None:
        return None
    (mark,) = rows.values_list(F("mark"), flat=True)
    person = vote.expert.person
    later = Vote.objects.filter(supersedes=vote, pk__lte=snapshot.last_vote or 0)
    return SingleVote(
        vote=vote,
        judge=snapshot.results.judges.get(str(person.code), person.pseudonym),
        mark=mark,
        before=vote.supersedes,
        after=later.first(),
        reports=tuple(vote.matchup.reports.order_by("pk")),
    )
