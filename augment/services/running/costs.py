"""What a job has used, as far as it is known: a cost that nobody knows is not zero."""

from __future__ import annotations

from dataclasses import dataclass

from django.db.models import Count, Q

from augment.models import GenerationJob, ModelCall

_PAID = Q(served_from=None, sent_at__isnull=False, settled_at__isnull=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class JobCosts:
    """The calls of a job by what is known of their cost.

    Attributes:
        paid: Calls that were sent and ended; those from the store are not among them.
        priced: Those of them that used something whose price is known.
        unpriced: Those of them whose price is unknown.
        estimated: Those of them that count with their worst case, because usage is unknown.
        cached: Calls that were answered from the store.
    """

    paid: int
    priced: int
    unpriced: int
    estimated: int
    cached: int

    @property
    def is_money_unknown(self) -> bool:
        """Whether nothing can be said about money."""
        return self.unpriced > 0 == self.priced


def costs_of(job: GenerationJob) -> JobCosts:
    """By one query."""
    return JobCosts(
        **ModelCall.objects.filter(attempt__augmentation__job=job).aggregate(
            paid=Count("pk", filter=_PAID),
            priced=Count("pk", filter=_PAID & Q(cost_nano_usd__isnull=False, spent_tokens__gt=0)),
            unpriced=Count("pk", filter=_PAID & Q(cost_nano_usd=None)),
            estimated=Count("pk", filter=_PAID & Q(is_cost_estimated=True)),
            cached=Count("pk", filter=Q(served_from__isnull=False)),
        )
    )
