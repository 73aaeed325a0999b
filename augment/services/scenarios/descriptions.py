"""What the pictures of augmentations show, as values that a page can put into words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from functools import cache
from typing import Any

from augment.models import Augmentation, Scenario
from augment.render.description import describe
from augment.scene.codec import modification_from_document
from augment.scene.entities import Modification
from augment.services.scenarios.scenes import scene_of

Description = list[dict[str, Any]]
"""The lines of augment.render.description, ready to be stored."""


def descriptions(
    *, augmentations: Iterable[int], scenarios: Mapping[int, Scenario]
) -> dict[int, Description]:
    """The description of each augmentation, by its key; one query.

    One without a modification has the picture of the unchanged scene, and the empty description.

    Args:
        augmentations: Keys.
        scenarios: Theirs by key, with their base scenes.

    Raises:
        InvalidDocument: A stored scene or modification can't be read.
    """
    scene = cache(lambda key: scene_of(scenarios[key]))
    rows = Augmentation.objects.filter(pk__in=set(augmentations)).order_by()
    by_pk = {}
    for key, scenario, document in rows.values_list("pk", "scenario", "modification"):
        change = Modification() if document is None else modification_from_document(document)
        by_pk[key] = [asdict(line) for line in describe(scene(scenario), change)]
    return by_pk
