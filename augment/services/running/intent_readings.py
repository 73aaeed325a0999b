"""Has a language model read an instruction; every call is recorded, paid for and within caps."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

from django.conf import settings
from django.contrib.auth.models import User
from django.db import transaction
from django.utils import timezone

from augment.errors import (
    BudgetSpent,
    Conflict,
    ModelFault,
    NotSent,
    ReplyUnreadable,
    UnknownName,
)
from augment.llm.client import ChatClient
from augment.llm.costs import Price, WorstCase, worst_case
from augment.llm.fingerprint import image_reference, request_hash
from augment.llm.messages import Reply, Request
from augment.models import Endpoint, IntentReading, ModelCall, Scenario
from augment.scene.intent_codec import intent_to_document
from augment.services.endpoints.call_limits import Queue
from augment.services.endpoints.client import EndpointClient
from augment.services.endpoints.prices import price_of
from augment.services.endpoints.wires import wire_to
from augment.services.events import log_event
from augment.services.running import answers, budget
from augment.services.running.caps import Caps
from augment.services.running.transcripts import sentence_of
from augment.services.texts import make_document_storable, make_storable
from augment.services.work import Lease, Settlement, WorkKind
from augment.variants.intent_reader import ask_for_intent
from augment.variants.transcript import ModelRole, NoteKind

State = IntentReading.State
USUAL_CAPS = Caps(calls=6)
"""Two answers, each with two more attempts where the wire breaks."""


def read_intent(
    *,
    scenario: str,
    endpoint: str,
    model: str,
    caps: Caps = USUAL_CAPS,
    is_fresh: bool = False,
    actor: User | None = None,
    client: AbstractContextManager[ChatClient] | None = None,
) -> IntentReading:
    """Ask a model what an instruction asks for; what it read waits to be accepted.

    Args:
        scenario: A slug.
        endpoint: A label.
        model: The model id there.
        caps: What the reading may use at most.
        is_fresh: Ask anew what was answered before.
        actor: Who wants it.
        client: How the endpoint is reached; None over the wire.

    Raises:
        UnknownName: No such scenario or endpoint.
        Conflict: A cap can't be, or there is one in USD and nobody knows the price.
    """
    kind = Readings(client, is_fresh=is_fresh)
    with transaction.atomic():  # taken before any worker sees it
        reading = plan_reading(
            scenario=scenario, endpoint=endpoint, model=model, caps=caps, actor=actor
        )
        held = kind.take(reading.pk)
    assert held is not None
    kind.work(held)
    reading.refresh_from_db()
    return reading


def plan_reading(
    *,
    scenario: str,
    endpoint: str,
    model: str,
    caps: Caps = USUAL_CAPS,
    actor: User | None = None,
) -> IntentReading:
    """The row of a reading that nobody has been asked for yet.

    Raises:
        UnknownName: No such scenario or endpoint.
        Conflict: A cap can't be, or there is one in USD and nobody knows the price.
    """
    row, site = _scenario(scenario), _endpoint(endpoint)
    if caps.usd is not None and price_of(site, model) is None:
        raise Conflict("A cap in USD needs the price of the model, and nobody knows it.")
    return IntentReading.objects.create(
        scenario=row, endpoint=site, model=model, asked_by=actor, **caps.columns()
    )


class Readings(WorkKind[IntentReading]):
    """Readings that somebody asked for.

    Args:
        client: How the endpoint is reached; None over the wire.
        is_fresh: Ask anew what was answered before.
    """

    model = IntentReading
    queue = "models"
    lost_limit = 1  # it may have been paid for
    related = ("scenario", "endpoint", "asked_by")

    def __init__(
        self,
        client: AbstractContextManager[ChatClient] | None = None,
        *,
        is_fresh: bool = False,
    ) -> None:
        self._client = client
        self._is_fresh = is_fresh

    def run(self, row: IntentReading, held: Lease[IntentReading]) -> Settlement:
        """Ask the model; every foreseen fault is a failed reading with a sentence."""
        site = row.endpoint
        client = self._client or EndpointClient(
            wire_to(site), site, Queue(longest_s=settings.LLM_QUEUE_S)
        )
        transcript = ReadingTranscript(row, price_of(site, row.model), is_fresh=self._is_fresh)
        try:
            with client as opened:
                intent = ask_for_intent(
                    row.scenario.instruction,
                    client=opened,
                    model=row.model,
                    transcript=transcript,
                )
        except ModelFault as fault:
            return Settlement(state=State.FAILED, reason=sentence_of(fault))
        except ReplyUnreadable as unreadable:
            return Settlement(state=State.FAILED, reason=str(unreadable))
        except BudgetSpent as spent:
            return Settlement(state=State.FAILED, reason=f"The cap is reached: {spent.limit}")
        return Settlement(state=State.READ, columns={"document": intent_to_document(intent)})

    def over(self, row: IntentReading, outcome: Settlement | None) -> None:
        """Log who was asked, and whether it was of use."""
        row.refresh_from_db(fields=["state"])
        log_event(
            actor=row.asked_by,
            verb="read intent",
            object_kind="scenario",
            object_code=row.scenario.code,
            after={"model": row.model, "endpoint": row.endpoint.label, "state": row.state},
        )


READINGS = Readings()


class ReadingTranscript:
    """The calls of one reading as rows; one after the other, within its caps.

    Args:
        reading: Whose calls they are.
        price: Of the model, None where nobody knows it.
        is_fresh: Whether nothing is served from earlier answers.
    """

    def __init__(self, reading: IntentReading, price: Price | None, *, is_fresh: bool) -> None:
        self._reading = reading
        self._price = price
        self._is_fresh = is_fresh
        self._number = reading.calls.count()  # of a worker that was told to stop
        self._open: dict[int, _Open] = {}

    def known(self, role: ModelRole, request: Request, prompt_version: str) -> Reply | None:
        """The answer that this request had before, recorded as a call that cost nothing."""
        if self._is_fresh:
            return None
        columns = self._columns(role, request, prompt_version)
        earlier = answers.find_earlier_answer(
            request_hash=columns["request_hash"], augmentation_pk=0, attempt_pk=0, is_fresh=False
        )
        if earlier is None:
            return None
        self._number += 1
        copied = answers.columns_of_copy(earlier, now=timezone.now())
        ModelCall.objects.create(**columns, **copied, number=self._number)
        return answers.reply_of(earlier)

    def asked(self, role: ModelRole, request: Request, prompt_version: str) -> int:
        """Store a request with its worst case; returns its number, from 1.

        Raises:
            BudgetSpent: The worst case would pass a cap.
        """
        worst = worst_case(request)
        self._insist_on_room(worst)
        self._number += 1
        call = ModelCall.objects.create(
            **self._columns(role, request, prompt_version),
            number=self._number,
            started_at=timezone.now(),
            reserved_tokens=worst.tokens,
            reserved_nano_usd=worst.nano_usd(self._price),
        )
        self._open[self._number] = _Open(pk=call.pk, worst=worst)
        return self._number

    def sending(self, number: int) -> None:
        """Store that the call is sent now; from here on it may be billed."""
        ModelCall.objects.filter(pk=self._open[number].pk).update(sent_at=timezone.now())

    def answered(self, number: int, reply: Reply, fault: ModelFault | None = None) -> None:
        """Store the raw answer to that call and what it used."""
        call = self._open.pop(number)
        used = budget.used_by_reply(reply, worst=call.worst, price=self._price)
        answer = answers.columns_of(reply)
        answer["fault"] = "" if fault is None else make_storable(sentence_of(fault))
        _settle(call, used, answer)

    def broke(self, number: int, fault: ModelFault) -> None:
        """Store why there was no answer to that call, and what it may have used."""
        call = self._open.pop(number)
        used = budget.used_by_fault(fault, worst=call.worst, price=self._price)
        broken: dict[str, Any] = {"fault": make_storable(sentence_of(fault))}
        if isinstance(fault, NotSent):
            broken["sent_at"] = None
        _settle(call, used, broken)

    def note(self, kind: NoteKind, document: dict[str, object]) -> None:
        """A reading has no rounds, tools or reviews to note."""

    def _insist_on_room(self, worst: WorstCase) -> None:
        sent = self._reading.calls.exclude(sent_at=None)
        used = {
            "calls": sent.count(),
            "tokens": sum(one.spent_tokens or 0 for one in sent),
            "nano_usd": sum(one.cost_nano_usd or 0 for one in sent),
        }
        needs = {"calls": 1, "tokens": worst.tokens, "nano_usd": worst.nano_usd(self._price) or 0}
        for name, needed in needs.items():
            cap = getattr(self._reading, f"cap_{name}")
            if cap is not None and used[name] + needed > cap:
                raise BudgetSpent(f"{cap} {name}")

    def _columns(self, role: ModelRole, request: Request, version: str) -> dict[str, Any]:
        document = make_document_storable(request.to_document(image_url=image_reference))
        return {
            "reading": self._reading,
            "role": role,
            "request": document,
            "request_hash": request_hash(
                base_url=self._reading.endpoint.base_url, document=document, prompt_version=version
            ),
            "prompt_version": version,
        }


# --- Private -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Open:
    """A call in flight."""

    pk: int
    worst: WorstCase


def _settle(call: _Open, used: budget.Used, answer: dict[str, Any]) -> None:
    ModelCall.objects.filter(pk=call.pk).update(
        spent_tokens=used.tokens,
        cost_nano_usd=used.nano_usd,
        is_cost_estimated=used.is_estimated,
        settled_at=timezone.now(),
        **answer,
    )


def _scenario(slug: str) -> Scenario:
    row = Scenario.objects.filter(slug=slug).first()
    if row is None:
        raise UnknownName("scenario", slug, list(Scenario.objects.values_list("slug", flat=True)))
    return row


def _endpoint(label: str) -> Endpoint:
    row = Endpoint.objects.filter(label=label).first()
    if row is None:
        raise UnknownName(
            "endpoint", label, list(Endpoint.objects.values_list("label", flat=True))
        )
    return row
