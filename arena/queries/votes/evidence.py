"""What experts made of the pictures of a rating: votes on each, disagreement, fault labels.

Everything is counted over the votes of the rating; a picture is that of a showing, as it was then.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from django.db.models import Count, F, Max, Q, QuerySet, Value

from arena.models import FaultLabel, Matchup, Snapshot, Vote
from arena.queries.remembering import Remembered, plan_types
from arena.queries.votes.search import SoughtOrder, VoteSearch
from arena.queries.votes.sets import counted_votes
from augment.models import Contestant


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
