"""Have a language model read an instruction; every call is recorded and within caps."""

from contextlib import AbstractContextManager

from django.contrib.auth.models import User
from django.db import transaction

from augment.errors import BudgetSpent
from augment.llm.client import ChatClient
from augment.llm.costs import Price, WorstCase
from augment.models import Endpoint, IntentReading, ModelCall, Scenario
from augment.scene.codec import intent_to_document
from augment.services import clock, events, work
from augment.services.endpoints.client import EndpointClient, wire_to
from augment.services.endpoints.contestants import Respondent
from augment.services.endpoints.known_endpoints import find_endpoint
from augment.services.running.budget import Room
from augment.services.running.calls import CallTranscript
from augment.services.scenarios.scenes import scenario_named
from augment.variants.pipeline import ask_for_intent
from augment.variants.respondents import ModelRole

State = IntentReading.State
MOST_CALLS = 6
"""Two answers, each with two more attempts where the wire breaks."""


def plan_reading(
    *, scenario: Scenario, endpoint: Endpoint, model: str, actor: User | None = None
) -> IntentReading:
    """Create the row of a reading that nobody has been asked for yet."""
    return IntentReading.objects.create(
        scenario=scenario, endpoint=endpoint, model=model, asked_by=actor, cap_calls=MOST_CALLS
    )


def read_intent(
    *,
    scenario: str,
    endpoint: str,
    model: str,
    client: AbstractContextManager[ChatClient] | None = None,
) -> IntentReading:
    """Ask a model at once what an instruction asks for; what it read waits to be accepted.

    Args:
        scenario: A slug.
        endpoint: A label.
        model: The model id there.
        client: How the endpoint is reached; None over the wire.

    Raises:
        UnknownName: No such scenario or endpoint.
    """
    row = scenario_named(scenario)
    kind = Readings(client)
    with transaction.atomic():  # taken before any worker sees it
        reading = plan_reading(scenario=row, endpoint=find_endpoint(endpoint), model=model)
        lease = kind.take(reading.pk)
    assert lease is not None
    try:
        kind.work(lease)
    except BaseException:  # given back, it would be paid for by a worker that nobody asked
        given_back = kind.rows.filter(pk=reading.pk, state=State.RUNNING, claim=None)
        why = "It was interrupted."
        given_back.update(state=State.FAILED, reason=why, finished_at=clock.DATABASE_TIME)
        raise
    reading.refresh_from_db()
    return reading


class Readings(work.WorkKind[IntentReading]):
    """Readings that somebody asked for.

    Args:
        client: How the endpoint is reached; None over the wire.
    """

    model = IntentReading
    queue = "models"
    lost_limit = 1  # it may have been paid for
    related = ("scenario", "endpoint", "asked_by")

    def __init__(self, client: AbstractContextManager[ChatClient] | None = None) -> None:
        self._client = client

    def run(self, row: IntentReading, held: work.Lease[IntentReading]) -> work.Settlement:
        """Ask the model; every foreseen fault is a failed reading with a sentence."""
        client = self._client or EndpointClient(wire_to(row.endpoint), row.endpoint)
        # A worker that was told to stop may have asked already.
        transcript = ReadingTranscript(
            held,
            {"reading": row},
            {ModelRole.READER: Respondent(endpoint=row.endpoint, model=row.model)},
            numbers=row.calls.count(),
        )
        try:
            with client as opened:
                intent = ask_for_intent(
                    row.scenario.instruction, client=opened, model=row.model, transcript=transcript
                )
        except BudgetSpent as spent:
            return work.Settlement(state=State.FAILED, reason=f"The cap is reached: {spent.limit}")
        return work.Settlement(state=State.READ, columns={"document": intent_to_document(intent)})

    def after_commit(self, row: IntentReading, outcome: work.Settlement | None) -> None:
        """Log who was asked, and whether it was of use."""
        row.refresh_from_db(fields=["state"])
        events.log_change(
            row.scenario,
            "read intent",
            row.asked_by,
            after={"model": row.model, "endpoint": row.endpoint.label, "state": row.state},
        )


READINGS = Readings()


class ReadingTranscript(CallTranscript):
    """The calls of one reading, within its own number of calls."""

    def reserve(self, worst: WorstCase, price: Price | None) -> Room:
        made = ModelCall.objects.filter(**self._owner).exclude(sent_at=None).count()
        return Room.TAKEN if made < MOST_CALLS else Room.SPENT

    def limit(self) -> str:
        return f"{MOST_CALLS} calls"
