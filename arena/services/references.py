"""References that people draw: never while somebody still has to judge pictures beside them."""

from __future__ import annotations

from django.contrib.auth.models import User
from django.db import transaction

from arena.scenarios.services import find_judged_now
from augment.errors import Conflict
from augment.models import Scenario
from augment.services.scenarios import editing


@transaction.atomic
def set_reference(scenario: Scenario, document: object, *, actor: User | None = None) -> Scenario:
    """Give a scenario this reference; the window of its pictures may become another one.

    Raises:
        InvalidDocument: The document breaks its format.
        InvalidModification: It does not fit the scene.
        Conflict: The scenario is the catalogue's, an open study or labelling shows it, or nothing
            changes.
    """
    _hold_unjudged(scenario)
    return editing.set_reference(scenario, document, actor=actor)


@transaction.atomic
def drop_reference(scenario: Scenario, *, actor: User | None = None) -> Scenario:
    """Leave a scenario without a reference.

    Raises:
        Conflict: As above, or it has none.
    """
    _hold_unjudged(scenario)
    return editing.drop_reference(scenario, actor=actor)


def why_not_editable(scenario: Scenario) -> str:
    """Why the reference of a scenario can't be changed now, empty where it can."""
    try:
        editing.refuse_catalogue(scenario)
        _refuse_judged(scenario)
    except Conflict as conflict:
        return conflict.args[0]  # type: ignore[no-any-return]
    return ""


def _hold_unjudged(scenario: Scenario) -> None:
    """Hold it, as an opening study does: none opens between the look and the change."""
    Scenario.objects.select_for_update(of=("self",)).get(pk=scenario.pk)
    _refuse_judged(scenario)


def _refuse_judged(scenario: Scenario) -> None:
    if needed_by := find_judged_now(scenario.pk):
        raise Conflict(
            f"“{needed_by}” is open and shows this scenario: its reference stays until that "
            "is over."
        )
