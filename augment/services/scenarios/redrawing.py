"""Pictures of an earlier look or window, drawn anew: all of a scenario or none of it."""

from __future__ import annotations

from django.db import transaction

from augment.models import Augmentation, Scenario
from augment.scene.codec import modification_from_document
from augment.scene.entities import Modification
from augment.services.scenarios.pictures import camera_of, original_picture, picture_of, window_of
from augment.services.scenarios.scenes import scene_of


def redraw(scenario: Scenario) -> int:
    """Draw what shows another window than today's, until nothing does.

    Old files stay where they are and rows keep their names, for the studies that show them.
    Call it from a worker or a command, not in a request.

    Returns:
        How many augmentations have a new picture.

    Raises:
        InvalidDocument: What is stored can't be read.
        InvalidModification: A modification does not fit the scene.
    """
    redrawn = 0
    # Another worker may store a change that widens the window while this one draws.
    while outdated := _find_outdated(scenario):
        redrawn += _redraw_rows(scenario, outdated)
    original_picture(scenario)
    return redrawn


# --- Private -----------------------------------------------------------------------------------


def _find_outdated(scenario: Scenario) -> list[Augmentation]:
    key = camera_of(scenario).key
    rows = scenario.augmentations.exclude(image="")
    rows = rows.only("image", "earlier_images", "state", "modification")
    return [row for row in rows if window_of(row.image) != key]


def _redraw_rows(scenario: Scenario, outdated: list[Augmentation]) -> int:
    scene, camera = scene_of(scenario), camera_of(scenario)
    drawn = [(row, picture_of(scene, _shown(row), camera)) for row in outdated]
    with transaction.atomic():
        Scenario.objects.select_for_update(no_key=True).get(pk=scenario.pk)
        original_picture(scenario)
        return sum(
            Augmentation.objects.filter(pk=row.pk, image=row.image).update(
                image=name, earlier_images=[*row.earlier_images, row.image]
            )
            for row, name in drawn
        )


def _shown(row: Augmentation) -> Modification:
    """What its picture shows: an answer that could not be read changes nothing."""
    if row.state != Augmentation.State.DONE or not row.modification:
        return Modification()
    return modification_from_document(row.modification)
