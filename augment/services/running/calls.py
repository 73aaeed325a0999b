"""Every call to a language model as a row, within a budget, and the store of earlier answers.

The request is stored and its worst case reserved before it is sent, the answer stored before it
is read, each in a transaction of its own: a crash in between loses nothing that was paid for.
Faults are never served from the store; a served answer is served again from its source. A question
that is in flight for another row is not paid twice: its answer is waited for.
"""

import logging
import time
from collections.abc import Mapping
from dataclasses import asdict
from datetime import timedelta
from functools import partial
from typing import Any, NamedTuple

from django.conf import settings
from django.db import connection, transaction
from django.db.models import F, Q, QuerySet

from augment import errors
from augment.llm.costs import Price, WorstCase, worst_case
from augment.llm.messages import Reply, Request, ToolCall, image_reference, request_hash
from augment.models import Augmentation, GenerationJob, ModelCall, TranscriptNote
from augment.services import texts, work
from augment.services.clock import DATABASE_TIME
from augment.services.endpoints.contestants import Respondent
from augment.services.running import budget, workers
from augment.services.scenarios.pictures import store
from augment.variants.respondents import ModelRole, NoteKind

logger = logging.getLogger(__name__)

IMAGES = "asked"
"""The folder in the media storage of the images that models are shown."""

_COPIED = (
    *("answer", "refusal", "extras", "model_returned", "finish_reason"),
    *("prompt_tokens", "completion_tokens", "cached_tokens"),
)


class _CallInFlight(NamedTuple):
    row: ModelCall
    worst: WorstCase
    price: Price | None


def insist_wanted(held: work.Lease[Augmentation], *, lock: bool = False) -> None:
    """Return while the lease is held and its job is not cancelled.

    Raises:
        LeaseLost: Another worker has the row now.
        JobCancelled: Its job is cancelled.
    """
    rows = held.row.select_for_update(of=("self",)) if lock else held.row
    row = rows.only("pk").annotate(job_state=F("job__state")).first()
    if row is None:
        raise errors.LeaseLost
    if row.job_state == work.CANCELLED:
        raise errors.JobCancelled


