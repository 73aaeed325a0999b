"""What the votes of a rating say of its pictures: scores, disagreement, fault labels, orders."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from django.db.models import Count, F, Max, Q, QuerySet, Value

from arena.models import FaultLabel, Matchup, Snapshot, Vote
from arena.results.queries.search import VoteSearch, find_votes
from arena.results.queries.votes import counted_votes
from arena.voting.queries.remembering import Remembered, plan_types
from augment.models import Contestant


@dataclass(frozen=True, slots=True, kw_only=True)
class VoteScore:
    """Votes of one contestant, as it is seen from it."""

    wins: int = 0
    ties: int = 0
    losses: int = 0

    def __add__(self, other: VoteScore) -> VoteScore:
        """Both together."""
        return VoteScore(
            wins=self.wins + other.wins,
            ties=self.ties + other.ties,
            losses=self.losses + other.losses,
        )

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """The scores of a rating's pictures, and of its pairs as seen from the lower contestant."""

    pictures: Mapping[PictureKey, VoteScore]
    pairs: Mapping[PairKey, VoteScore]


class PictureShown(NamedTuple):
    """A contestant's picture as a showing had it, by its name in the storage."""

    image: str
    score: VoteScore


def read_evidence(snapshot: Snapshot) -> Evidence:
    """Count the votes of a rating by picture and by pair; two queries, one the next time."""
    return _EVIDENCE.get(rating_key(snapshot), lambda: _count_evidence(snapshot))


def read_faults(augmentations: Collection[int]) -> dict[int, Faults]:
    """Return the fault labels of those pictures that have some; one query."""
    fault = Q(position=True) | Q(heading=True) | Q(logic=True)
    rows = FaultLabel.objects.filter(augmentation__in=augmentations).order_by()
    counted = rows.values_list("augmentation").annotate(
        labels=Count("pk"), faulty=Count("pk", filter=fault)
    )
    return {pk: Faults(labels, faulty) for pk, labels, faulty in counted}


def pictures_by_scenario(
    snapshot: Snapshot, scenarios: Sequence[int]
) -> dict[int, dict[str, PictureShown]]:
    """The pictures on these scenarios by contestant's slug, as last shown; two queries."""
    scores: defaultdict[tuple[int, int], VoteScore] = defaultdict(VoteScore)
    shown: defaultdict[tuple[int, int], int] = defaultdict(int)
    rows = counted_votes(snapshot).filter(matchup__scenario__in=scenarios)
    for count in _count_votes(rows, snapshot):
        for contestant in (count.left, count.right):
            key = (count.scenario, contestant)
            scores[key] += count.score_of(contestant)
            shown[key] = max(shown[key], count.matchup)
    related = Matchup.objects.select_related("left__contestant", "right__contestant")
    unread = ("left__modification", "right__modification", "descriptions")
    matchups = related.defer(*unread).in_bulk(list(set(shown.values())))
    pictures: dict[int, dict[str, PictureShown]] = {scenario: {} for scenario in scenarios}
    for (scenario, contestant), pk in shown.items():
        row = matchups[pk]
        is_left = row.left.contestant_id == contestant
        augmentation = row.left if is_left else row.right
        image = (row.left_image if is_left else row.right_image) or augmentation.image
        score = scores[scenario, contestant]
        pictures[scenario][augmentation.contestant.slug] = PictureShown(image, score)
    return pictures


def rating_key(snapshot: Snapshot) -> tuple[Any, ...]:
    """What the votes of a rating and their types are known by; one query."""
    filters = json.dumps(snapshot.filters)
    return snapshot.code, snapshot.last_vote, filters, plan_types(snapshot.study)


def sort_votes(snapshot: Snapshot, search: VoteSearch) -> list[tuple[int, str]]:
    """Return keys and marks of the votes looked for, in the order that the search asks for."""
    rows = find_votes(snapshot, search)
    if not search.order:
        return list(rows.order_by("pk").values_list("pk", F("mark")))
    columns = rows.values_list(
        *("pk", F("mark"), "matchup__scenario__slug", "matchup__scenario", _sample_of(snapshot)),
        *("shown_left__contestant", "shown_right__contestant", "shown_left", "shown_right"),
    )
    votes = list(map(_Sortable._make, columns))
    return [(vote.pk, vote.mark) for vote in sorted(votes, key=_sort_key(votes, snapshot, search))]


