"""Which studies somebody sees."""

from __future__ import annotations

from contextlib import suppress
from uuid import UUID

from django.contrib.auth.models import User
from django.db.models import Q
from django.db.models.functions import Length

from arena.errors import NotYours
from arena.models import Study
from augment.errors import UnknownName

LONGEST = 3
"""How many: which of them takes most lines depends on words and fonts."""


def voting_study(*, expert: User, code: UUID | str) -> Study:
    """The study that this expert votes in, whatever its state.

    Raises:
        NotYours: There is none with that code, or the expert does not take part in it.
    """
    study = expert.studies.filter(code=code).first()
    if study is None:
        raise NotYours("You do not take part in this study.")
    return study


def longest_instructions(study: Study) -> list[str]:
    """The longest few things that a study asks for: each pair gets the room that they need."""
    by_length = study.scenarios.order_by(Length("instruction").desc(), "pk")
    return list(by_length.values_list("instruction", flat=True)[:LONGEST])


def study_named(name_or_code: str) -> Study:
    """A study by its name or its code.

    Raises:
        UnknownName: There is none.
    """
    wanted = Q(name=name_or_code)
    with suppress(ValueError):  # most names are not codes
        wanted |= Q(code=UUID(name_or_code))
    study = Study.objects.filter(wanted).first()
    if study is None:
        names = Study.objects.values_list("name", flat=True)
        raise UnknownName("study", name_or_code, sorted(names))
    return study
