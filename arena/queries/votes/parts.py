"""Parts of the votes that a number of the results stands for, found by the database."""

from __future__ import annotations

from collections.abc import Callable

from django.db.models import Exists, OuterRef, Q, QuerySet

from arena.models import Snapshot, Vote
from arena.pairing.order import CHECK, REPEAT
from arena.queries.votes.judged import RATED
from arena.queries.votes.search import COUNTED, SoughtPart
from arena.queries.votes.sets import Filters, LeftOut, marked_votes, own_votes
from arena.rating.reliability import FAST_MS
from augment.models import Contestant

_Rows = QuerySet[Vote]


def find_part(rows: QuerySet[Vote], snapshot: Snapshot, part: SoughtPart) -> QuerySet[Vote]:
    """Those of the rating's marked votes that belong to the part."""
    return _PARTS[part](rows, snapshot)


# --- Private -----------------------------------------------------------------------------------


def _first_votes(snapshot: Snapshot) -> _Rows:
    """The vote that counts on what a hidden repeat shows again."""
    return marked_votes(snapshot).filter(Q(mark=COUNTED), matchup=OuterRef("matchup__repeat_of"))


def _repeats(rows: _Rows, snapshot: Snapshot) -> _Rows:
    decided = rows.filter(matchup__kind=REPEAT, outcome__in=RATED)
    current = decided.exclude(Q(mark=LeftOut.SUPERSEDED.value))
    return current.filter(Exists(_first_votes(snapshot)))


def _alike(rows: _Rows, snapshot: Snapshot) -> _Rows:
    first = _first_votes(snapshot)
    tied, won = first.filter(winner=None), first.filter(winner=OuterRef("winner"))
    return _repeats(rows, snapshot).filter(
        (Q(winner=None) & Exists(tied)) | (Q(winner__isnull=False) & Exists(won))
    )


def _own_votes(rows: _Rows, snapshot: Snapshot) -> _Rows:
    return rows.filter(own_votes(Filters.of_document(snapshot.filters)))


def _shared(rows: _Rows, snapshot: Snapshot) -> _Rows:
    """Votes on what another expert's vote that counts is on as well."""
    others = marked_votes(snapshot).filter(
        Q(mark=COUNTED), matchup__scenario=OuterRef("matchup__scenario")
    )
    others = others.exclude(expert=OuterRef("expert"))
    left, right = "shown_left__contestant", "shown_right__contestant"
    alike = others.filter(**{left: OuterRef(left), right: OuterRef(right)})
    turned = others.filter(**{left: OuterRef(right), right: OuterRef(left)})
    return rows.filter(Exists(alike) | Exists(turned))


_PARTS: dict[SoughtPart, Callable[[_Rows, Snapshot], _Rows]] = {
    SoughtPart.COMMENTED: lambda rows, _: rows.exclude(comment=""),
    SoughtPart.FAST: lambda rows, _: rows.filter(ms_visible__lt=FAST_MS),
    SoughtPart.OWN: _own_votes,
    SoughtPart.REPEATS: _repeats,
    SoughtPart.ALIKE: _alike,
    SoughtPart.CHECKS: lambda rows, _: rows.filter(matchup__kind=CHECK, outcome__in=RATED),
    SoughtPart.SHARED: _shared,
    SoughtPart.PASSED: lambda rows, _: rows.filter(
        matchup__kind=CHECK, winner__contestant__kind=Contestant.Kind.REFERENCE
    ),
    SoughtPart.CHECKS_SKIPPED: lambda rows, _: rows.filter(matchup__kind=CHECK, outcome="skip"),
}
