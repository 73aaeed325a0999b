"""What calls took: how many, tokens and money, added up by augmentation or by contestant.

Unknown is None, never zero; who asks no language model has no entry.
"""

from __future__ import annotations

from dataclasses import dataclass

from django.db.models import BigIntegerField, Case, Count, F, Q, Sum, When
from django.db.models.functions import Coalesce

from augment.llm.costs import NANO_USD
from augment.models import Augmentation, ModelCall

AUGMENTATION = "attempt__augmentation"
CONTESTANT = "attempt__augmentation__contestant"


@dataclass(frozen=True, slots=True, kw_only=True)
class Spending:
    """What calls took together.

    An answer from the store counts as what it had cost when it was asked for: the question is
    what an outcome costs, not what this job or study did.

    Attributes:
        augmentations: How many of them asked a model.
        tokens: Prompt and completion, None where a call does not say.
        nano_usd: None where the price of a call is unknown.
    """

    augmentations: int
    calls: int
    tokens: int | None
    nano_usd: int | None

    @property
    def usd(self) -> float | None:
        """The same in dollars."""
        return None if self.nano_usd is None else self.nano_usd / NANO_USD


def sum_spending(which: Q, *, by: str) -> dict[int, Spending]:
    """The calls of attempts that came to an outcome; what was never sent is no call. One query.

    Args:
        which: Of all calls.
        by: AUGMENTATION or CONTESTANT, whose primary keys are given.
    """
    tokens = Coalesce(
        F("served_from__prompt_tokens") + F("served_from__completion_tokens"),
        F("prompt_tokens") + F("completion_tokens"),
        # An endpoint that answered with an error used none, and that is known.
        Case(When(is_cost_estimated=False, served_from=None, then=F("spent_tokens"))),
        output_field=BigIntegerField(),
    )
    money = Coalesce("served_from__cost_nano_usd", "cost_nano_usd")
    rows = (
        ModelCall.objects.filter(
            Q(sent_at__isnull=False) | Q(served_from__isnull=False),
            which,
            attempt__outcome__in=[state.value for state in Augmentation.SHOWABLE],
        )
        .order_by()
        .values(who=F(by))
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
        row["who"]: Spending(
            augmentations=row["augmentations"],
            calls=row["calls"],
            tokens=row["tokens"] if row["with_tokens"] == row["calls"] else None,
            nano_usd=row["money"] if row["with_money"] == row["calls"] else None,
        )
        for row in rows
    }
