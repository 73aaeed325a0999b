"""Budget of a job's or judge's calls: reserved before, settled after each.

    spent + reserved + worst case <= cap

holds for every cap whenever a call is sent, with any number of workers: the database compares and
adds in one conditional UPDATE. A call that ends moves its reservation into what is spent. A call
whose end nobody saw counts with its worst case if it was sent, and for nothing if it was not.
"""

from collections.abc import Collection
from dataclasses import dataclass
from decimal import Decimal
from enum import StrEnum
from typing import Any

from django.db import transaction
from django.db.models import F, Q, QuerySet

from augment.errors import Conflict, ModelFault, NotSent
from augment.llm.costs import Price, WorstCase, to_nano_usd
from augment.llm.messages import Reply
from augment.models import CappedWork, GenerationJob, JudgeRun, ModelCall
from augment.services import clock, events, inputs

State = GenerationJob.State

Budgets = QuerySet[GenerationJob] | QuerySet[JudgeRun]
"""The one row whose caps count; both have the states of a job that runs, and that is stopped."""

HIGHEST_USD = Decimal(1_000_000)
HIGHEST_CALLS = 2_000_000_000
HIGHEST_TOKENS = 10**15

_COUNTED = (
    *("reserved_tokens", "reserved_nano_usd"),
    *("spent_tokens", "cost_nano_usd", "settled_at", "sent_at"),
)


class Room(StrEnum):
    """Answer to a job's request for one more call."""

    TAKEN = "taken"
    BUSY = "busy"
    SPENT = "spent"


@dataclass(frozen=True, slots=True, kw_only=True)
class Usage:
    """Tokens and cost of a call.

    Attributes:
        nano_usd: None where the price is unknown.
        is_estimated: Whether the worst case stands in for an unknown usage.
        calls: 1, or 0 where nothing was sent.
    """

    tokens: int
    nano_usd: int | None
    is_estimated: bool
    calls: int = 1


_NOTHING = Usage(tokens=0, nano_usd=0, is_estimated=False, calls=0)


@dataclass(frozen=True, kw_only=True)
class Caps:
    """Caps of a job; None is no cap. Of several, the first that is reached counts."""

    cap_usd: Decimal | None = inputs.input_field(
        inputs.InputKind.DECIMAL,
        "USD that language models may cost at most",
        "Needs the price of every model.",
        default=None,
        least=Decimal("1e-9"),
        most=HIGHEST_USD,
    )
    cap_calls: int | None = inputs.input_field(
        inputs.InputKind.WHOLE,
        "Calls to language models at most",
        default=None,
        least=1,
        most=HIGHEST_CALLS,
    )
    cap_tokens: int | None = inputs.input_field(
        inputs.InputKind.WHOLE,
        "Tokens at most, in and out together",
        default=None,
        least=1,
        most=HIGHEST_TOKENS,
    )

    def columns(self) -> dict[str, int]:
        """Return the given caps as columns of a job.

        Raises:
            InvalidDocument: A cap is nothing or less, or too high to be counted to.
        """
        inputs.check_bounds(self)
        usd = None if self.cap_usd is None else to_nano_usd(self.cap_usd)
        columns = {"cap_nano_usd": usd, "cap_calls": self.cap_calls, "cap_tokens": self.cap_tokens}
        return {name: value for name, value in columns.items() if value is not None}


NO_CAPS = Caps()


