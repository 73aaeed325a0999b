"""A scenario's reference after the scenario was added: drawn or typed by a person."""

from __future__ import annotations

from django.contrib.auth.models import User
from django.db import transaction

from augment.errors import Conflict
from augment.models import Scenario
from augment.scene.codec import modification_to_document
from augment.services.events import log_event
from augment.services.scenarios.editing import read_edit
from augment.services.scenarios.scenes import intent_of


@transaction.atomic
def set_reference(scenario: Scenario, document: object, *, actor: User | None = None) -> Scenario:
    """Give a scenario the reference of a document, in the place of the one that it had.

    Raises:
        InvalidDocument: The document breaks its format.
        InvalidModification: It does not fit the scene.
        Conflict: The scenario is the catalogue's, or nothing changes though the wish can be met.
    """
    row = Scenario.objects.select_for_update(of=("self",)).get(pk=scenario.pk)
    refuse_catalogue(row)
    modification = read_edit(row, document)
    intent = intent_of(row)
    if modification.is_empty and not (intent and intent.unmet):
        raise Conflict(
            "Nothing is added, moved or removed. An empty reference is for wishes that can't "
            "be met, whose intent says so."
        )
    return _set(row, modification_to_document(modification), actor)


@transaction.atomic
def drop_reference(scenario: Scenario, *, actor: User | None = None) -> Scenario:
    """Leave a scenario without a reference.

    Raises:
        Conflict: The scenario is the catalogue's, or has none.
    """
    row = Scenario.objects.select_for_update(of=("self",)).get(pk=scenario.pk)
    refuse_catalogue(row)
    if row.reference is None:
        raise Conflict(f"'{row.slug}' has no reference.")
    return _set(row, None, actor)


def refuse_catalogue(row: Scenario) -> None:
    """Raise Conflict for a scenario whose files alone change it."""
    if row.in_catalogue:
        raise Conflict(
            f"The reference of '{row.slug}' is the catalogue's own; change it in its file."
        )


def _set(row: Scenario, document: dict[str, object] | None, actor: User | None) -> Scenario:
    before = row.reference
    row.reference = document
    row.save(update_fields=["reference"])
    log_event(
        actor=actor,
        verb="set reference",
        object_kind="scenario",
        object_code=row.code,
        before={"reference": before},
        after={"reference": document},
    )
    return row
