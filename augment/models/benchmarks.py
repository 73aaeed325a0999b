"""Benchmark sets: scenarios that are handed out as a folder, version by version."""

from django.db import models
from django.db.models import Q

from augment.models.scenes import RETIRED_HELP, SLUG_HELP, Scenario
from augment.models.work import CodedModel, account_column


class Benchmark(CodedModel):
    """One version of a benchmark set; its name and version together never change."""

    slug = models.SlugField(max_length=80, help_text=SLUG_HELP)
    title = models.CharField(max_length=120)
    version = models.PositiveIntegerField(help_text="from 1")
    checksum = models.CharField(max_length=64, help_text="SHA-256 of what entrants get")
    made_on = models.DateField()
    made_by = account_column(on_delete=models.SET_NULL)
    retired_at = models.DateTimeField(null=True, blank=True, help_text=RETIRED_HELP)
    created_at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("slug", "-version")
        constraints = (
            models.UniqueConstraint(
                name="one_benchmark_a_name_and_version", fields=("slug", "version")
            ),
            models.CheckConstraint(
                name="benchmark_versions_count_from_one", condition=Q(version__gte=1)
            ),
        )

    def __str__(self) -> str:
        return f"{self.slug}@{self.version}"


class BenchmarkItem(models.Model):
    """A scenario of a benchmark set."""

    benchmark = models.ForeignKey(Benchmark, on_delete=models.CASCADE, related_name="items")
    scenario = models.ForeignKey(
        Scenario, on_delete=models.PROTECT, related_name="benchmark_items"
    )
    position = models.PositiveIntegerField(help_text="from 1")
    split = models.CharField(max_length=10, help_text="practice or test")
    stratum = models.CharField(max_length=10, help_text="easy, medium or hard")

    class Meta:
        ordering = ("benchmark", "position")
        constraints = (
            models.UniqueConstraint(
                name="a_benchmark_holds_a_scenario_once", fields=("benchmark", "scenario")
            ),
            models.UniqueConstraint(
                name="one_position_an_item_of_a_benchmark", fields=("benchmark", "position")
            ),
            models.CheckConstraint(
                name="benchmark_item_is_of_a_known_split_and_stratum",
                condition=Q(
                    split__in=["practice", "test"], stratum__in=["easy", "medium", "hard"]
                ),
            ),
        )

    def __str__(self) -> str:
        return f"{self.benchmark}: {self.scenario}"
