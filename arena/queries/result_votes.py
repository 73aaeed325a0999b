"""The votes behind one cell of a rating's pairs."""

from __future__ import annotations

from dataclasses import dataclass

from django.core.paginator import Page, Paginator
from django.db.models import Q, QuerySet

from arena.models import ImportedVote, Snapshot, Vote
from arena.queries.vote_sets import Filters

PER_PAGE = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class CellVotes:
    """One page of the votes on a pair; of a file they have no pictures."""

    page: Page[Vote] | Page[ImportedVote]
    imported: bool


def votes_on_pair(
    snapshot: Snapshot, *, first: str, second: str, page: int, imported: bool
) -> CellVotes:
    """The current votes of a rating on two contestants, by scenario; three queries.

    Args:
        snapshot: With its study.
        first: A slug.
        second: Another.
        page: From 1; beyond the last is the last.
        imported: Whether the votes came from a file.
    """
    if imported:
        lines = Paginator(_imported(snapshot, first, second), PER_PAGE)
        return CellVotes(page=lines.get_page(page), imported=True)
    votes = Paginator(_voted(snapshot, first, second), PER_PAGE)
    return CellVotes(page=votes.get_page(page), imported=False)


def _voted(snapshot: Snapshot, first: str, second: str) -> QuerySet[Vote]:
    filters = Filters.of_document(snapshot.filters)
    last = snapshot.last_vote or 0
    rows = Vote.objects.filter(
        Q(superseded_by=None) | Q(superseded_by__pk__gt=last),
        Q(shown_left__contestant__slug=first, shown_right__contestant__slug=second)
        | Q(shown_left__contestant__slug=second, shown_right__contestant__slug=first),
        matchup__study=snapshot.study_id,
        matchup__kind__in=filters.kinds,
        pk__lte=last,
    ).exclude(outcome=Vote.Outcome.SKIP)
    if filters.types:
        rows = rows.filter(matchup__scenario__type__in=filters.types)
    if filters.experts:
        rows = rows.filter(expert__person__code__in=filters.experts)
    if filters.leave_out_own:
        authors = {judge for judge, slug in filters.authors if slug in (first, second)}
        rows = rows.exclude(expert__person__code__in=authors)
    if not snapshot.study.allow_simulated:
        rows = rows.filter(is_simulated=False)
    return (
        rows.select_related(
            "matchup__scenario", "expert__person", "shown_left__contestant",
            "shown_right__contestant",
        )
        .defer(
            "matchup__scenario__reference", "shown_left__modification",
            "shown_right__modification",
        )
        .order_by("matchup__scenario__slug", "expert__person__pseudonym", "pk")
    )  # fmt: skip


def _imported(snapshot: Snapshot, first: str, second: str) -> QuerySet[ImportedVote]:
    rows = ImportedVote.objects.filter(
        Q(first=first, second=second) | Q(first=second, second=first),
        file__study=snapshot.study_id,
        pk__lte=snapshot.last_vote or 0,
    )
    judges = Filters.of_document(snapshot.filters).experts
    return (rows.filter(judge__in=judges) if judges else rows).order_by("line")
