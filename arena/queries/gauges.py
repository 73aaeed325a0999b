"""What a monitoring system reads, counted in the rows: the same whichever process is asked.

Nothing of it is a result: votes are counted by study state, never by contestant or outcome.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from django.apps import apps
from django.db.models import Count, QuerySet, Sum

from arena.models import Matchup, Study, Vote
from augment.models import GenerationJob, ModelCall, Work
from augment.services.running.workers import workforce

NANO = 1e9
"""Money is counted in whole nano-dollars."""

Labelled = tuple[tuple[str, float], ...]


@dataclass(frozen=True, slots=True)
class Gauge:
    """A number for each value of one label, or one number where there is no label."""

    name: str
    help: str
    label: str
    values: Labelled


def read_gauges() -> list[Gauge]:
    """All of them: sixteen queries."""
    found = workforce()
    votes = Vote.objects.exclude(outcome=Vote.Outcome.SKIP)
    return [
        Gauge("arena_workers", "Workers heard a moment ago", "", (("", found.living),)),
        Gauge("arena_recovery", "1 where lost work is brought back", "", (("", found.works),)),
        _count("arena_jobs", "Generation jobs", GenerationJob.objects.all(), "state"),
        *(_work(model) for model in apps.get_models() if issubclass(model, Work)),
        _count("arena_studies", "Studies", Study.objects.all(), "state"),
        _count("arena_matchups", "Planned pairs", Matchup.objects.all(), "study__state"),
        _count("arena_votes", "Votes kept", votes, "matchup__study__state"),
        *_calls(),
    ]


def _work(model: type[Work]) -> Gauge:
    """Rows of one kind of work."""
    plural = str(model._meta.verbose_name_plural)
    name = f"arena_{plural.replace(' ', '_')}"
    return _count(name, plural.capitalize(), model._default_manager.all(), "state")


def _count(name: str, text: str, rows: QuerySet[Any], field: str) -> Gauge:
    counted = rows.order_by().values_list(field).annotate(Count("pk")).order_by(field)
    return Gauge(name, text, "state", tuple((str(value), number) for value, number in counted))


def _calls() -> list[Gauge]:
    """What models were asked: copies from the store are none, calls in flight are apart."""
    own = ModelCall.objects.filter(served_from__isnull=True).order_by()
    flying = own.filter(settled_at__isnull=True).count()
    settled = own.filter(settled_at__isnull=False)
    faulty = settled.exclude(fault="").count()
    sums = settled.aggregate(
        calls=Count("pk"), nano=Sum("cost_nano_usd"), used=Sum("spent_tokens")
    )
    states = (("answered", sums["calls"] - faulty), ("failed", faulty), ("in_flight", flying))
    return [
        Gauge("arena_model_calls", "Requests to language models", "state", states),
        Gauge("arena_model_tokens", "Tokens used", "", (("", sums["used"] or 0),)),
        Gauge(
            "arena_model_usd",
            "Dollars spent, as far as prices are known",
            "",
            (("", (sums["nano"] or 0) / NANO),),
        ),
    ]
