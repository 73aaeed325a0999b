"""Deleting scenarios and scenes that nothing depends on."""

from __future__ import annotations

from collections.abc import Iterable

from django.contrib.auth.models import User
from django.db import transaction

from augment.errors import Conflict
from augment.models import BaseScene, Scenario
from augment.services.events import log_event

MOST_NAMED = 8


@transaction.atomic
def delete_scenario(scenario: Scenario, *, actor: User | None = None) -> None:
    """Delete a scenario that no job, study, drive or other wording needs.

    Raises:
        Conflict: Something does; the text names it.
    """
    Scenario.objects.select_for_update(of=("self",)).get(pk=scenario.pk)
    refuse_needed_scenario(scenario, "deleted")
    _log_deletion("scenario", scenario, actor)
    scenario.delete()


@transaction.atomic
def delete_scene(scene: BaseScene, *, actor: User | None = None) -> None:
    """Delete a scene that no scenario stands on.

    Raises:
        Conflict: Some do; the text names them.
    """
    BaseScene.objects.select_for_update().only("pk").get(pk=scene.pk)
    refuse_needed_scene(scene, "deleted")
    _log_deletion("scene", scene, actor)
    scene.delete()


def refuse_needed_scenario(scenario: Scenario, what: str) -> None:
    """Do nothing where no job, study, drive or other wording needs a scenario.

    Args:
        scenario: Locked by the caller.
        what: What it is not to be: deleted, changed.

    Raises:
        Conflict: Something does; the text names it.
    """
    drives = scenario.simulations.count()
    needed_by = [
        *(f"the job “{job.name}”" for job in scenario.jobs.order_by("pk")),
        *(f"the study “{study.name}”" for study in scenario.studies.order_by("pk")),
        *(f"its other wording “{row.slug}”" for row in scenario.paraphrases.order_by("slug")),
        *([f"{drives} drives"] if drives else []),
    ]
    _refuse_needed(scenario.slug, needed_by, what)


def refuse_needed_scene(scene: BaseScene, what: str) -> None:
    """Do nothing where no scenario stands on a scene.

    Raises:
        Conflict: Some do; the text names them.
    """
    slugs = scene.scenarios.order_by("slug").values_list("slug", flat=True)
    _refuse_needed(scene.slug, [f"the scenario “{slug}”" for slug in slugs], what)


# --- Private -----------------------------------------------------------------------------------


def _refuse_needed(slug: str, needed_by: list[str], what: str) -> None:
    if not needed_by:
        return
    more = len(needed_by) - MOST_NAMED
    named = [*needed_by[:MOST_NAMED], *([f"{more} more"] if more > 0 else [])]
    raise Conflict(f"“{slug}” can’t be {what}; it is needed by {_listed(named)}.")


def _listed(names: Iterable[str]) -> str:
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def _log_deletion(kind: str, row: Scenario | BaseScene, actor: User | None) -> None:
    log_event(
        actor=actor,
        verb="delete",
        object_kind=kind,
        object_code=row.code,
        before={"slug": row.slug},
    )
