"""Why a vote does not count, found by the database: the same words as `vote_sets` says them."""

from __future__ import annotations

from collections.abc import Sequence
from uuid import UUID

from django.db.models import Case, Q, QuerySet, Value, When
from django.db.models.fields import CharField

from arena.models import ImportedVote, Person, Snapshot, Study, Vote
from arena.pairing.order import CHECK, MAIN, REPEAT
from arena.queries.judged import is_imported
from arena.queries.vote_search import COUNTED
from arena.queries.vote_sets import Filters, LeftOut
from augment.models import Contestant

RATED = ("left", "equal", "right")
"""The outcomes that a rating can count."""


def marked_votes(snapshot: Snapshot) -> QuerySet[Vote]:
    """All votes up to a rating with their `mark`: the first reason that fits, or COUNTED.

    At most three queries beside its own: who is simulated, who was asked for, who is author.
    """
    filters = Filters.of_document(snapshot.filters)
    mark = Case(
        *(When(holds, then=Value(reason.value)) for reason, holds in _reasons(snapshot, filters)),
        default=Value(COUNTED),
        output_field=CharField(),
    )
    rows = Vote.objects.filter(matchup__study=snapshot.study_id, pk__lte=snapshot.last_vote or 0)
    return rows.order_by().annotate(mark=mark)


def counted_votes(snapshot: Snapshot) -> QuerySet[Vote]:
    """The rows that the rating is made of, without those of pairs that nobody was shown."""
    return marked_votes(snapshot).filter(Q(mark=COUNTED))


def own_votes(filters: Filters) -> Q:
    """Votes of authors on their own contestants; one query."""
    users = users_of(sorted({judge for judge, _ in filters.authors}))
    own = Q(pk=None)
    for judge, slug in sorted(filters.authors):
        shown = Q(shown_left__contestant__slug=slug) | Q(shown_right__contestant__slug=slug)
        own |= Q(expert=users.get(judge)) & shown
    return own


def made_up_contestants(study: Study) -> QuerySet[Contestant]:
    """Who of the study is simulated."""
    return study.contestants.filter(kind=Contestant.Kind.SIMULATED)


def users_of(codes: Sequence[str]) -> dict[str, int]:
    """Accounts by the codes of their people; one query."""
    found = Person.objects.filter(code__in=[code for code in codes if _is_code(code)])
    return {str(code): user for code, user in found.values_list("code", "user_id")}


def is_scenario_of(snapshot: Snapshot, slug: str) -> bool:
    """Whether the study has a scenario of that name, be it in attention checks alone."""
    study = snapshot.study
    if is_imported(study):
        return ImportedVote.objects.filter(file__study=study, item=slug).exists()
    return study.matchups.filter(scenario__slug=slug).exists() or (
        study.scenarios.filter(slug=slug).exists()
    )


# --- Private -----------------------------------------------------------------------------------


def _reasons(snapshot: Snapshot, filters: Filters) -> list[tuple[LeftOut, Q]]:
    """In the order of `vote_sets`."""
    reasons = [
        (LeftOut.SUPERSEDED, Q(superseded_by__pk__lte=snapshot.last_vote or 0)),
        (LeftOut.CHECK, Q(matchup__kind=CHECK)),
        (LeftOut.REPEAT, Q(matchup__kind=REPEAT)),
        (LeftOut.SKIP, ~Q(outcome__in=RATED)),
        (LeftOut.SIMULATED, Q(is_simulated=True)),
    ]
    if REPEAT in filters.kinds:
        del reasons[2]
    if snapshot.study.allow_simulated:
        del reasons[-1]
    else:
        for pk in made_up_contestants(snapshot.study).values_list("pk", flat=True):
            shown = Q(shown_left__contestant=pk) | Q(shown_right__contestant=pk)
            reasons.append((LeftOut.SIMULATED, shown))
    if filters.types:
        reasons.append((LeftOut.FILTERED, ~Q(matchup__scenario__type__in=filters.types)))
    if filters.experts:
        users = users_of(filters.experts).values()
        reasons.append((LeftOut.FILTERED, ~Q(expert__in=list(users))))
    if MAIN not in filters.kinds:
        reasons.append((LeftOut.FILTERED, Q(matchup__kind=MAIN)))
    if filters.leave_out_own and filters.authors:
        reasons.append((LeftOut.OWN, own_votes(filters)))
    return reasons


def _is_code(text: str) -> bool:
    try:
        UUID(text)
    except ValueError:
        return False
    return True
