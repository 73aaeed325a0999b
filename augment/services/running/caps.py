"""The caps of a job: what it may use at most, raised by people and by nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal

from django.contrib.auth.models import User
from django.db import transaction

from augment.errors import Conflict
from augment.llm.costs import nano_usd_of
from augment.models import Contestant, GenerationJob
from augment.services.endpoints.known_models import list_unpriced_models
from augment.services.events import log_event
from augment.services.running.budget import limit_of, limits_of

State = GenerationJob.State

HIGHEST_USD = Decimal(1_000_000)
HIGHEST_CALLS = 2_000_000_000
HIGHEST_TOKENS = 10**15


@dataclass(frozen=True, slots=True, kw_only=True)
class Caps:
    """What a job may use at most; None is no cap. Of several, the first that is reached counts."""

    usd: Decimal | None = None
    calls: int | None = None
    tokens: int | None = None

    def columns(self) -> dict[str, int]:
        """Those that there are, as columns of a job.

        Raises:
            Conflict: A cap is nothing or less, or too high to be counted to.
        """
        given: dict[str, int] = {}
        if self.usd is not None:
            if not (self.usd.is_finite() and Decimal(0) < self.usd <= HIGHEST_USD):
                raise Conflict(f"A cap in USD is more than 0 and at most {HIGHEST_USD}.")
            given["cap_nano_usd"] = nano_usd_of(self.usd)
        for name, value, highest in (
            ("calls", self.calls, HIGHEST_CALLS),
            ("tokens", self.tokens, HIGHEST_TOKENS),
        ):
            if value is None:
                continue
            if not 0 < value <= highest:
                raise Conflict(f"A cap in {name} is more than 0 and at most {highest}.")
            given[f"cap_{name}"] = value
        return given


NO_CAPS = Caps()


def check_caps(caps: Caps, contestants: Sequence[Contestant]) -> dict[str, int]:
    """The caps as columns of a new job.

    Raises:
        Conflict: A cap can't be, or there is one in USD and a price that nobody knows.
    """
    columns = caps.columns()
    unknown = list_unpriced_models(contestants) if caps.usd is not None else []
    if unknown:
        raise Conflict(
            f"A cap in USD needs prices, and nobody knows that of {', '.join(unknown)}: cap "
            "the job by calls or tokens instead, or enter the price at the endpoint."
        )
    return columns


def over_already(job: GenerationJob) -> str:
    """Why nothing can be changed at a job that has ended."""
    state = job.get_state_display().lower()
    return f"Job '{job.name}' is {state} already."


@transaction.atomic
def raise_cap(job: GenerationJob, *, caps: Caps, actor: User | None = None) -> GenerationJob:
    """Raise the caps that are given; the others stay. What stopped waits on until `resume`.

    Raises:
        Conflict: Nothing is given, a cap would not be higher than it is, or the job is over.
    """
    columns = caps.columns()
    if not columns:
        raise Conflict("Say which cap to raise, and to what.")
    job = GenerationJob.objects.select_for_update().get(pk=job.pk)
    if job.state not in (State.RUNNING, *GenerationJob.HELD):
        raise Conflict(over_already(job))
    before, limits = limit_of(job), limits_of(job)
    for name, value in columns.items():
        held = getattr(job, name)
        if held is None:
            raise Conflict(f"Job '{job.name}' has no such cap; its cap is {', '.join(limits)}.")
        if value <= held:
            raise Conflict(f"The new cap must be higher than the one of {', '.join(limits)}.")
        setattr(job, name, value)
    job.save(update_fields=list(columns))
    log_event(
        actor=actor,
        verb="raise cap",
        object_kind="job",
        object_code=job.code,
        before={"cap": before},
        after={"cap": limit_of(job)},
    )
    return job
