"""A contestant may give its reviewers' roles to other models, at other endpoints."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from decimal import Decimal

import pytest
from django.core.management import call_command

from augment.errors import Conflict, InvalidDocument, UnknownName
from augment.fake_llm.server import FakeServer, running
from augment.llm.client import ChatClient
from augment.llm.openai_wire import OpenAIWire
from augment.models import (
    Augmentation,
    Contestant,
    Endpoint,
    EndpointModel,
    Event,
    GenerationJob,
    ModelCall,
)
from augment.services.endpoints import contestants
from augment.services.endpoints.known_endpoints import ensure_endpoint
from augment.services.running import jobs
from augment.services.running.budget import Caps
from augment.services.running.choosing import find_obstacle
from augment.variants.respondents import ModelRole
from tests.intents import intents
from tests.jobs.models import ran
from tests.jobs.rows import add_scenario, only_row

pytestmark = pytest.mark.django_db


@pytest.fixture(scope="module")
def server() -> Iterator[FakeServer]:
    with running(intents=intents) as serving:
        yield serving


@contextmanager
def wire(endpoint: Endpoint) -> Iterator[ChatClient]:
    with OpenAIWire(base_url=endpoint.base_url, api_key=None) as client:
        yield client


def opened(endpoint: Endpoint) -> AbstractContextManager[ChatClient]:
    return wire(endpoint)


def add(variant: str, **roles: tuple[str | None, str]) -> Contestant:
    ensure_endpoint(label="here", base_url="http://127.0.0.1:1/v1")
    ensure_endpoint(label="there", base_url="http://127.0.0.1:2/v1")
    return contestants.add_contestant(
        slug="one",
        variant=variant,
        endpoint="here",
        model="text-model",
        roles={ModelRole(role): seat for role, seat in roles.items()},
    )


def sees(model: str, endpoint: str, *, vision: bool | None) -> None:
    EndpointModel.objects.update_or_create(
        endpoint=Endpoint.objects.get(label=endpoint), model=model, defaults={"vision": vision}
    )


def test_roles_are_stored_by_label_and_model() -> None:
    made = add("vqa", viewer=("there", "eyes"), engineer=(None, "boss"))
    assert made.roles == {
        "viewer": {"endpoint": "there", "model": "eyes"},
        "engineer": {"endpoint": "here", "model": "boss"},
    }
    assert made.name == "text-model vQA engineer boss viewer eyes"
    assert EndpointModel.objects.filter(endpoint__label="there", model="eyes").exists()


def test_a_role_that_nobody_plays_is_refused() -> None:
    with pytest.raises(InvalidDocument, match=r"roles.viewer: tqa has reviewer"):
        add("tqa", viewer=("there", "eyes"))
    with pytest.raises(InvalidDocument, match="otm has no role besides the modifier"):
        add("otm", reviewer=(None, "boss"))
    with pytest.raises(InvalidDocument, match=r"roles.modifier"):
        add("vqa", modifier=(None, "boss"))
    with pytest.raises(UnknownName, match="Unknown endpoint 'nowhere'"):
        add("vqa", viewer=("nowhere", "eyes"))


def test_a_simulated_reviewer_makes_a_simulated_contestant() -> None:
    ensure_endpoint(label="stand-in", base_url="http://127.0.0.1:3/v1", is_simulated=True)
    assert add("tqa", reviewer=("stand-in", "fake-good")).is_simulated


def test_visual_qa_with_a_viewer_known_to_be_blind_is_refused_at_launch() -> None:
    add("vqa")
    add_scenario("street-1")
    sees("text-model", "here", vision=False)
    with pytest.raises(Conflict, match="one: its viewer text-model at here sees text alone"):
        jobs.launch(name="J", contestants=["one"], scenarios=["street-1"])


def test_visual_qa_waits_until_the_viewer_is_probed_or_somebody_tells() -> None:
    add("vqa", viewer=("there", "eyes"))
    add_scenario("street-1")
    sees("text-model", "here", vision=True)
    with pytest.raises(Conflict) as raised:
        jobs.launch(name="J", contestants=["one"], scenarios=["street-1"])
    obstacle = find_obstacle(Contestant.objects.get())
    assert "viewer eyes at there sees pictures" in obstacle
    assert f"one: {obstacle}" in str(raised.value)
    assert not GenerationJob.objects.exists()
    out = io.StringIO()
    call_command("probe_endpoint", "there", "--model", "eyes", "--sees", "yes", stdout=out)
    assert "as you say" in out.getvalue()
    assert Event.objects.get(verb="tell").after == {
        "endpoint": "there",
        "model": "eyes",
        "vision": True,
    }
    assert find_obstacle(Contestant.objects.get()) == ""
    jobs.launch(name="J", contestants=["one"], scenarios=["street-1"])


def test_a_cap_in_money_needs_the_price_of_every_role() -> None:
    add("tqa", reviewer=("there", "boss"))
    add_scenario("street-1")
    EndpointModel.objects.filter(model="text-model").update(price_in_usd=1, price_out_usd=2)
    with pytest.raises(Conflict, match="boss at there"):
        jobs.launch(
            name="J", contestants=["one"], scenarios=["street-1"], caps=Caps(usd=Decimal(1))
        )


def test_each_role_is_asked_at_its_own_endpoint(server: FakeServer) -> None:
    with running(intents=intents) as other:
        ensure_endpoint(label="a", base_url=server.url, is_simulated=True)
        ensure_endpoint(label="b", base_url=other.url, is_simulated=True)
        contestants.add_contestant(
            slug="two",
            variant="fc+vqa",
            endpoint="a",
            model="fake-qa-low",
            roles={
                ModelRole.VIEWER: ("b", "fake-careless"),
                ModelRole.ENGINEER: ("b", "fake-good"),
            },
        )
        add_scenario("street-1")
        EndpointModel.objects.filter(model="fake-qa-low").update(native_tools=True)
        EndpointModel.objects.filter(model="fake-careless").update(vision=True)
        job = jobs.launch(name="J", contestants=["two"], scenarios=["street-1"])
        row = only_row(job)
        ran(row, opened)
    assert row.state == Augmentation.State.DONE, row.reason
    asked = [
        (call.role[0], call.request["model"]) for call in ModelCall.objects.order_by("number")
    ]
    low, boss, eyes = ("m", "fake-qa-low"), ("e", "fake-good"), ("v", "fake-careless")
    assert asked == [low, low, boss, eyes, boss] * 2
    first = ModelCall.objects.get(number=1)
    assert first.request["tools"][0]["function"]["name"] == "pose_on_lane"
    assert first.extras is not None
    assert first.extras["tool_calls"][0]["name"] == "pose_on_lane"
    kinds = list(row.attempts.get().notes.values_list("kind", flat=True))
    assert kinds == ["tool_call", "round", "review"] * 2 + ["kept"]
