"""Lists narrowed by a word and by filters, to be shown page by page."""

from __future__ import annotations

from dataclasses import dataclass

from django.contrib.auth.models import User
from django.db.models import Case, IntegerField, Q, QuerySet, Value, When

from arena.models import Study
from arena.scenarios.queries import OWN, TypeGroup
from augment.models import Contestant, GenerationJob, Scenario
from augment.services.scenarios.scenes import type_choices

MINE = "mine"


@dataclass(frozen=True, slots=True, kw_only=True)
class Narrowing:
    """What somebody looks for; empty is everything.

    Attributes:
        search: A part of a name or of what else is read there.
        kind: The state, kind or type.
        part: Another filter that the list has.
        is_retired: Of scenarios: those that forms offer no more, instead of the others.
    """

    search: str = ""
    kind: str = ""
    part: str = ""
    is_retired: bool = False


def find_jobs(wanted: Narrowing, *, user: User) -> QuerySet[GenerationJob]:
    """Jobs, the youngest first; `part` "mine" for those that the user launched."""
    found = GenerationJob.objects.select_related("launched_by__person")
    if wanted.search:
        found = found.filter(name__icontains=wanted.search)
    if wanted.kind:
        found = found.filter(state=wanted.kind)
    if wanted.part == MINE:
        found = found.filter(launched_by=user)
    return found.order_by("-created_at", "-pk")


def find_studies(wanted: Narrowing) -> QuerySet[Study]:
    """Studies in the order of their list."""
    found = Study.objects.all()
    if wanted.search:
        found = found.filter(name__icontains=wanted.search)
    return found.filter(state=wanted.kind) if wanted.kind else found


def find_contestants(wanted: Narrowing) -> QuerySet[Contestant]:
    """Contestants by name, those that are retired at the end; no attention checks."""
    found = Contestant.objects.exclude(kind=Contestant.Kind.CHECK).select_related("endpoint")
    if wanted.search:
        found = found.filter(
            _any_has(wanted.search, "name", "slug", "variant", "model", "endpoint__label")
        )
    if wanted.kind:
        found = found.filter(kind=wanted.kind)
    if wanted.part:
        found = found.filter(retired_at__isnull=wanted.part == "active")
    is_retired = Case(When(retired_at=None, then=Value(0)), default=Value(1))
    return found.annotate(at_end=is_retired).order_by("at_end", "name", "pk")


def find_scenarios(wanted: Narrowing) -> QuerySet[Scenario]:
    """Scenarios in the order of the types, without paraphrases and without their documents.

    `part` is a set of the catalogue, `own` for those in none.
    """
    found = Scenario.objects.filter(paraphrase_of=None).select_related("base_scene")
    found = found.filter(retired_at__isnull=not wanted.is_retired)
    if wanted.search:
        found = found.filter(_any_has(wanted.search, "slug", "instruction", "base_scene__slug"))
    if wanted.kind:
        found = found.filter(type=wanted.kind)
    if wanted.part:
        found = found.filter(catalogue_set="" if wanted.part == OWN else wanted.part)
    places = [When(type=name, then=Value(n)) for n, (name, _) in enumerate(type_choices())]
    place = Case(*places, default=Value(len(places)), output_field=IntegerField())
    lean = found.defer("reference", "base_scene__document", "base_scene__recording")
    return lean.annotate(place=place).order_by("place", "slug")


def group_by_type(rows: list[Scenario]) -> list[TypeGroup]:
    """Rows that come in the order of the types, in groups."""
    labels = dict(type_choices())
    found: dict[str, list[Scenario]] = {}
    for row in rows:
        found.setdefault(row.type, []).append(row)
    return [
        TypeGroup(type=name, label=labels.get(name, name), scenarios=scenarios)
        for name, scenarios in found.items()
    ]


def _any_has(text: str, *columns: str) -> Q:
    """Rows with that text in one of these columns, whatever the case."""
    matches = Q()
    for column in columns:
        matches |= Q(**{f"{column}__icontains": text})
    return matches
