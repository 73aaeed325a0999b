"""Scores of a rating's pictures and pairs by their votes, and an order of votes by them."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from django.db.models import Count, F, Max, QuerySet, Value

from arena.models import Snapshot, Vote
from arena.results.queries.search import VoteSearch, find_votes
from arena.results.queries.votes import select_counted_votes


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
    def disagreement(self) -> float:
        """The mean distance of two judgements: a win against a loss is 1, against a tie a half."""
        n = self.votes
        if n < 2:
            return 0.0
        far = self.wins * self.losses + (self.wins + self.losses) * self.ties / 2
        return far / (n * (n - 1) / 2)


class Pair(NamedTuple):
    """Two pictures of a scenario, the contestant of the lower key first."""

    scenario: int
    sample: int
    low: int
    high: int

    @classmethod
    def of(cls, scenario: int, sample: int, first: int, other: int) -> "Pair":
        """Return the pair, whoever was shown on the left."""
        return cls(scenario, sample, min(first, other), max(first, other))


def scores_of_pairs(snapshot: Snapshot) -> dict[Pair, VoteScore]:
    """The votes of a rating by pair, as seen from the lower contestant; one query."""
    pairs: defaultdict[Pair, VoteScore] = defaultdict(VoteScore)
    for count in _count_votes(select_counted_votes(snapshot), snapshot):
        pair = Pair.of(count.scenario, count.sample, count.left, count.right)
        pairs[pair] = count.add_to(pairs[pair], pair.low)
    return dict(pairs)


def sort_votes(snapshot: Snapshot, search: VoteSearch) -> list[tuple[int, str]]:
    """Return keys and marks of the votes looked for, as given or the most disputed ones first."""
    rows = find_votes(snapshot, search)
    if not search.order:
        return list(rows.order_by("pk").values_list("pk", F("mark")))
    scores = scores_of_pairs(snapshot)

    def place(row: tuple[Any, ...]) -> tuple[Any, ...]:
        pk, _, slug, *shown = row
        pair = Pair.of(*shown)
        score = scores.get(pair, VoteScore())
        return -score.disagreement, -score.votes, slug, pair, pk

    columns = rows.values_list(
        *("pk", F("mark"), "matchup__scenario__slug", "matchup__scenario", _sample(snapshot)),
        *("shown_left__contestant", "shown_right__contestant"),
    )
    return [(pk, mark) for pk, mark, *_ in sorted(columns, key=place)]


# --- Private -----------------------------------------------------------------------------------


class _Count(NamedTuple):
    """So many votes of one outcome on two contestants of a scenario, and the latest showing."""

    scenario: int
    sample: int
    left: int
    right: int
    outcome: str
    number: int
    matchup: int

    def add_to(self, score: VoteScore, contestant: int) -> VoteScore:
        """Return a score with these votes, as one of the two sees them."""
        if self.outcome == "equal":
            return replace(score, ties=score.ties + self.number)
        if (self.outcome == "left") == (self.left == contestant):
            return replace(score, wins=score.wins + self.number)
        return replace(score, losses=score.losses + self.number)


def _count_votes(rows: QuerySet[Vote], snapshot: Snapshot) -> Iterator[_Count]:
    grouped = rows.values_list(
        *("matchup__scenario", _sample(snapshot)),
        *("shown_left__contestant", "shown_right__contestant", "outcome"),
    )
    return map(_Count._make, grouped.annotate(number=Count("pk"), shown=Max("matchup")))


def _sample(snapshot: Snapshot) -> F | Value:
    """Return the sample of both sides where each one is judged on its own, else 0."""
    return F("matchup__right__sample") if snapshot.study.shows_all_samples else Value(0)