class CallTranscript:
    """A transcript that writes calls as rows, one after the other.

    Args:
        held: The lease on the row that they are made for; once it is lost, nothing more is asked.
        owner: The column that says whose calls they are, with its value.
        respondents: Who is asked, by role.
        budgets: The one row whose caps count; None where the class has its own.
        key: What keeps its answers apart from those of other options and samples.
        numbers: How many calls the owner has already.
    """

    def __init__(
        self,
        held: work.Lease[Any],
        owner: Mapping[str, object],
        respondents: Mapping[ModelRole, Respondent],
        budgets: budget.Budgets | None = None,
        *,
        key: Mapping[str, object] | None = None,
        numbers: int = 0,
    ) -> None:
        self._held = held
        self._owner = owner
        self._respondents = respondents
        self._budgets = budgets
        self._key = key
        self._numbers = numbers
        self._in_flight: dict[int, _CallInFlight] = {}

    def insist(self) -> None:
        """Return while the calls are wanted; in a transaction the row is locked until its end.

        Raises:
            LeaseLost: Another worker has the row now.
            JobCancelled: Its job is cancelled.
        """
        if not self._held.is_held(lock=connection.in_atomic_block):
            raise errors.LeaseLost
        if self._budgets is not None and self._budgets.filter(state=work.CANCELLED).exists():
            raise errors.JobCancelled

    def reserve(self, worst: WorstCase, price: Price | None) -> budget.Room:
        """Take room for a call.

        Raises:
            Conflict: There is a cap in USD and the price is unknown.
        """
        assert self._budgets is not None
        return budget.reserve(jobs=self._budgets, worst=worst, price=price)

    def limit(self) -> str:
        """Return the cap that leaves no room, as a person reads it."""
        assert self._budgets is not None
        return budget.describe_caps(self._budgets.get())

    def note(self, kind: NoteKind, document: dict[str, object]) -> None:
        """Readings and judges have no rounds, tools or reviews to note."""

    def calls_with(self, request_hash: str) -> QuerySet[ModelCall]:
        """Return the calls whose answer may serve that request again, once they have one."""
        return ModelCall.objects.filter(request_hash=request_hash, served_from=None)

    def cached_reply(self, role: ModelRole, request: Request, prompt_version: str) -> Reply | None:
        """Return this request's earlier answer, recorded as a call that cost nothing.

        An answer that is on its way to another row is waited for.

        Raises:
            LeaseLost: Another worker has the row now.
            JobCancelled: Its job is cancelled.
            WorkerStopping: This worker is to stop.
        """
        columns = self._columns(role, request, prompt_version)
        useful = Q(answer__isnull=False, fault="") | _in_flight()
        alike = self.calls_with(columns["request_hash"]).filter(useful)
        alike = alike.alias(is_open=Q(settled_at=None)).order_by("is_open", "-pk")
        wait_s = work.FIRST_WAIT_S
        while (earlier := alike.first()) is not None and earlier.settled_at is None:
            workers.insist_on_going_on()
            with transaction.atomic():
                self.insist()
            time.sleep(wait_s)
            wait_s = min(1.5 * wait_s, work.LONGEST_WAIT_S)
        if earlier is None:
            return None
        with transaction.atomic():
            self.insist()
            ModelCall.objects.create(
                **columns,
                **{name: getattr(earlier, name) for name in _COPIED},
                number=self._numbers + 1,
                spent_tokens=0,
                cost_nano_usd=0,
                started_at=DATABASE_TIME,
                settled_at=DATABASE_TIME,
                served_from_id=earlier.served_from_id or earlier.pk,
            )
        self._numbers += 1
        return _read_reply(earlier)

    def record_request(self, role: ModelRole, request: Request, prompt_version: str) -> int:
        """Reserve the worst case of a request and store it; returns its number, from 1.

        Where calls in flight hold the room that this one needs, waits for them to end.

        Raises:
            LeaseLost: Another worker has the row now.
            JobCancelled: Its job is cancelled.
            BudgetSpent: The job has no room for the call, and is stopped.
            WorkerStopping: This worker is to stop; what it was answered so far is kept.
            Conflict: The job is capped in USD and the price is unknown.
            QuestionInFlight: Another row has just asked the same.
        """
        columns = self._columns(role, request, prompt_version)
        for message in request.messages:
            for png in message.images:
                store(png, folder=IMAGES)
        worst, price = worst_case(request), self._respondents[role].price
        wait_s = work.FIRST_WAIT_S
        while True:
            workers.insist_on_going_on()
            room, row = self._reserve_and_store(columns, worst, price)
            if row is not None:
                self._numbers += 1
                self._in_flight[self._numbers] = _CallInFlight(row, worst, price)
                return self._numbers
            if room == budget.Room.SPENT:
                raise errors.BudgetSpent(self.limit())
            time.sleep(wait_s)
            wait_s = min(1.5 * wait_s, work.LONGEST_WAIT_S)

    def sending(self, number: int) -> None:
        """Store that the call is sent now; from here on it may be billed.

        Raises:
            LeaseLost: Another worker took the row and settled the call as one that never was.
            WorkerStopping: It waited for its place for so long that this worker is to stop.
        """
        workers.insist_on_going_on()
        call = ModelCall.objects.filter(pk=self._in_flight[number].row.pk, settled_at=None)
        if not call.update(sent_at=DATABASE_TIME):
            raise errors.LeaseLost

    def record_reply(
        self, number: int, reply: Reply, fault: errors.ModelFault | None = None
    ) -> None:
        """Store the raw answer to that call and what it used.

        An answer with a fault is kept and paid for, but never served again.
        """
        call = self._in_flight.pop(number)
        # The fault also where there is none: the worker may have been thought dead meanwhile.
        fault_text = "" if fault is None else texts.make_storable(work.reason_sentence(fault))
        self._settle(
            call.row,
            budget.settle_reply(reply, worst=call.worst, price=call.price),
            _reply_columns(reply) | {"fault": fault_text},
        )

    def broke(self, number: int, fault: errors.ModelFault) -> None:
        """Store why there was no answer to that call, and what it may have used."""
        call = self._in_flight.pop(number)
        columns: dict[str, Any] = {"fault": texts.make_storable(work.reason_sentence(fault))}
        if isinstance(fault, errors.NotSent):
            columns["sent_at"] = None
        used = budget.settle_fault(fault, worst=call.worst, price=call.price)
        self._settle(call.row, used, columns)

    def _settle(self, call: ModelCall, used: budget.Usage, answer: dict[str, Any]) -> None:
        """Store how a call ended. It was paid for, so a locked database is waited out."""
        settle = partial(budget.settle, call=call, used=used, now=DATABASE_TIME, answer=answer)
        work.wait_out(settle)

    def _columns(self, role: ModelRole, request: Request, version: str) -> dict[str, Any]:
        """Return the columns of a call's row that describe the request."""
        document = texts.make_document_storable(request.to_document(image_url=image_reference))
        return {
            **self._owner,
            "role": role,
            "request": document,
            "request_hash": request_hash(
                base_url=self._respondents[role].endpoint.base_url,
                document=document,
                prompt_version=version,
                options=self._key,
            ),
            "prompt_version": version,
        }

    @transaction.atomic
    def _reserve_and_store(
        self, columns: dict[str, Any], worst: WorstCase, price: Price | None
    ) -> tuple[budget.Room, ModelCall | None]:
        """Take room and write the row in one transaction, or nothing of both."""
        self.insist()
        _hold_question(columns["request_hash"])
        if self.calls_with(columns["request_hash"]).filter(_in_flight()).exists():
            raise errors.QuestionInFlight
        room = self.reserve(worst, price)
        if room != budget.Room.TAKEN:
            return room, None
        call = ModelCall.objects.create(
            **columns,
            number=self._numbers + 1,
            started_at=DATABASE_TIME,
            reserved_tokens=worst.tokens,
            reserved_nano_usd=worst.nano_usd(price),
        )
        return room, call


