"""Which augmentations of one scenario differ by so little that nobody can tell them apart."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

from augment.metrics.displacement import are_alike
from augment.models import Augmentation
from augment.scene.codec import modification_from_document
from augment.scene.entities import Modification


def alike_pairs(cells: Mapping[tuple[str, str], Augmentation]) -> tuple[tuple[str, str, str], ...]:
    """Pairs of contestants whose changes of a scenario are alike.

    Args:
        cells: By scenario (or sample of one) and contestant what is shown. An answer that could
            not be read shows the unchanged scene.

    Returns:
        (scenario, contestant, contestant), sorted; identical pictures are among them.

    Raises:
        InvalidDocument: A stored modification can't be read.
    """
    keys = [row.pk for row in cells.values()]
    kept = Augmentation.objects.filter(pk__in=keys).values_list("pk", "state", "modification")
    read = {pk: _shown(state, document) for pk, state, document in kept.iterator()}
    by_scenario: dict[str, list[tuple[str, Modification | None]]] = {}
    for scenario, contestant in sorted(cells):
        change = read[cells[scenario, contestant].pk]
        by_scenario.setdefault(scenario, []).append((contestant, change))
    return tuple(
        (scenario, first, second)
        for scenario, sides in by_scenario.items()
        for (first, one), (second, other) in combinations(sides, 2)
        if one is not None and other is not None and are_alike(one, other)
    )


def _shown(state: str, document: object) -> Modification | None:
    """The change that the picture shows; None where nothing says what that is."""
    if state != Augmentation.State.DONE:
        return Modification()
    return modification_from_document(document) if document else None
