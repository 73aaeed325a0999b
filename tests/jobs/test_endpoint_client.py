"""The client of an endpoint: over the real wire to a stand-in, with rows behind it."""

from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Any

import pytest
from django.conf import LazySettings

from augment.errors import KeyMissing
from augment.llm.client import Patience
from augment.llm.messages import Message, Request, Speaker
from augment.llm.openai_wire import OpenAIWire
from augment.models import Augmentation, CallLease, Endpoint, EndpointModel, Event, ModelCall
from augment.services.endpoints.client import EndpointClient, Queue
from augment.services.running import jobs, runner
from augment.services.running.jobs import JobRequest
from augment.variants.respondents import ModelRole, RespondentClient, Respondents
from tests.jobs.rows import add_model, add_scenario, only_row
from tests.jobs.scripted import Scripted
from tests.llm.json_server import serving
from tests.variants.playing import MemoryTranscript

pytestmark = pytest.mark.django_db
ASKED = Request(
    model="picky", messages=(Message(speaker=Speaker.USER, text="Hello"),), temperature=0.0, seed=7
)


def picky(*refuses: str, prompt_tokens: int | None = 3) -> AbstractContextManager[Scripted]:
    usage = {"prompt_tokens": prompt_tokens, "completion_tokens": 1}
    return serving(Scripted("Hi", refuses=refuses, usage=usage))


@dataclass
class Asking:
    """A conversation with an endpoint, as a variant has it."""

    server: Scripted
    endpoint: Endpoint = field(init=False)
    transcript: MemoryTranscript = field(default_factory=MemoryTranscript)

    def __post_init__(self) -> None:
        self.endpoint, _ = Endpoint.objects.get_or_create(
            label="local", defaults={"base_url": self.server.url}
        )

    def ask(self, request: Request = ASKED) -> str:
        wire = OpenAIWire(base_url=self.endpoint.base_url, api_key=None, timeout_s=60.0)
        with EndpointClient(wire, self.endpoint, Queue(longest_s=0.0)) as client:
            respondent = RespondentClient(client=client, model=request.model)
            conversation = Respondents(
                clients={ModelRole.MODIFIER: respondent},
                transcript=self.transcript,
                patience=Patience(attempts=1),
            )
            return conversation.send(ModelRole.MODIFIER, request, "v1").text


def test_a_refused_parameter_is_dropped_and_remembered(caplog: pytest.LogCaptureFixture) -> None:
    with picky("temperature", "seed", "max_completion_tokens") as server:
        assert Asking(server).ask() == "Hi"
        assert [sorted(body) for body in server.bodies][-1] == ["max_tokens", "messages", "model"]
        server.bodies.clear()
        assert Asking(server).ask() == "Hi"
        assert len(server.bodies) == 1
    known = EndpointModel.objects.get()
    assert known.temperature is False
    assert known.refused_parameters == ["max_completion_tokens", "seed"]
    assert caplog.text.count("picky at endpoint local does not take") == 3
    assert Event.objects.filter(verb="learn", object_code=known.code).count() == 3


def test_a_worker_goes_through_the_limits_and_the_profile() -> None:
    with picky("seed", prompt_tokens=None) as server:
        endpoint = Endpoint.objects.create(label="local", base_url=server.url)
        EndpointModel.objects.create(endpoint=endpoint, model="m", temperature=False)
        add_model("m", endpoint=endpoint, model="m")
        add_scenario("street")
        row = only_row(jobs.launch(JobRequest(name="R", contestants=["m"], scenarios=["street"])))
        runner.AUGMENTATIONS.perform(row.pk)
        assert all("temperature" not in body for body in server.bodies)
        assert CallLease.objects.count() == len(server.bodies) == ModelCall.objects.count() > 0
    row.refresh_from_db()
    assert row.state == Augmentation.State.UNREADABLE


def test_a_missing_key_is_found_before_a_place_is_taken(settings: LazySettings) -> None:
    settings.KEY_VARIABLES = ["NOT_SET_API_KEY=127.0.0.1"]
    endpoint = Endpoint.objects.create(
        label="local", base_url="http://127.0.0.1:1/v1", key_variable="NOT_SET_API_KEY"
    )
    row_claim: Any = None
    with pytest.raises(KeyMissing):
        runner.open_wire(endpoint, row_claim)
    assert not CallLease.objects.exists()
