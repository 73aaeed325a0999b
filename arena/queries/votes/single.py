"""One vote of a rating with all around it."""

from __future__ import annotations

from dataclasses import dataclass
from uuid import UUID

from django.db.models import F

from arena.models import Report, Snapshot, Vote
from arena.queries.votes.lists import votes_behind
from arena.queries.votes.search import EVERY, VoteSearch


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
