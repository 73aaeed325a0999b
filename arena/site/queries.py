"""Reads of the whole site: gauges for monitoring, and what failed."""

from collections.abc import Iterator, Mapping
from typing import Any

from django.apps import apps
from django.db.models import Count, QuerySet, Sum
from prometheus_client.core import GaugeMetricFamily

from arena.models import Matchup, Study, Vote
from augment import models
from augment.services.running import workforce

NANO = 1e9
"""Money is counted in whole nano-dollars."""


def read_gauges() -> Iterator[GaugeMetricFamily]:
    """Yield what a monitoring system reads, counted in the rows whichever process is asked.

    Nothing of it is a result: votes are counted by study state, never by contestant or outcome.
    """
    state = workforce()
    yield GaugeMetricFamily("arena_workers", "Workers heard a moment ago", state.living)
    yield GaugeMetricFamily("arena_recovery", "1 where lost work is brought back", state.works)
    counted: list[tuple[str, str, QuerySet[Any], str]] = [
        ("jobs", "Generation jobs", models.GenerationJob.objects.all(), "state"),
        ("studies", "Studies", Study.objects.all(), "state"),
        ("matchups", "Planned pairs", Matchup.objects.all(), "study__state"),
        (
            *("votes", "Votes kept", Vote.objects.exclude(outcome=Vote.Outcome.SKIP)),
            "matchup__study__state",
        ),
    ]
    for model in apps.get_models():
        if issubclass(model, models.Work):
            plural = str(model._meta.verbose_name_plural)
            rows = model._default_manager.all()
            counted.append((plural.replace(" ", "_"), plural.capitalize(), rows, "state"))
    for name, text, rows, field in counted:
        numbers = rows.order_by().values_list(field).annotate(Count("pk")).order_by(field)
        yield _by_state(f"arena_{name}", text, dict(numbers))
    # Copies from the store are no calls.
    own = models.ModelCall.objects.filter(served_from__isnull=True).order_by()
    settled = own.filter(settled_at__isnull=False)
    faulty = settled.exclude(fault="").count()
    sums = settled.aggregate(
        calls=Count("pk"), nano=Sum("cost_nano_usd"), used=Sum("spent_tokens")
    )
    calls = {
        "answered": sums["calls"] - faulty,
        "failed": faulty,
        "in_flight": own.filter(settled_at__isnull=True).count(),
    }
    yield _by_state("arena_model_calls", "Requests to language models", calls)
    yield GaugeMetricFamily("arena_model_tokens", "Tokens used", sums["used"] or 0)
    yield GaugeMetricFamily(
        "arena_model_usd", "Dollars spent, as far as prices are known", (sums["nano"] or 0) / NANO
    )


def _by_state(name: str, text: str, numbers: Mapping[Any, int]) -> GaugeMetricFamily:
    family = GaugeMetricFamily(name, text, labels=["state"])
    for state, number in numbers.items():
        family.add_metric([str(state)], number)
    return family


def count_failed() -> int:
    """Count augmentations that failed and can be tried again; nobody waits for a cancelled job."""
    failed = models.Augmentation.objects.filter(state=models.Augmentation.State.FAILED)
    return failed.exclude(job__state=models.GenerationJob.State.CANCELLED).count()
