"""The votes behind a number of a rating, with their pictures: pages of them, all, or a single one.

In: a snapshot and what is looked for. Out: votes with the mark that says why one does not count.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any
from uuid import UUID

from django.core.paginator import Page, Paginator

from arena.models import ImportedVote, Report, Snapshot, Vote
from arena.results.queries.scores import (
    Evidence,
    Pair,
    Picture,
    VoteScore,
    read_evidence,
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
    left: ShownSide
    right: ShownSide
    outcome: str
    both_miss: bool = False
    strength: str = ""
    reason: str = ""
    ms_visible: int | None = None
    aids: str = ""
    comment: str = ""
    is_simulated: bool = False
    mark: str
    pair: VoteScore | None = None

    @property
    def sides(self) -> tuple[ShownSide, ShownSide]:
        """Left and right."""
        return self.left, self.right


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


def vote_page(snapshot: Snapshot, search: VoteSearch, number: int) -> Page[Any]:
    """One page of listed votes with the numbers beside their pictures; the last beyond it."""
    imported = is_imported(snapshot.study)
    found: Any = find_lines(snapshot, search) if imported else _find_all(snapshot, search)
    page: Page[Any] = Paginator(found, PER_PAGE).get_page(number)
    shown = list(page.object_list)
    page.object_list = (
        [_list_line(line) for line in shown]
        if imported
        else _list_votes(shown, snapshot, read_evidence(snapshot))
    )
    return page


def each_vote(snapshot: Snapshot, search: VoteSearch) -> Iterator[ListedVote]:
    """All that are looked for, in the order of their pages."""
    if is_imported(snapshot.study):
        yield from map(_list_line, find_lines(snapshot, search).iterator(CHUNK))
        return
    found = _find_all(snapshot, search)
    for start in range(0, len(found), CHUNK):
        yield from _list_votes(found[start : start + CHUNK], snapshot, Evidence({}, {}))


def neighbours(snapshot: Snapshot, search: VoteSearch, vote: Vote) -> Neighbours:
    """The votes before and after one among those that are looked for."""
    keys = [pk for pk, _ in sort_votes(snapshot, search)]
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
    related = rows.select_related(
        *("matchup__scenario", "expert__person", "supersedes"),
        *("shown_left__contestant", "shown_right__contestant"),
    )
    vote = related.defer(
        "matchup__scenario__reference", "shown_left__modification", "shown_right__modification"
    ).first()
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


# --- Private -----------------------------------------------------------------------------------


def _find_all(snapshot: Snapshot, search: VoteSearch) -> list[tuple[int, str] | Judged]:
    """Keys and marks of the rows, then the ties on pairs that nobody was shown."""
    study, filters = snapshot.study, Filters.of_document(snapshot.filters)
    ties: list[Judged] = []
    if study.rules.get("identical"):
        votes = current_votes(study, filters, snapshot.last_vote)
        ties = [tie for tie in settled_ties(study, votes, filters) if is_found(tie, search)]
    return [*sort_votes(snapshot, search), *ties]


def _list_votes(
    found: Sequence[tuple[int, str] | Judged], snapshot: Snapshot, evidence: Evidence
) -> list[ListedVote]:
    """Votes in their order; two queries."""
    related = (
        *("matchup__scenario", "expert__person"),
        *("shown_left__contestant", "shown_right__contestant"),
    )
    unread = (
        *("matchup__view", "matchup__descriptions", "matchup__scenario__reference"),
        *("matchup__scenario__intent", "shown_left__modification", "shown_right__modification"),
    )
    ties = [one for one in found if isinstance(one, Judged)]
    keys = [one for one in found if not isinstance(one, Judged)]
    rows = Vote.objects.select_related(*related).defer(*unread).in_bulk([pk for pk, _ in keys])
    names = dict(snapshot.standings.values_list("slug", "name")) if ties else {}
    return [
        *(_list_vote(rows[pk], mark, snapshot, evidence) for pk, mark in keys),
        *(_list_tie(tie, names) for tie in ties),
    ]


def _list_vote(vote: Vote, mark: str, snapshot: Snapshot, evidence: Evidence) -> ListedVote:
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
            score=evidence.pictures.get(Picture(scenario.pk, sample, who.pk)),
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
        left=left,
        right=right,
        outcome=vote.outcome,
        both_miss=vote.both_miss,
        strength=vote.strength,
        reason=vote.reason,
        ms_visible=vote.ms_visible,
        aids=vote.aids,
        comment=vote.comment,
        is_simulated=vote.is_simulated,
        mark=mark,
        pair=evidence.pairs.get(Pair.of(scenario.pk, right.sample, *contestants)),
    )


def _list_tie(tie: Judged, names: Mapping[str, str]) -> ListedVote:
    """A pair that nobody was shown."""
    return ListedVote(
        scenario=tie.item,
        type=tie.type,
        kind=AUTOMATIC,
        left=ShownSide(place="left", won=False, slug=tie.left, name=names[tie.left]),
        right=ShownSide(place="right", won=False, slug=tie.right, name=names[tie.right]),
        outcome=tie.outcome,
        mark=tie.mark,
    )


def _list_line(line: ImportedVote) -> ListedVote:
    outcome, first, second = IMPORTED_OUTCOMES[line.outcome], line.first, line.second
    return ListedVote(
        line=line.line,
        judge=line.judge,
        scenario=line.item,
        kind=IMPORTED,
        left=ShownSide(place="left", won=outcome == "left", slug=first, name=first),
        right=ShownSide(place="right", won=outcome == "right", slug=second, name=second),
        outcome=outcome,
        both_miss=line.outcome == ImportedVote.Outcome.BOTH_BAD,
        mark=line.mark,  # type: ignore[attr-defined]
    )


def _judge_of(vote: Vote, snapshot: Snapshot) -> str:
    person = vote.expert.person
    return snapshot.results.judges.get(str(person.code), person.pseudonym)
