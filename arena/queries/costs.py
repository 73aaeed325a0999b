"""What the augmentations of a study took: calls, tokens and money, by contestant.

Unknown is None, never zero; a contestant that asks no language model has no line.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from django.db.models import BigIntegerField, Case, Count, F, Q, Sum, When
from django.db.models.functions import Coalesce

from arena.models import Study
from augment.models import Augmentation, Contestant, EndpointModel, ModelCall


@dataclass(frozen=True, slots=True, kw_only=True)
class Spent:
    """One contestant's calls over all augmentations that the study shows.

    An answer from the store counts as what it had cost when it was asked for: the question is
    what the contestant costs, not what this study did.

    Attributes:
        augmentations: How many of them asked a model.
        tokens: Prompt and completion, None where a call does not say.
        nano_usd: None where the price of a call is unknown.
    """

    augmentations: int
    calls: int
    tokens: int | None
    nano_usd: int | None


def shown_augmentations(study: Study) -> frozenset[int]:
    """The primary keys of all augmentations in the study's matchups; one query."""
    rows = study.matchups.order_by().values_list("left", "right").distinct()
    return frozenset(pk for pair in rows for pk in pair)


def spent_on(augmentations: Collection[int]) -> dict[int, Spent]:
    """By the contestant's primary key; one query. What was never sent is no call."""
    tokens = Coalesce(
        F("served_from__prompt_tokens") + F("served_from__completion_tokens"),
        F("prompt_tokens") + F("completion_tokens"),
        # An endpoint that answered with an error used none, and that is known.
        Case(When(is_cost_estimated=False, served_from=None, then=F("spent_tokens"))),
        output_field=BigIntegerField(),
    )
    money = Coalesce("served_from__cost_nano_usd", "cost_nano_usd")
    ended = [state.value for state in Augmentation.SHOWABLE]
    rows = (
        ModelCall.objects.filter(
            Q(sent_at__isnull=False) | Q(served_from__isnull=False),
            attempt__augmentation__in=augmentations,
            attempt__outcome__in=ended,
        )
        .order_by()
        .values(who=F("attempt__augmentation__contestant"))
        .annotate(
            augmentations=Count("attempt__augmentation", distinct=True),
            calls=Count("pk"),
            tokens=Sum(tokens),
            with_tokens=Count(tokens),
            money=Sum(money),
            with_money=Count(money),
        )
    )
    return {
        row["who"]: Spent(
            augmentations=row["augmentations"],
            calls=row["calls"],
            tokens=row["tokens"] if row["with_tokens"] == row["calls"] else None,
            nano_usd=row["money"] if row["with_money"] == row["calls"] else None,
        )
        for row in rows
    }


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
