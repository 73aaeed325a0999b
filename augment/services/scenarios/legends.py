"""What the legend beside a pair names: the kinds of marks that its two pictures hold."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from augment.models import Augmentation, Scenario
from augment.render.legend import change_keys, scene_keys
from augment.scene.codec import modification_from_document
from augment.services.scenarios.scenes import scene_of


def legend_of_scene(scenario: Scenario, view: Mapping[str, Any]) -> list[str]:
    """Return the entries for what a window of a scenario shows before any change.

    Raises:
        InvalidDocument: The stored scene can't be read.
    """
    return sorted(scene_keys(scene_of(scenario), view))


def legends_of_changes(views: Mapping[int, Mapping[str, Any]]) -> dict[int, set[str]]:
    """Return the entries for what each augmentation adds, by its key; one query.

    Args:
        views: By the keys of augmentations, where metres lie in their pictures.

    Raises:
        InvalidDocument: A stored modification can't be read.
    """
    rows = Augmentation.objects.filter(pk__in=views.keys()).order_by()
    return {
        key: set()
        if not document
        else change_keys(modification_from_document(document), views[key])
        for key, document in rows.values_list("pk", "modification")
    }
