"""Changing scenarios and scenes that nothing depends on yet."""

from __future__ import annotations

from django.contrib.auth.models import User
from django.db import transaction

from arena.scenarios.services import refuse_needed_scenario, refuse_needed_scene
from augment.errors import Conflict
from augment.models import BaseScene, Scenario
from augment.services.events import log_event
from augment.services.scenarios.scenes import (
    Circumstances,
    change_circumstances,
    check_slug,
    set_wording,
)


@transaction.atomic
def change_scenario(
    scenario: Scenario,
    *,
    instruction: str,
    type: str,
    type_label: str | None,
    keep_traffic: bool,
    circumstances: Circumstances,
    actor: User | None = None,
) -> Scenario:
    """Set the instruction, type and circumstances of a scenario that was not worked on yet.

    Raises:
        InvalidDocument: The type or the instruction breaks its format.
        InvalidModification: The reference does not fit the changed scene.
        Conflict: The scenario is the catalogue's, or something needs it; the text names it.
    """
    row = Scenario.objects.select_for_update(of=("self",)).get(pk=scenario.pk)
    if row.in_catalogue:
        raise Conflict(f"“{row.slug}” is the catalogue’s own; change it in its file.")
    refuse_needed_scenario(row, "changed")
    before = _state(row)
    set_wording(row, instruction, type, type_label)
    change_circumstances(row, circumstances, keep_traffic=keep_traffic)
    row.save()
    log_event(
        actor=actor,
        verb="change",
        object_kind="scenario",
        object_code=row.code,
        before=before,
        after=_state(row),
    )
    return row


@transaction.atomic
def rename_scene(scene: BaseScene, slug: str, *, actor: User | None = None) -> BaseScene:
    """Give a scene that no scenario stands on another slug.

    Raises:
        InvalidDocument: It is no slug.
        Conflict: It is taken, or a scenario stands on the scene.
    """
    row = BaseScene.objects.select_for_update().get(pk=scene.pk)
    check_slug(slug, what="scene")
    refuse_needed_scene(row, "renamed")
    if BaseScene.objects.filter(slug=slug).exclude(pk=row.pk).exists():
        raise Conflict(f"There is a scene called “{slug}” already; choose another slug.")
    before, row.slug = row.slug, slug
    row.document["name"] = slug
    row.save(update_fields=["slug", "document"])
    log_event(
        actor=actor,
        verb="rename",
        object_kind="scene",
        object_code=row.code,
        before={"slug": before},
        after={"slug": slug},
    )
    return row


# --- Private -----------------------------------------------------------------------------------


def _state(row: Scenario) -> dict[str, object]:
    return {
        "instruction": row.instruction,
        "type": row.type,
        "keep_traffic": row.keep_traffic,
        "density": row.traffic_density,
        "goal": row.goal,
    }
