"""The votes behind a number of a rating, with their pictures: pages of them, all, or a single one.

In: a snapshot and what is looked for. Out: votes with the mark that says why one does not count.
"""

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from django.core.paginator import Page, Paginator
from django.db.models import Count, F, Value

from arena.models import Snapshot, Vote
from arena.results.queries.search import VoteSearch, find_votes, is_found
from arena.results.queries.votes import (
    Filters,
    RatedVote,
    current_votes,
    list_ties_unshown,
    select_counted_votes,
)
from arena.voting.queries.blinding import is_imported
from augment.models import Augmentation

PER_PAGE = 10
CHUNK = 2000
"""So many votes are read at once for a file."""


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


@dataclass(frozen=True, slots=True, kw_only=True)
class ListedVote:
    """One line of a list of votes.

    Attributes:
        given: A vote, or a tie on a pair that nobody was shown.
        mark: Why it does not count, or that it does.
        judge: The pseudonym as the rating kept it, empty where nobody decided.
        names: Of the two contestants of a tie.
        pair: The votes on both pictures that count, as one of the two sees them.
    """

    given: Vote | RatedVote
    mark: str
    judge: str = ""
    names: tuple[str, ...] = ()
    pair: VoteScore | None = None

    @property
    def vote(self) -> Vote | None:
        """The vote, if somebody gave one."""
        return self.given if isinstance(self.given, Vote) else None

    @property
    def sides(self) -> list[tuple[str, Augmentation]]:
        """Augmentations of a vote, with the side of each."""
        vote = self.vote
        return [("left", vote.shown_left), ("right", vote.shown_right)] if vote else []


# --- Lists of votes ----------------------------------------------------------------------------


def vote_page(snapshot: Snapshot, search: VoteSearch, number: int) -> Page[Any]:
    """One page of listed votes with the numbers beside their pictures; the last beyond it."""
    page: Page[Any] = Paginator(_find_all(snapshot, search), PER_PAGE).get_page(number)
    page.object_list = _list_votes(list(page.object_list), snapshot, scores_of_pairs(snapshot))
    return page


def each_vote(snapshot: Snapshot, search: VoteSearch) -> Iterator[ListedVote]:
    """All that are looked for, in the order of their pages."""
    votes = _find_all(snapshot, search)
    for start in range(0, len(votes), CHUNK):
        yield from _list_votes(votes[start : start + CHUNK], snapshot, {})


def count_settled(snapshot: Snapshot) -> int:
    """Return how many ties of pairs that nobody was shown count in a rating."""
    if (ties := snapshot.results.board.settled_ties) is not None:
        return ties
    is_possible = snapshot.study.rules.get("identical") and not is_imported(snapshot.study)
    if not is_possible or Filters.of_document(snapshot.filters).leave_out_settled:
        return 0
    return snapshot.votes_counted - select_counted_votes(snapshot).count()


def scores_of_pairs(snapshot: Snapshot) -> dict[Pair, VoteScore]:
    """The votes of a rating by pair, as seen from the lower contestant; one query."""
    columns = (
        *("matchup__scenario", _sample(snapshot)),
        *("shown_left__contestant", "shown_right__contestant", "outcome"),
    )
    rows = select_counted_votes(snapshot).values_list(*columns).annotate(number=Count("pk"))
    counts: defaultdict[Pair, Counter[str]] = defaultdict(Counter)
    for scenario, sample, left, right, outcome, number in rows:
        pair = Pair.of(scenario, sample, left, right)
        winner = {"left": left, "right": right}.get(outcome)
        side = "ties" if winner is None else "wins" if winner == pair.low else "losses"
        counts[pair][side] += number
    return {pair: VoteScore(**numbers) for pair, numbers in counts.items()}


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


def _find_all(snapshot: Snapshot, search: VoteSearch) -> list[tuple[int, str] | RatedVote]:
    """Keys and marks of the rows, then the ties on pairs that nobody was shown."""
    study, filters = snapshot.study, Filters.of_document(snapshot.filters)
    ties: list[RatedVote] = []
    if study.rules.get("identical"):
        votes = current_votes(study, filters, snapshot.last_vote)
        ties = [tie for tie in list_ties_unshown(study, votes, filters) if is_found(tie, search)]
    return [*sort_votes(snapshot, search), *ties]


def _list_votes(
    entries: Sequence[tuple[int, str] | RatedVote],
    snapshot: Snapshot,
    scores: Mapping[Pair, VoteScore],
) -> list[ListedVote]:
    """Votes in their order; two queries."""
    related = (
        *("matchup__scenario__follows", "expert__person"),
        *("shown_left__contestant", "shown_right__contestant"),
    )
    unread = (
        *("matchup__view", "matchup__scenario__reference"),
        *("matchup__scenario__follows__reference", "matchup__scenario__follows__intent"),
        *("matchup__scenario__intent", "shown_left__modification", "shown_right__modification"),
    )
    ties = [entry for entry in entries if isinstance(entry, RatedVote)]
    marks = dict(entry for entry in entries if not isinstance(entry, RatedVote))
    rows = Vote.objects.select_related(*related).defer(*unread).in_bulk(list(marks))
    listed = []
    for pk, mark in marks.items():
        vote, person = rows[pk], rows[pk].expert.person
        sample = vote.shown_right.sample if snapshot.study.shows_all_samples else 0
        contestants = vote.shown_left.contestant_id, vote.shown_right.contestant_id
        pair = scores.get(Pair.of(vote.matchup.scenario_id, sample, *contestants))
        judge = snapshot.results.judges.get(str(person.code), person.pseudonym)
        listed.append(ListedVote(given=vote, mark=mark, judge=judge, pair=pair))
    names = dict(snapshot.standings.values_list("slug", "name")) if ties else {}
    for tie in ties:
        both = names[tie.left], names[tie.right]
        listed.append(ListedVote(given=tie, mark=tie.mark, names=both))
    return listed


def _sample(snapshot: Snapshot) -> F | Value:
    """Return the sample of both sides where each one is judged on its own, else 0."""
    return F("matchup__right__sample") if snapshot.study.shows_all_samples else Value(0)
