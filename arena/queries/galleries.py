"""The pictures of a rating: where experts disagree, the worst of a contestant, all side by side.

Everything is counted over the votes of the rating; a picture is that of a showing, as it was then.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple
from uuid import UUID

from django.db.models import Count, F, Max, Q, Value

from arena.models import FaultLabel, Matchup, Snapshot
from arena.queries.remembering import Remembered, plan_types
from arena.queries.vote_lists import counted_votes
from augment.models import Contestant, Scenario


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

    def plus(self, other: VoteScore) -> VoteScore:
        """Both together."""
        return VoteScore(
            wins=self.wins + other.wins,
            ties=self.ties + other.ties,
            losses=self.losses + other.losses,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureShown:
    """A contestant's picture on a scenario, as a showing had it, with what experts made of it.

    Attributes:
        sample: Its number where every sample is judged on its own, else 0.
        matchup, side: Where it was shown, for its address.
        image: Its name in the storage.
        labels, faulty: How many experts looked for faults in it, and how many found some.
    """

    scenario: Scenario
    contestant: Contestant
    sample: int
    augmentation: UUID
    matchup: UUID
    side: str
    image: str
    score: VoteScore
    labels: int = 0
    faulty: int = 0

    @property
    def place(self) -> str:
        """The scenario's slug."""
        return self.scenario.slug


@dataclass(frozen=True, slots=True, kw_only=True)
class DisputedPair:
    """Two contestants on one scenario that experts judged at least twice.

    Attributes:
        left, right: As one of the showings had them; their scores are against each other.
        disagreement: From 0, all say the same, to 1: the mean distance of two judgements, a win
            against a loss being 1 and against a tie a half.
    """

    left: PictureShown
    right: PictureShown
    disagreement: float

    @property
    def sides(self) -> tuple[_Beside, _Beside]:
        """Each beside the other, as a template walks through them."""
        return _Beside(self.left, self.right), _Beside(self.right, self.left)


class _Beside(NamedTuple):
    """A picture and the one it was judged against."""

    shown: PictureShown
    other: PictureShown


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


_Place = tuple[int, int]
_Unit = tuple[int, int, int, int]
"""Scenario, sample, and the two contestants, the lower key first."""


class DisputedUnit(NamedTuple):
    """The same before its pictures are looked up; scored for the unit's second."""

    unit: _Unit
    score: VoteScore
    matchup: int
    disagreement: float


def disputed_pairs(snapshot: Snapshot, *, type_name: str = "") -> list[DisputedUnit]:
    """All pairs of pictures that were judged at least twice, the most disputed first.

    One query, and none the next time; `with_pictures` makes a page of them what people see.
    """
    return _DISPUTED.get(_key(snapshot, type_name), lambda: _disputed(snapshot, type_name))


def _disputed(snapshot: Snapshot, type_name: str) -> list[DisputedUnit]:
    units: dict[_Unit, VoteScore] = {}
    shown: dict[_Unit, int] = {}
    for one in _counts(snapshot, type_name=type_name):
        low, high = sorted((one.left, one.right))
        unit = (one.scenario, one.sample, low, high)
        score = _score_of(one, low)
        units[unit] = units.get(unit, VoteScore()).plus(score)
        shown[unit] = max(shown.get(unit, 0), one.matchup)
    found = [
        DisputedUnit(unit, score, shown[unit], disagreement(score))
        for unit, score in units.items()
        if score.votes > 1
    ]
    return sorted(found, key=lambda one: (-one.disagreement, -one.score.votes, one.unit))


def disagreement(score: VoteScore) -> float:
    """The mean distance of two judgements: a win against a loss is 1, against a tie a half."""
    n = score.votes
    if n < 2:
        return 0.0
    far = score.wins * score.losses + (score.wins + score.losses) * score.ties / 2
    return far / (n * (n - 1) / 2)


def with_pictures(found: Sequence[DisputedUnit]) -> list[DisputedPair]:
    """The pairs with both pictures, in their order; one query."""
    rows = _matchups(one.matchup for one in found)
    pairs = []
    for one in found:
        row = rows[one.matchup]
        mine, theirs = one.score, _turned(one.score)
        if row.left.contestant_id != one.unit[2]:
            mine, theirs = theirs, mine
        pairs.append(
            DisputedPair(
                left=_picture(row, "left", mine, one.unit[1]),
                right=_picture(row, "right", theirs, one.unit[1]),
                disagreement=one.disagreement,
            )
        )
    return pairs


def pictures_of(snapshot: Snapshot, slug: str, *, type_name: str = "") -> list[PictureShown]:
    """Every picture of a contestant that was judged, the most beaten first; five queries."""
    key = (_key(snapshot, type_name), slug)
    shown, scores = _JUDGED.get(key, lambda: _judged(snapshot, slug, type_name))
    (own,) = Contestant.objects.filter(slug=slug).values_list("pk", flat=True)
    rows = _matchups(shown.values())
    found = [
        _picture(rows[pk], _side_of(rows[pk], own), scores[place], place[1])
        for place, pk in shown.items()
    ]
    found = _with_labels(found)
    return sorted(
        found, key=lambda one: (-one.score.lost_share, -one.score.votes, one.place, one.sample)
    )