# --- Private -----------------------------------------------------------------------------------

_EVIDENCE: Remembered[Evidence] = Remembered(3)


class _Count(NamedTuple):
    """So many votes of one outcome on two contestants of a scenario, and the latest showing."""

    scenario: int
    sample: int
    left: int
    right: int
    outcome: str
    number: int
    matchup: int

    def score_of(self, contestant: int) -> VoteScore:
        """The votes as one of the two sees them."""
        if self.outcome == "equal":
            return VoteScore(ties=self.number)
        won = (self.outcome == "left") == (self.left == contestant)
        return VoteScore(wins=self.number) if won else VoteScore(losses=self.number)


def _count_votes(rows: QuerySet[Vote], snapshot: Snapshot) -> Iterable[_Count]:
    grouped = rows.values_list(
        *("matchup__scenario", _sample_of(snapshot)),
        *("shown_left__contestant", "shown_right__contestant", "outcome"),
    )
    return map(_Count._make, grouped.annotate(number=Count("pk"), shown=Max("matchup")))


def _count_evidence(snapshot: Snapshot) -> Evidence:
    pictures: defaultdict[PictureKey, VoteScore] = defaultdict(VoteScore)
    pairs: defaultdict[PairKey, VoteScore] = defaultdict(VoteScore)
    for count in _count_votes(counted_votes(snapshot), snapshot):
        both = (count.left, count.right)
        pair = pair_key(count.scenario, count.sample, both)
        pairs[pair] += count.score_of(pair.low)
        for contestant in both:
            picture = PictureKey(count.scenario, count.sample, contestant)
            pictures[picture] += count.score_of(contestant)
    return Evidence(pictures=dict(pictures), pairs=dict(pairs))


def _sample_of(snapshot: Snapshot) -> F | Value:
    """Which sample both sides show where every one is judged on its own, else 0."""
    return F("matchup__right__sample") if snapshot.study.shows_all_samples else Value(0)


def pair_key(scenario: int, sample: int, contestants: tuple[int, int]) -> PairKey:
    """The key of a pair, whoever was shown on the left."""
    return PairKey(scenario, sample, min(contestants), max(contestants))


class _Sortable(NamedTuple):
    """What of a vote says its place among others."""

    pk: int
    mark: str
    slug: str
    scenario: int
    sample: int
    left: int
    right: int
    left_row: int
    right_row: int

    @property
    def pair(self) -> PairKey:
        return pair_key(self.scenario, self.sample, (self.left, self.right))


def _sort_key(
    votes: Sequence[_Sortable], snapshot: Snapshot, search: VoteSearch
) -> Callable[[_Sortable], tuple[Any, ...]]:
    if search.order == "scenario":
        return lambda vote: (vote.slug, vote.pair, vote.pk)
    evidence = read_evidence(snapshot)

    def by_disagreement(vote: _Sortable) -> tuple[Any, ...]:
        score = evidence.pairs.get(vote.pair, VoteScore())
        return (-score.disagreement, -score.votes, vote.slug, vote.pair, vote.pk)

    if search.order == "disputed":
        return by_disagreement
    wanted = Contestant.objects.filter(slug=search.contestant).values_list("pk", flat=True).first()
    faults: Mapping[int, Faults] = {}
    if search.order == "faults":
        faults = read_faults({row for vote in votes for row in (vote.left_row, vote.right_row)})

    def rank_picture(key: PictureKey, row: int) -> tuple[Any, ...]:
        if search.order == "faults":
            labels, faulty = faults.get(row, Faults())
            return (-faulty / labels, -labels, key) if labels else (1.0, 0, key)
        score = evidence.pictures.get(key)
        return (-score.lost_share, -score.votes, key) if score else (1.0, 0, key)

    def by_worst_picture(vote: _Sortable) -> tuple[Any, ...]:
        ranks = [
            rank_picture(PictureKey(vote.scenario, vote.sample, contestant), row)
            for contestant, row in ((vote.left, vote.left_row), (vote.right, vote.right_row))
            if wanted in (None, contestant)
        ]
        return (*min(ranks), vote.pk)

    return by_worst_picture
