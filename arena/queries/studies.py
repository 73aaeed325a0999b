"""Which studies somebody sees."""

from __future__ import annotations

from contextlib import suppress
from uuid import UUID

from django.contrib.auth.models import User
from django.db.models import Q

from arena.errors import NotYours
from arena.models import Study
from augment.errors import UnknownName


def voting_study(*, expert: User, code: UUID | str) -> Study:
    """The study that this expert votes in, whatever its state.

    Raises:
        NotYours: There is none with that code, or the expert does not take part in it.
    """
    found = expert.studies.filter(code=code).first()
    if found is None:
        raise NotYours("You do not take part in this study.")
    return found


def study_named(name_or_code: str) -> Study:
    """A study by its name or its code.

    Raises:
        UnknownName: There is none.
    """
    wanted = Q(name=name_or_code)
    with suppress(ValueError):  # most names are not codes
        wanted |= Q(code=UUID(name_or_code))
    found = Study.objects.filter(wanted).first()
    if found is None:
        names = Study.objects.values_list("name", flat=True)
        raise UnknownName("study", name_or_code, sorted(names))
    return found
