"""The log of administrative acts, filtered."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date, datetime, time

from django.contrib.auth.models import User
from django.db.models import Q, QuerySet
from django.utils import timezone

from arena.models import Study
from augment.models import Event

MACHINE = "machine"
"""Asked for as an actor: what nobody did but the machine itself."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AuditFilters:
    """Which acts; what is empty filters nothing.

    Attributes:
        actor: The code of a person, or MACHINE.
        object_code: All of it, or a study's name.
        since, until: Days of the installation's time zone, both included.
    """

    actor: str = ""
    verb: str = ""
    object_kind: str = ""
    object_code: str = ""
    since: date | None = None
    until: date | None = None


def acts(filters: AuditFilters) -> QuerySet[Event]:
    """The acts, the newest first, with who did them."""
    rows = Event.objects.select_related("actor__person").order_by("-at", "-pk")
    if filters.actor == MACHINE:
        rows = rows.filter(actor=None)
    elif filters.actor:
        rows = rows.filter(actor__person__code=filters.actor)
    if filters.verb:
        rows = rows.filter(verb=filters.verb)
    if filters.object_kind:
        rows = rows.filter(object_kind=filters.object_kind)
    if filters.object_code:
        rows = rows.filter(_about(filters.object_code))
    if filters.since is not None:
        rows = rows.filter(at__gte=_at(filters.since, time.min))
    if filters.until is not None:
        rows = rows.filter(at__lte=_at(filters.until, time.max))
    return rows


def actors() -> list[User]:
    """Everybody who ever did something, by pseudonym."""
    found = User.objects.filter(pk__in=Event.objects.exclude(actor=None).values("actor"))
    return list(found.select_related("person").order_by("person__pseudonym"))


def verbs() -> list[str]:
    """Every word for an act that there is."""
    return sorted(Event.objects.order_by().values_list("verb", flat=True).distinct())


def object_kinds() -> list[str]:
    """Every kind of thing that something was done to."""
    return sorted(Event.objects.order_by().values_list("object_kind", flat=True).distinct())


def _about(wanted: str) -> Q:
    codes = Study.objects.filter(name=wanted).values_list("code", flat=True)
    return Q(object_code__in=[wanted, *(str(code) for code in codes)])


def _at(day: date, moment: time) -> datetime:
    return timezone.make_aware(datetime.combine(day, moment))
