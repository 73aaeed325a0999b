"""A language model reads what an instruction asks for; a person decides whether that counts."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from io import StringIO
from pathlib import Path

import pytest
from django.core.management import call_command

from augment.errors import Conflict, ModelFault
from augment.fake_llm.server import running
from augment.llm.client import ChatClient
from augment.llm.messages import Reply
from augment.models import Event, IntentReading, ModelCall, Scenario
from augment.scene.codec import intent_to_document, intent_to_parts
from augment.scene.intent import Shape
from augment.services.endpoints.known_endpoints import EndpointRequest, ensure_endpoint
from augment.services.running import intent_readings
from augment.services.running.intent_readings import READINGS, plan_reading, read_intent
from augment.services.scenarios.editing import accept_reading
from tests.intents import cones, known
from tests.jobs.rows import add_scenario
from tests.llm.scripted import ScriptedClient

pytestmark = pytest.mark.django_db
CONE = cones(20.0, 1, Shape.LINE)
GOOD = f"```json\n{json.dumps(intent_to_parts(CONE))}\n```"
State = IntentReading.State


@contextmanager
def opened(client: ScriptedClient) -> Iterator[ChatClient]:
    yield client


def reading(*answers: str | Reply | ModelFault) -> IntentReading:
    if not Scenario.objects.exists():
        add_scenario("street", intent=None, intent_origin="")
        ensure_endpoint(EndpointRequest(label="here", base_url="http://127.0.0.1:1/v1"))
    return read_intent(
        scenario="street", endpoint="here", model="m", client=opened(ScriptedClient(answers))
    )


def test_what_was_read_waits_and_counts_once_it_is_accepted() -> None:
    made = reading(GOOD)
    assert (made.state, made.document) == (State.READ, intent_to_document(CONE))
    assert Scenario.objects.get().intent is None
    row = accept_reading(scenario="street")
    assert (row.intent, row.intent_origin) == (intent_to_document(CONE), "read")
    assert Event.objects.filter(verb="set intent").count() == 1
    with pytest.raises(Conflict, match="No reading of 'street' waits"):
        accept_reading(scenario="street")


@pytest.mark.parametrize(
    "said",
    [
        {"removals": [{"kind": "bus", "ordinal": None}], "requests": None, "route": None},
        {"moves": [{"who": {"kind": "bus"}, "speed_mps": 2, "spot": {"relation": "ahead"}}]},
        {"purpose": {"passage": {"low_m": 3}}, "beyond": ["make it rain"]},
    ],
)
def test_a_wish_that_adds_nothing_is_read_without_requests(said: dict[str, object]) -> None:
    made = reading(json.dumps(said))
    assert made.state == State.READ
    assert made.document is not None
    assert "unmet" not in made.document


def test_a_wish_for_nothing_that_can_be_placed_is_read_so() -> None:
    made = reading('{"beyond": ["make it look nicer"]}')
    assert (made.state, made.document and made.document["unmet"]) == (
        State.READ,
        "it asks for nothing that can be placed",
    )
    ModelCall.objects.all().delete()
    assert reading('{"requests": []}', '{"requests": []}').state == State.FAILED


def test_an_interrupted_reading_is_left_to_no_worker(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(intent_readings, "ask_for_intent", interrupt)
    with pytest.raises(KeyboardInterrupt):
        reading(GOOD)
    assert IntentReading.objects.get().state == State.FAILED
    assert not READINGS.find_unsent(older_than=timedelta(0))


def test_an_answer_that_breaks_the_schema_is_asked_for_once_more() -> None:
    broken = GOOD.replace('"line"', '"zigzag"')
    assert reading(broken, GOOD).state == State.READ
    second = ModelCall.objects.get(number=2)
    assert "requests[0].cones.shape" in str(second.request)
    ModelCall.objects.all().delete()  # an answer from the store would be read again
    failed = reading(broken.replace("zigzag", "spiral"), broken)
    assert (failed.state, failed.document) == (State.FAILED, None)


def test_a_cap_ends_a_reading_before_the_call_that_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(intent_readings, "MOST_CALLS", 1)
    made = reading("no block")
    assert (made.state, made.calls.count()) == (State.FAILED, 1)
    assert made.reason == "The cap is reached: 1 calls"


def test_a_broken_wire_is_a_failed_reading_with_a_sentence() -> None:
    made = reading(ModelFault("the endpoint answered nonsense", retryable=False, status=400))
    assert (made.state, made.reason) == (State.FAILED, "HTTP 400: the endpoint answered nonsense")
    assert made.calls.get().fault == made.reason


def run(*arguments: str) -> str:
    out = StringIO()
    call_command("read_intent", "street", *arguments, stdout=out)
    return out.getvalue()


def test_the_command_reads_through_the_wire_shows_statements_and_accepts(tmp_path: Path) -> None:
    add_scenario("street", intent=None, intent_origin="")
    with running(known=known) as server:
        ensure_endpoint(EndpointRequest(label="stand-in", base_url=server.url))
        said = run("--endpoint", "stand-in", "--model", "fake-good")
    assert "- cones: 20 m ahead of the ego\n" in said
    assert "It does not count yet." in said
    assert "This is the intent of street now (read)." in run("--accept")
    file = tmp_path / "mended.json"
    file.write_text(json.dumps(intent_to_document(cones(21.0, 1, Shape.LINE))))
    assert "(entered)" in run("--enter", str(file))
    assert Scenario.objects.get().intent_origin == "entered"


def test_a_worker_asks_for_a_planned_reading_once() -> None:
    scenario = add_scenario("street", intent=None, intent_origin="")
    request = EndpointRequest(label="here", base_url="http://127.0.0.1:1/v1")
    endpoint = ensure_endpoint(request)
    row = plan_reading(scenario=scenario, endpoint=endpoint, model="m")
    READINGS.perform(row.pk)  # nobody listens there
    row.refresh_from_db()
    assert row.state == State.FAILED
    calls = row.calls.count()
    assert not READINGS.perform(row.pk), "a message that comes twice asks nobody again"
    assert row.calls.count() == calls
