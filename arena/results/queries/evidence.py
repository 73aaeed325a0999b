"""The votes behind a number of a rating, with their pictures: pages of them, all, or a single one.

In: a snapshot and what is looked for. Out: votes with the mark that says why one does not count.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from django.core.paginator import Page, Paginator

from arena.models import Snapshot, Vote
from arena.results.queries.scores import Pair, VoteScore, scores_of_pairs, sort_votes
from arena.results.queries.search import VoteSearch, is_found
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
    keys = [entry for entry in entries if not isinstance(entry, RatedVote)]
    rows = Vote.objects.select_related(*related).defer(*unread).in_bulk([pk for pk, _ in keys])
    names = dict(snapshot.standings.values_list("slug", "name")) if ties else {}
    return [
        *(_list_vote(rows[pk], mark, snapshot, scores) for pk, mark in keys),
        *(
            ListedVote(given=tie, mark=tie.mark, names=(names[tie.left], names[tie.right]))
            for tie in ties
        ),
    ]


def _list_vote(
    vote: Vote, mark: str, snapshot: Snapshot, scores: Mapping[Pair, VoteScore]
) -> ListedVote:
    sample = vote.shown_right.sample if snapshot.study.shows_all_samples else 0
    contestants = vote.shown_left.contestant_id, vote.shown_right.contestant_id
    pair = scores.get(Pair.of(vote.matchup.scenario_id, sample, *contestants))
    person = vote.expert.person
    judge = snapshot.results.judges.get(str(person.code), person.pseudonym)
    return ListedVote(given=vote, mark=mark, judge=judge, pair=pair)
