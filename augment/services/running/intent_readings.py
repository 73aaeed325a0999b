"""Have a language model read an instruction; every call is recorded and within caps."""

from contextlib import AbstractContextManager

from django.conf import settings
from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import Count, Sum

from augment.errors import (
    BudgetSpent,
    Conflict,
    LeaseLost,
    ModelFault,
    ReplyUnreadable,
    UnknownName,
)
from augment.llm.client import ChatClient
from augment.llm.costs import Price, WorstCase
from augment.models import Endpoint, IntentReading, ModelCall, Scenario
from augment.scene.codec import intent_to_document
from augment.services.clock import DATABASE_TIME
from augment.services.endpoints.client import EndpointClient, Queue, wire_to
from augment.services.endpoints.known_models import price_of
from augment.services.events import log_change
from augment.services.running import budget
from augment.services.running.budget import Caps
from augment.services.running.calls import CallTranscript, find_earlier_answer, sentence_of
from augment.services.work import Lease, Settlement, WorkKind
from augment.variants.pipeline import ask_for_intent
from augment.variants.respondents import NoteKind

State = IntentReading.State
USUAL_CAPS = Caps(cap_calls=6)
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
    try:
        kind.work(held)
    except BaseException:  # given back, it would be paid for by a worker that nobody asked
        given_back = kind.rows.filter(pk=reading.pk, state=State.RUNNING, claim=None)
        why = "It was interrupted."
        given_back.update(state=State.FAILED, reason=why, finished_at=DATABASE_TIME)
        raise
    reading.refresh_from_db()
    return reading


def plan_reading(
    *, scenario: str, endpoint: str, model: str, caps: Caps = USUAL_CAPS, actor: User | None = None
) -> IntentReading:
    """Create the row of a reading that nobody has been asked for yet.

    Raises:
        UnknownName: No such scenario or endpoint.
        Conflict: A cap can't be, or there is one in USD and nobody knows the price.
    """
    row = Scenario.objects.filter(slug=scenario).first()
    if row is None:
        slugs = Scenario.objects.values_list("slug", flat=True)
        raise UnknownName("scenario", scenario, list(slugs))
    site = Endpoint.objects.filter(label=endpoint).first()
    if site is None:
        labels = Endpoint.objects.values_list("label", flat=True)
        raise UnknownName("endpoint", endpoint, list(labels))
    if caps.cap_usd is not None and price_of(site, model) is None:
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
        self, client: AbstractContextManager[ChatClient] | None = None, *, is_fresh: bool = False
    ) -> None:
        self._client = client
        self._is_fresh = is_fresh

    def run(self, row: IntentReading, held: Lease[IntentReading]) -> Settlement:
        """Ask the model; every foreseen fault is a failed reading with a sentence."""
        queue = Queue(longest_s=settings.LLM_QUEUE_S)
        client = self._client or EndpointClient(wire_to(row.endpoint), row.endpoint, queue)
        transcript = ReadingTranscript(held, row, is_fresh=self._is_fresh)
        try:
            with client as opened:
                intent = ask_for_intent(
                    row.scenario.instruction, client=opened, model=row.model, transcript=transcript
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
        log_change(
            row.scenario,
            "read intent",
            row.asked_by,
            after={"model": row.model, "endpoint": row.endpoint.label, "state": row.state},
        )


READINGS = Readings()


class ReadingTranscript(CallTranscript):
    """The calls of one reading, within its own caps.

    Args:
        held: The lease on the reading.
        reading: Whose calls they are.
        is_fresh: Whether nothing is served from earlier answers.
    """

    def __init__(
        self, held: Lease[IntentReading], reading: IntentReading, *, is_fresh: bool
    ) -> None:
        self._held = held
        self._reading = reading
        self._is_fresh = is_fresh
        self._limit = ""
        # A worker that was told to stop may have asked already.
        numbers = reading.calls.count()
        super().__init__({"reading": reading}, reading.endpoint, numbers=numbers)

    def insist(self) -> None:
        if not self._held.is_held(lock=True):
            raise LeaseLost

    def earlier_answer(self, request_hash: str) -> ModelCall | None:
        if self._is_fresh:
            return None
        return find_earlier_answer(
            request_hash=request_hash, augmentation_pk=0, attempt_pk=0, is_fresh=False
        )

    def reserve(self, worst: WorstCase, price: Price | None) -> budget.Room:
        used = self._reading.calls.exclude(sent_at=None).aggregate(
            calls=Count("pk"), tokens=Sum("spent_tokens"), nano_usd=Sum("cost_nano_usd")
        )
        needs = {"calls": 1, "tokens": worst.tokens, "nano_usd": worst.nano_usd(price) or 0}
        for name, needed in needs.items():
            cap = getattr(self._reading, f"cap_{name}")
            if cap is not None and (used[name] or 0) + needed > cap:
                self._limit = f"{cap} {name}"
                return budget.Room.SPENT
        return budget.Room.TAKEN

    def limit(self) -> str:
        return self._limit

    def note(self, kind: NoteKind, document: dict[str, object]) -> None:
        """A reading has no rounds, tools or reviews to note."""