@transaction.atomic(savepoint=False)
def reserve(*, jobs: Budgets, worst: WorstCase, price: Price | None) -> Room:
    """Reserve room for one call, or stop the job if it could never have any.

    Args:
        jobs: The job, or the run of a judge, that the call is for.
        worst: What the call may use.
        price: Of its model, None where it is unknown.

    Returns:
        TAKEN: The worst case is reserved. BUSY: calls in flight hold the room and may leave some
        when they end. SPENT: even alone the call could pass a cap; the job is stopped.

    Raises:
        Conflict: The job is capped in USD and the price is unknown.
    """
    nano_usd = worst.nano_usd(price)
    fitting = jobs.filter(_within_caps(worst, nano_usd, with_reserved=True))
    if fitting.exclude(state=State.STOPPED_AT_CAP).update(
        reserved_nano_usd=F("reserved_nano_usd") + (nano_usd or 0),
        reserved_calls=F("reserved_calls") + 1,
        reserved_tokens=F("reserved_tokens") + worst.tokens,
    ):
        return Room.TAKEN
    if nano_usd is None and jobs.exclude(cap_nano_usd=None).exists():
        raise Conflict("There is a cap in USD, but the price of the model is unknown.")
    alone = _within_caps(worst, nano_usd, with_reserved=False)
    if jobs.filter(state=State.RUNNING).exclude(alone).update(state=State.STOPPED_AT_CAP):
        job = jobs.get()
        events.log_change(
            job,
            "stop",
            before={"state": State.RUNNING.value},
            after={"state": State.STOPPED_AT_CAP.value, "cap": describe_caps(job)},
        )
    has_room = jobs.filter(alone).exclude(state=State.STOPPED_AT_CAP).exists()
    return Room.BUSY if has_room else Room.SPENT


@transaction.atomic(savepoint=False)
def settle(
    *, call: ModelCall, used: Usage, now: clock.Moment, answer: dict[str, Any] | None = None
) -> None:
    """Turn a call's reservation into what it used, and store the columns of its answer with it.

    A call that was settled because its worker was thought dead is corrected.

    Args:
        call: As it was in flight.
        used: What it used.
        now: When it ended.
        answer: Columns that keep the answer.
    """
    columns = {
        "spent_tokens": used.tokens,
        "cost_nano_usd": used.nano_usd,
        "is_cost_estimated": used.is_estimated,
        "settled_at": now,
        **(answer or {}),
    }
    rows = ModelCall.objects.filter(pk=call.pk)
    # The job's row last: all calls of a job wait for it until the transaction ends.
    if not rows.filter(settled_at=None).update(**columns):
        # Not the request and the answer, which are long.
        call = rows.select_for_update().only("attempt_id", "judgement_id", *_COUNTED).get()
        rows.update(**columns)
    job = _find_budgets(call)
    if job is None:
        return  # a reading sums up its calls itself
    if call.settled_at is None:
        job.update(
            reserved_nano_usd=F("reserved_nano_usd") - (call.reserved_nano_usd or 0),
            reserved_calls=F("reserved_calls") - 1,
            reserved_tokens=F("reserved_tokens") - call.reserved_tokens,
            spent_nano_usd=F("spent_nano_usd") + (used.nano_usd or 0),
            spent_calls=F("spent_calls") + used.calls,
            spent_tokens=F("spent_tokens") + used.tokens,
        )
    else:
        counted = _settle_unseen(call).calls
        job.update(
            spent_nano_usd=F("spent_nano_usd") + (used.nano_usd or 0) - (call.cost_nano_usd or 0),
            spent_calls=F("spent_calls") + used.calls - counted,
            spent_tokens=F("spent_tokens") + used.tokens - (call.spent_tokens or 0),
        )


@transaction.atomic(savepoint=False)
def settle_unseen(*, now: clock.Moment, of: Q) -> None:
    """Settle those calls that are still in flight; the worker of their row is gone.

    What was sent may have been answered and billed, so its worst case counts. What still waited
    for its place was not sent, and can't be any more: see `CallTranscript.sending`.
    """
    # Locked, so that none is sent between the look at it and its settlement.
    calls = ModelCall.objects.select_for_update(of=("self",)).filter(settled_at=None)
    for call in calls.filter(of).only("attempt_id", "judgement_id", *_COUNTED):
        fault = "nobody saw the end: its worker stopped"
        if call.sent_at is None:
            fault = "not sent: its worker stopped while it waited for a place"
        settle(call=call, used=_settle_unseen(call), now=now, answer={"fault": fault})


