"""A scenario's intent after it was added: entered, or read by a language model and accepted."""

from __future__ import annotations

from typing import Any

from django.contrib.auth.models import User
from django.db import transaction

from augment.errors import Conflict, UnknownName
from augment.models import IntentReading, Scenario
from augment.scene.codec import intent_from_document
from augment.scene.intent import IntentOrigin
from augment.scene.intent_statements import list_statements
from augment.services.events import log_event
from augment.services.scenarios.scenes import placeable_intent

State = IntentReading.State


@transaction.atomic
def enter_intent(*, scenario: str, document: object, actor: User | None = None) -> Scenario:
    """Give a scenario the intent of a document, in the place of the one that it had.

    Raises:
        UnknownName: No such scenario.
        InvalidDocument: The document breaks the format, or leaves open what jobs need.
        Conflict: The scenario is the catalogue's, whose intents are authored.
    """
    row = _scenario(scenario)
    if row.in_catalogue:
        raise Conflict(
            f"The intent of '{row.slug}' is the catalogue's own; change it in its file."
        )
    return _set(row, placeable_intent(document), IntentOrigin.ENTERED, actor)


@transaction.atomic
def accept_reading(*, scenario: str, actor: User | None = None) -> Scenario:
    """Let the last reading of a scenario count, in the place of the intent that it had.

    Raises:
        UnknownName: No such scenario.
        InvalidDocument: What was read leaves open what jobs need.
        Conflict: Nothing that was read waits to be accepted, or the scenario is the catalogue's.
    """
    row = _scenario(scenario)
    reading = waiting_reading(row)
    if reading is None:
        raise Conflict(f"No reading of '{row.slug}' waits to be accepted.")
    if row.in_catalogue:
        raise Conflict(
            f"The intent of '{row.slug}' is the catalogue's own; change it in its file."
        )
    document = placeable_intent(reading.document)
    IntentReading.objects.filter(pk=reading.pk).update(state=State.ACCEPTED)
    return _set(row, document, IntentOrigin.READ, actor)


def waiting_reading(scenario: Scenario) -> IntentReading | None:
    """The last reading, where it was read and nobody has accepted it yet."""
    last = scenario.readings.select_related("endpoint").first()
    return last if last is not None and last.state == State.READ else None


def last_reading(scenario: Scenario) -> IntentReading | None:
    """The last reading, whatever became of it."""
    return scenario.readings.select_related("endpoint").first()


def statements_of(document: object) -> tuple[str, ...]:
    """What an intent document says, as short statements; none where there is no document.

    Raises:
        InvalidDocument: The document breaks the format.
    """
    return () if document is None else list_statements(intent_from_document(document))


# --- Private -----------------------------------------------------------------------------------


def _scenario(slug: str) -> Scenario:
    row = Scenario.objects.select_for_update(of=("self",)).filter(slug=slug).first()
    if row is None:
        raise UnknownName("scenario", slug, list(Scenario.objects.values_list("slug", flat=True)))
    return row


def _set(
    row: Scenario, document: dict[str, Any], origin: IntentOrigin, actor: User | None
) -> Scenario:
    before = {"intent": row.intent, "origin": row.intent_origin or None}
    row.intent, row.intent_origin = document, origin
    row.save(update_fields=["intent", "intent_origin"])
    log_event(
        actor=actor,
        verb="set intent",
        object_kind="scenario",
        object_code=row.code,
        before=before,
        after={"intent": document, "origin": origin.value},
    )
    return row
