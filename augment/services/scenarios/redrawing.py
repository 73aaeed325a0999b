"""Pictures of an earlier look or window, drawn anew: all of a scenario or none of it."""

from __future__ import annotations

from collections.abc import Callable

from django.db import transaction

from augment.models import Augmentation, Scenario
from augment.scene.codec import modification_from_document
from augment.scene.modification import Modification
from augment.services.scenarios.pictures import (
    camera_of,
    original_picture,
    picture_of,
    window_of,
)
from augment.services.scenarios.scenes import scene_of


def redraw(scenario: Scenario, *, is_free: Callable[[], bool] = lambda: True) -> int | None:
    """Draw what was drawn in another window than today's; the old files stay where they are.

    Call it from a worker or a command, not in a request.

    Args:
        scenario: Whose pictures are drawn.
        is_free: Asked once all are drawn, with the scenario held: whether nobody needs the old
            ones, which drawing may have taken too long for.

    Returns:
        How many augmentations have a new picture; None where the old ones are needed.

    Raises:
        InvalidDocument: What is stored can't be read.
        InvalidModification: A modification does not fit the scene.
    """
    if not is_outdated(scenario):
        return 0
    scene, key = scene_of(scenario), camera_of(scenario).key
    rows = scenario.augmentations.exclude(image="").only("image", "state", "modification")
    outdated = [row for row in rows if window_of(row.image) != key]
    drawn = [(row, picture_of(scenario, scene, _shown(row))) for row in outdated]
    with transaction.atomic():
        Scenario.objects.select_for_update(no_key=True).get(pk=scenario.pk)
        if not is_free():
            return None
        original_picture(scenario)
        for row, name in drawn:
            Augmentation.objects.filter(pk=row.pk, image=row.image).update(image=name)
    return len(drawn)


def is_outdated(scenario: Scenario) -> bool:
    """Whether any of its pictures shows another window than today's.

    Raises:
        InvalidDocument: The stored scene or reference can't be read.
    """
    key = camera_of(scenario).key
    images = scenario.augmentations.exclude(image="").values_list("image", flat=True)
    own = [scenario.original_image] if scenario.original_image else []
    return any(window_of(image) != key for image in (*own, *images))


def _shown(row: Augmentation) -> Modification:
    """What its picture shows: an answer that could not be read changes nothing."""
    if row.state != Augmentation.State.DONE or row.modification is None:
        return Modification()
    return modification_from_document(row.modification)
