"""What the augmentations of a study took: calls, tokens and money, by contestant.

Unknown is None, never zero; a contestant that asks no language model has no line.
"""

from __future__ import annotations

from collections.abc import Collection

from django.db.models import Q

from arena.models import Study
from arena.queries.remembering import Remembered, plan_of
from augment.models import Contestant, EndpointModel
from augment.services.endpoints.known_models import CONTESTANT, Spending, sum_spending


def shown_augmentations(study: Study) -> frozenset[int]:
    """The primary keys of all augmentations in the study's matchups; two queries at most."""
    return _SHOWN.get(plan_of(study), lambda: _shown(study))


def _shown(study: Study) -> frozenset[int]:
    rows = study.matchups.order_by().values_list("left", "right").distinct()
    return frozenset(pk for pair in rows for pk in pair)


_SHOWN: Remembered[frozenset[int]] = Remembered(8)


def spent_on(augmentations: Collection[int]) -> dict[int, Spending]:
    """By the contestant's primary key, over all augmentations that a study shows; one query."""
    return sum_spending(Q(attempt__augmentation__in=augmentations), by=CONTESTANT)


def model_classes(contestants: Collection[Contestant]) -> dict[int, str]:
    """The class of the model that modifies, by the contestant's primary key; one query."""
    asked = [row for row in contestants if row.endpoint_id is not None]
    wanted = Q(endpoint__in={row.endpoint_id for row in asked})
    known = {
        (endpoint, model): EndpointModel.ModelClass(classes).value
        for endpoint, model, classes in EndpointModel.objects.filter(wanted)
        .exclude(model_class="")
        .values_list("endpoint", "model", "model_class")
    }
    classes = {row.pk: known.get((row.endpoint_id or 0, row.model)) for row in asked}
    return {pk: name for pk, name in classes.items() if name is not None}
