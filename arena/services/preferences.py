"""What a person chooses for themselves."""

from __future__ import annotations

from django.contrib.auth.models import User
from django.db import transaction

from arena.models import Person
from arena.queries.profiles import Theme


@transaction.atomic
def choose_theme(*, user: User, theme: Theme) -> Person:
    """Keep how the pages look to this account, which becomes a person if it was none."""
    person, _ = Person.objects.select_for_update().get_or_create(
        user=user, defaults={"pseudonym": user.get_username()}
    )
    person.preferences = {**person.preferences, "theme": theme.value}
    person.save(update_fields=["preferences"])
    return person