class RowTranscript(CallTranscript):
    """The calls of one attempt at an augmentation, within the budget of its job.

    Args:
        held: The lease on the row; once it is lost, nothing more is asked.
        row: The augmentation, with its job.
        respondents: Who is asked.
    """

    def __init__(
        self,
        held: work.Lease[Augmentation],
        row: Augmentation,
        respondents: Mapping[ModelRole, Respondent],
        *,
        key: Mapping[str, object] | None = None,
    ) -> None:
        jobs = GenerationJob.objects.filter(pk=row.job_id)
        super().__init__(held, {"attempt": held.attempt}, respondents, jobs, key=key)
        self._row = row
        self._attempt = held.attempt
        self._notes = 0

    def insist(self) -> None:
        insist_wanted(self._held, lock=True)

    def calls_with(self, request_hash: str) -> QuerySet[ModelCall]:
        """Return them; of a fresh job the row's own attempts' alone, each once, to be replayed."""
        calls = super().calls_with(request_hash)
        if self._row.job.is_fresh:
            own = calls.filter(attempt__augmentation=self._row)
            calls = own.exclude(attempt=self._attempt).exclude(copies__attempt=self._attempt)
        return calls

    def note(self, kind: NoteKind, document: dict[str, object]) -> None:
        self._notes += 1
        TranscriptNote.objects.create(
            attempt=self._attempt,
            number=self._notes,
            after_call=self._numbers,
            kind=kind,
            document=texts.make_document_storable(document),
        )


# --- Private -----------------------------------------------------------------------------------


def _in_flight() -> Q:
    """Return the condition of calls that may still be answered; those of dead workers grow old."""
    longest_s = settings.LLM_QUEUE_S + settings.LLM_TIMEOUT_S
    return Q(settled_at=None, started_at__gt=DATABASE_TIME - timedelta(seconds=longest_s))


def _hold_question(request_hash: str) -> None:
    """Let nobody else ask the same until the transaction ends; SQLite's holds the whole file."""
    if connection.vendor == "postgresql":
        with connection.cursor() as cursor:
            cursor.execute("SELECT pg_advisory_xact_lock(%s)", [int(request_hash[:15], 16)])


def _reply_columns(reply: Reply) -> dict[str, Any]:
    """Return the answer as columns; a refusal that says nothing else is the answer."""
    extras = {
        "tool_calls": [asdict(call) for call in reply.tool_calls],
        "reasoning": reply.reasoning,
        "extra": reply.extra,
        "remarks": list(reply.remarks),
    }
    extras = {name: value for name, value in extras.items() if value}
    return {
        "answer": texts.make_storable(reply.text or reply.refusal or ""),
        "refusal": None if reply.refusal is None else texts.make_storable(reply.refusal),
        "extras": texts.make_document_storable(extras or None),
        "model_returned": texts.make_storable(reply.model)[:120],
        "finish_reason": texts.make_storable(reply.finish_reason)[:40],
        "prompt_tokens": reply.prompt_tokens,
        "completion_tokens": reply.completion_tokens,
        "cached_tokens": reply.cached_tokens,
        "latency_s": reply.latency_s,
    }


def _read_reply(call: ModelCall) -> Reply:
    """Return the answer that a call had, as it would come again; it took no time."""
    extras = call.extras or {}
    return Reply(
        text=call.answer or "",
        model=call.model_returned,
        finish_reason=call.finish_reason,
        refusal=call.refusal,
        tool_calls=tuple(ToolCall(**made) for made in extras.get("tool_calls", [])),
        prompt_tokens=call.prompt_tokens,
        completion_tokens=call.completion_tokens,
        cached_tokens=call.cached_tokens,
        reasoning=extras.get("reasoning", ""),
        extra=extras.get("extra", ""),
    )
