"""A vote as a list of votes shows it, wherever it comes from."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import NamedTuple
from uuid import UUID

from django.db.models import Q, QuerySet

from arena.models import ImportedVote, Snapshot, Vote
from arena.pairing.order import MAIN
from arena.queries.votes.evidence import (
    Evidence,
    Faults,
    PairKey,
    PictureKey,
    VoteScore,
    read_faults,
)
from arena.queries.votes.judged import AUTOMATIC, IMPORTED, Judged
from arena.queries.votes.search import COUNTED, EVERY, LEFT_OUT, SoughtOutcome, VoteSearch
from arena.queries.votes.sets import Filters, LeftOut
from augment.models import Augmentation


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