def _judged(
    snapshot: Snapshot, slug: str, type_name: str
) -> tuple[dict[_Place, int], dict[_Place, VoteScore]]:
    """By scenario and sample: the newest showing of a contestant's picture, and its score."""
    scores: defaultdict[_Place, VoteScore] = defaultdict(VoteScore)
    shown: dict[_Place, int] = {}
    (own,) = Contestant.objects.filter(slug=slug).values_list("pk", flat=True)
    for one in _counts(snapshot, type_name=type_name):
        if own in (one.left, one.right):
            place = one.scenario, one.sample
            scores[place] = scores[place].plus(_score_of(one, own))
            shown[place] = max(shown.get(place, 0), one.matchup)
    return shown, dict(scores)


def by_faults(pictures: Iterable[PictureShown]) -> list[PictureShown]:
    """Those with a fault label, the ones in which most experts found faults first."""
    labelled = [one for one in pictures if one.labels]
    return sorted(labelled, key=lambda one: (-one.faulty / one.labels, -one.labels, one.place))


def sheet_rows(snapshot: Snapshot, scenarios: Sequence[int]) -> dict[int, dict[str, PictureShown]]:
    """The pictures of these scenarios by contestant's slug; two queries."""
    scores: defaultdict[tuple[int, int], VoteScore] = defaultdict(VoteScore)
    shown: dict[tuple[int, int], int] = {}
    for one in _counts(snapshot, scenarios=scenarios):
        for contestant in (one.left, one.right):
            key = (one.scenario, contestant)
            scores[key] = scores[key].plus(_score_of(one, contestant))
            shown[key] = max(shown.get(key, 0), one.matchup)
    rows = _matchups(shown.values())
    sheet: dict[int, dict[str, PictureShown]] = {place: {} for place in scenarios}
    for (place, contestant), pk in shown.items():
        picture = _picture(rows[pk], _side_of(rows[pk], contestant), scores[place, contestant])
        sheet[place][picture.contestant.slug] = picture
    return sheet


# --- Private -----------------------------------------------------------------------------------

_DISPUTED: Remembered[list[DisputedUnit]] = Remembered(3)
_JUDGED: Remembered[tuple[dict[_Place, int], dict[_Place, VoteScore]]] = Remembered(40)


def _key(snapshot: Snapshot, type_name: str) -> Hashable:
    """What a gallery is counted from: a rating's votes never change, types of scenarios do."""
    types = plan_types(snapshot.study) if type_name else ()
    return (snapshot.code, snapshot.last_vote, json.dumps(snapshot.filters), type_name, types)


def _counts(
    snapshot: Snapshot, *, type_name: str = "", scenarios: Sequence[int] | None = None
) -> Iterable[_Count]:
    rows = counted_votes(snapshot)
    if type_name:
        rows = rows.filter(matchup__scenario__type=type_name)
    if scenarios is not None:
        rows = rows.filter(matchup__scenario__in=scenarios)
    apart = snapshot.study.shows_all_samples
    grouped = rows.values_list(
        *("matchup__scenario", F("matchup__right__sample") if apart else Value(0)),
        *("shown_left__contestant", "shown_right__contestant", "outcome"),
    ).annotate(number=Count("pk"), shown=Max("matchup"))
    return (_Count(*row) for row in grouped)


def _score_of(one: _Count, contestant: int) -> VoteScore:
    if one.outcome == "equal":
        return VoteScore(ties=one.number)
    won = (one.outcome == "left") == (one.left == contestant)
    return VoteScore(wins=one.number) if won else VoteScore(losses=one.number)


def _turned(score: VoteScore) -> VoteScore:
    return VoteScore(wins=score.losses, ties=score.ties, losses=score.wins)


def _matchups(keys: Iterable[int]) -> dict[int, Matchup]:
    rows = Matchup.objects.select_related("scenario", "left__contestant", "right__contestant")
    unread = ("scenario__reference", "left__modification", "right__modification", "descriptions")
    return rows.defer(*unread).in_bulk(list(set(keys)))


def _side_of(row: Matchup, contestant: int) -> str:
    return "left" if row.left.contestant_id == contestant else "right"


def _picture(row: Matchup, side: str, score: VoteScore, sample: int = 0) -> PictureShown:
    augmentation = row.left if side == "left" else row.right
    kept = row.left_image if side == "left" else row.right_image
    return PictureShown(
        scenario=row.scenario,
        contestant=augmentation.contestant,
        sample=sample,
        augmentation=augmentation.code,
        matchup=row.code,
        side=side,
        image=kept or augmentation.image,
        score=score,
    )


def _with_labels(found: Sequence[PictureShown]) -> list[PictureShown]:
    """The same with how many experts looked for faults in each, and how many found some."""
    fault = Q(position=True) | Q(heading=True) | Q(logic=True)
    rows = FaultLabel.objects.filter(augmentation__code__in=[one.augmentation for one in found])
    counted = {
        code: (labels, faulty)
        for code, labels, faulty in rows.order_by()
        .values_list("augmentation__code")
        .annotate(labels=Count("pk"), faulty=Count("pk", filter=fault))
    }
    numbers = [counted.get(one.augmentation, (0, 0)) for one in found]
    return [
        replace(one, labels=labels, faulty=faulty)
        for one, (labels, faulty) in zip(found, numbers, strict=True)
    ]