def settle_reply(reply: Reply, *, worst: WorstCase, price: Price | None) -> Usage:
    """Return the use of an answered call; its worst case if the server does not say."""
    prompt, completion = reply.prompt_tokens, reply.completion_tokens
    seen = WorstCase(
        prompt_tokens=worst.prompt_tokens if prompt is None else prompt,
        completion_tokens=worst.completion_tokens if completion is None else completion,
        cached_tokens=reply.cached_tokens or 0,
    )
    return Usage(
        tokens=seen.tokens,
        nano_usd=seen.nano_usd(price),
        is_estimated=prompt is None or completion is None,
    )


def settle_fault(fault: ModelFault, *, worst: WorstCase, price: Price | None) -> Usage:
    """Return the use of a call without an answer.

    An endpoint that answers with an error, or was not asked at all, bills nothing. A time-out, a
    broken connection or an answer that is none may be billed all the same.
    """
    if isinstance(fault, NotSent):
        return _NOTHING
    if fault.status is not None and fault.status >= 400:
        return Usage(tokens=0, nano_usd=0, is_estimated=False)
    return Usage(tokens=worst.tokens, nano_usd=worst.nano_usd(price), is_estimated=True)


def describe_caps(job: CappedWork) -> str:
    """Return the caps of a job as a person reads them."""
    caps = {
        "USD": None if job.cap_usd is None else f"{job.cap_usd.normalize():f}",
        "calls": job.cap_calls,
        "tokens": job.cap_tokens,
    }
    return ", ".join(f"{cap} {unit}" for unit, cap in caps.items() if cap is not None) or "nothing"


def cap_columns(caps: Caps, unpriced: Collection[str]) -> dict[str, int]:
    """Return the caps as columns; `unpriced` names the models whose price nobody knows.

    Raises:
        InvalidDocument: A cap can't be.
        Conflict: There is one in USD and an unknown price.
    """
    columns = caps.columns()
    if caps.cap_usd is not None and unpriced:
        raise Conflict(
            f"A cap in USD needs prices, and nobody knows that of {', '.join(unpriced)}: cap "
            "the job by calls or tokens instead, or enter the price at the endpoint."
        )
    return columns


def raise_caps(job: GenerationJob, caps: Caps) -> None:
    """Raise the caps that are given; the others stay.

    Raises:
        InvalidDocument: A cap can't be.
        Conflict: A cap would not be higher than it is.
    """
    columns = caps.columns()
    for name, value in columns.items():
        current = getattr(job, name)
        if current is None or value <= current:
            raise Conflict(
                f"Only a cap that the job has is raised, and must be higher: {describe_caps(job)}."
            )
        setattr(job, name, value)
    job.save(update_fields=list(columns))


def count_unpriced(job: GenerationJob) -> int:
    """Count the calls of a job that were paid for and whose price is unknown."""
    calls = ModelCall.objects.filter(attempt__augmentation__job=job, cost_nano_usd=None)
    return calls.filter(served_from=None, sent_at__isnull=False, settled_at__isnull=False).count()


# --- Private -----------------------------------------------------------------------------------


def _find_budgets(call: ModelCall) -> Budgets | None:
    """Return the row whose caps a call counts against; None where it is a reading's."""
    if call.attempt_id is not None:
        return GenerationJob.objects.filter(augmentations__attempts=call.attempt_id)
    if call.judgement_id is not None:
        return JudgeRun.objects.filter(judgements=call.judgement_id)
    return None


def _settle_unseen(call: ModelCall) -> Usage:
    """Return the use of a call whose end nobody saw."""
    if call.sent_at is None:
        return _NOTHING
    return Usage(tokens=call.reserved_tokens, nano_usd=call.reserved_nano_usd, is_estimated=True)


def _within_caps(worst: WorstCase, nano_usd: int | None, *, with_reserved: bool) -> Q:
    """Match jobs that one more such call fits into; a cap in USD admits no unknown price."""
    condition = Q()
    for name, needed in (("nano_usd", nano_usd), ("calls", 1), ("tokens", worst.tokens)):
        fits = Q(**{f"cap_{name}": None})
        if needed is not None:
            used = F(f"spent_{name}") + needed
            if with_reserved:
                used += F(f"reserved_{name}")
            fits |= Q(**{f"cap_{name}__gte": used})
        condition &= fits
    return condition
