import json
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from decimal import Decimal
from importlib import import_module
from io import StringIO
from typing import Any

import pytest
from django.apps import apps
from django.conf import LazySettings
from django.core.management import CommandError, call_command
from django.urls import reverse

from augment.errors import Conflict, InvalidDocument, UnknownName
from augment.fake_llm.server import FakeServer, running
from augment.llm.client import ChatClient
from augment.llm.openai_wire import OpenAIWire
from augment.llm.wire_transport import host_and_port
from augment.models import (
    Augmentation,
    Contestant,
    Endpoint,
    EndpointModel,
    Event,
    GenerationJob,
    ModelCall,
)
from augment.services.endpoints import contestants, known_endpoints
from augment.services.endpoints.contestants import ContestantRequest
from augment.services.endpoints.known_endpoints import (
    EndpointFacts,
    EndpointRequest,
    change_endpoint,
    ensure_endpoint,
    find_key_obstacle,
    may_hold_key,
)
from augment.services.running import jobs, runner
from augment.services.running.choosing import find_obstacle
from augment.services.running.jobs import JobRequest
from augment.services.running.transcript_records import full_transcript
from augment.variants.respondents import ModelRole
from tests.intents import known
from tests.jobs.models import llama_job, ran
from tests.jobs.rows import add_scenario, only_row
from tests.llm.json_server import recorder
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db
LOCAL = "http://127.0.0.1:11434/v1"


def local() -> Endpoint:
    return ensure_endpoint(EndpointRequest(label="local", base_url=LOCAL))


def add(slug: str = "llama-otm", **changes: Any) -> Contestant:
    facts: dict[str, Any] = {"variant": "OTM", "endpoint": "local", "model": "llama3.1:70b"}
    facts |= changes
    facts["roles"] = {ModelRole(role): seat for role, seat in facts.get("roles", {}).items()}
    return contestants.add_contestant(ContestantRequest(slug=slug, **facts))


def test_the_builtin_contestants_are_made_once() -> None:
    contestants.ensure_builtin()
    contestants.ensure_builtin()
    assert list(Contestant.objects.values_list("slug", "kind")) == [
        ("quantised-5m", "baseline"),
        ("reference", "reference"),
        ("rule-placer", "rule"),
    ]


def test_the_same_contestant_twice_is_one() -> None:
    local()
    assert add(name="Llama") == add()
    assert Contestant.objects.count() == 1
    assert Event.objects.filter(object_kind="contestant").count() == 1


def test_openai_can_be_named_where_its_key_is_set(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(Conflict, match="set OPENAI_API_KEY here, or name its address"):
        add(endpoint="openai")
    monkeypatch.setenv("OPENAI_API_KEY", "sk-very-secret")
    made = add(endpoint="openai", model="gpt-4o")
    assert made.endpoint.base_url == "https://api.openai.com/v1"
    assert made.endpoint.key_variable == "OPENAI_API_KEY"
    assert known_endpoints.read_key(made.endpoint) == "sk-very-secret"
    assert "sk-very-secret" not in str(list(Endpoint.objects.values()))
    assert "sk-very-secret" not in str(list(Event.objects.values()))


def test_an_endpoint_is_moved_only_where_that_is_asked_for_and_it_is_logged() -> None:
    row = local()
    with pytest.raises(Conflict, match="change it on its page"):
        ensure_endpoint(EndpointRequest(label="local", base_url="http://127.0.0.1:9/v1/"))
    change_endpoint(row, facts=EndpointFacts(base_url="http://127.0.0.1:9/v1/"))
    assert Endpoint.objects.get().base_url == "http://127.0.0.1:9/v1"
    event = Event.objects.filter(verb="change").get()
    assert event.before["base_url"] == LOCAL


def test_the_command_makes_endpoint_and_contestant_in_one_call() -> None:
    said = StringIO()
    facts = ("--variant", "otm", "--endpoint", "local", "--model", "fake-good")
    call_command("add_contestant", "fake", *facts, "--base-url", LOCAL, "--simulated", stdout=said)
    assert said.getvalue() == "fake: fake-good OTM (simulated)\n"
    call_command("add_contestant", "fake-2", *facts, "--name", "Fake", stdout=said)
    assert Contestant.objects.get(slug="fake-2").name == "Fake"
    assert Contestant.objects.filter(slug="reference").exists()


def test_a_contestant_that_is_refused_leaves_no_endpoint_behind() -> None:
    facts = ("--variant", "otm", "--endpoint", "here", "--model", "m", "--base-url", LOCAL)
    with pytest.raises(CommandError, match="has no review"):
        call_command("add_contestant", "fake", *facts, "--rounds", "2")
    assert not Endpoint.objects.exists()


SECRETS = ("ARENA_SECRET_KEY", "DATABASE_URL", "REDIS_URL", "AWS_SECRET_ACCESS_KEY", "HOME")


@pytest.mark.parametrize(
    ("variable", "may"),
    [
        ("OPENAI_API_KEY", True), ("_my_API_KEY", True), ("LAB_TOKEN", True),
        ("LAB_TOKEN_2", False), ("LAB_TOKE", False), ("lab_token", False),
        ("API_KEY", False), ("_API_KEY", False), ("2_API_KEY", False), ("MY_API_KEY\n", False),
        ("OPENAI_API_KEY_FILE", False), ("openai_api_key", False),
        *((name, False) for name in SECRETS),
    ],
)  # fmt: skip
def test_which_variables_may_hold_a_key(settings: Any, variable: str, may: bool) -> None:
    settings.KEY_VARIABLES = ["LAB_TOKEN"]
    assert may_hold_key(variable) is may


def test_no_other_variable_is_ever_read(monkeypatch: pytest.MonkeyPatch) -> None:
    variable = SECRETS[0]
    monkeypatch.setenv(variable, "the-crown-jewels")
    row = only_row(llama_job())
    with recorder() as server:
        # As if it were written into the table by hand, or from before there was a rule.
        Endpoint.objects.update(base_url=server.url, key_variable=variable)
        runner.AUGMENTATIONS.perform(row.pk)
    row.refresh_from_db()
    assert server.heard == []
    assert row.state == Augmentation.State.FAILED
    assert f"{variable} may not be sent to an endpoint" in row.reason
    assert "the-crown-jewels" not in row.reason


# --- Another host ------------------------------------------------------------------------------


def test_a_key_goes_to_the_hosts_alone_that_it_is_bound_to(settings: Any) -> None:
    for hosts, base_url, is_bound in (
        ("models.example", "https://models.example/v1", True),
        ("Models.Example.", "https://MODELS.example.:8443/v1", True),
        ("models.example:443", "https://models.example/v2", True),
        ("models.example:443", "https://models.example:8443/v1", False),
        ("models.example:443", "http://models.example/v1", False),
        ("models.example", "https://models.example.thief/v1", False),
        ("models.example", "https://thief-models.example/v1", False),
        ("models.example", "https://thief.models.example/v1", False),
        ("models.example", "https://models.example@thief.example/v1", False),
        ("models.example", "https://models.example:443@thief.example/v1", False),
        ("models.example", "https://thief.example/models.example/v1", False),
        ("models.example", "https://thief.example?models.example", False),
        ("models.example", "https://models.example%2ethief.example/v1", False),
        ("b\u00fccher.example", "https://xn--bcher-kva.example/v1", True),
        ("xn--bcher-kva.example", "https://b\u00fccher.example/v1", True),
        ("strasse.example", "https://stra\u00dfe.example/v1", False),
        ("models.example", "https://\uff4dodels.example/v1", False),
        ("a.example|b.example:8000", "http://b.example:8000/v1", True),
        ("a.example|b.example:8000", "http://b.example:8001/v1", False),
        ("[::1]:8080", "http://[::1]:8080/v1", True),
        ("127.0.0.1", "http://localhost/v1", False),
        ("", "https://models.example/v1", False),
    ):
        settings.KEY_VARIABLES = [
            f"LAB_TOKEN={hosts}".removesuffix("="),
            "OTHER_TOKEN=other.example",
        ]
        assert (find_key_obstacle("LAB_TOKEN", base_url) == "") is is_bound
        assert find_key_obstacle("OTHER_TOKEN", base_url)
        assert find_key_obstacle("", base_url) == ""


def test_a_known_vendor_s_key_is_bound_without_being_told(settings: Any) -> None:
    vendor = "https://api.openai.com/v1"
    assert find_key_obstacle("OPENAI_API_KEY", vendor) == ""
    for other in ("http://api.openai.com/v1", "https://api.groq.com/openai/v1", LOCAL):
        assert "not bound to" in find_key_obstacle("OPENAI_API_KEY", other)
    for plain in ("http://api.openai.com:443/v1", "HTTP://API.openai.com.:0443"):
        assert "unencrypted" in find_key_obstacle("OPENAI_API_KEY", plain)
    settings.KEY_VARIABLES = ["OPENAI_API_KEY=proxy.example"]
    assert find_key_obstacle("OPENAI_API_KEY", "https://proxy.example/v1") == ""
    assert find_key_obstacle("OPENAI_API_KEY", vendor), "the proxy's key is not for the vendor"


def test_the_upgrade_binds_a_key_to_where_it_goes_today() -> None:
    for label, base_url in (
        ("one", "https://One.example/v1"),
        ("two", "http://two.example:81/v1"),
    ):
        Endpoint.objects.create(label=label, base_url=base_url, key_variable="OLD_API_KEY")
    import_module("augment.migrations.0038_key_bindings").bind_keys(apps, None)
    for same in ("https://one.example/v2", "http://two.example:81/v1"):
        assert find_key_obstacle("OLD_API_KEY", same) == ""
    for other in ("https://two.example/v1", "https://one.example:81/v1"):
        wanted = "whoever runs the server and its workers sets ARENA_KEY_VARIABLES=OLD_API_KEY="
        assert wanted in find_key_obstacle("OLD_API_KEY", other)


@pytest.mark.parametrize("variable", ["OPENAI_API_KEY", "LAB_API_KEY", "UNBOUND_API_KEY"])
@pytest.mark.parametrize("redirects", [False, True])
def test_another_server_never_receives_a_key(
    settings: Any, monkeypatch: pytest.MonkeyPatch, variable: str, redirects: bool
) -> None:
    monkeypatch.setenv(variable, "sk-very-secret")
    row = only_row(llama_job())
    with (
        recorder() as thief,
        recorder(307, {}, {"Location": f"{thief.url}/chat/completions"}) as home,
    ):
        settings.KEY_VARIABLES = [f"LAB_API_KEY={host_and_port(home.url)}"]
        # As if it were written into the table by hand, or changed after the key was entered.
        address = home.url if redirects else thief.url
        Endpoint.objects.update(base_url=address, key_variable=variable)
        runner.AUGMENTATIONS.perform(row.pk)
        assert thief.heard == []
        assert bool(home.heard) is (redirects and variable == "LAB_API_KEY")
        for endpoint in Endpoint.objects.all():
            facts = EndpointFacts(base_url=thief.url, key_variable=variable)
            with pytest.raises(InvalidDocument, match=f"{variable} is not bound to 127.0.0.1:"):
                change_endpoint(endpoint, facts=facts)
    row.refresh_from_db()
    assert row.state == Augmentation.State.FAILED
    assert "sk-very-secret" not in row.reason


@contextmanager
def wire(endpoint: Endpoint) -> Iterator[ChatClient]:
    with OpenAIWire(base_url=endpoint.base_url, api_key=None) as client:
        yield client


def add_roles(variant: str, **roles: tuple[str | None, str]) -> Contestant:
    for port, label in enumerate(("here", "there"), start=1):
        ensure_endpoint(EndpointRequest(label=label, base_url=f"http://127.0.0.1:{port}/v1"))
    return add("one", variant=variant, endpoint="here", model="text-model", roles=roles)


def test_roles_are_stored_by_label_and_model() -> None:
    made = add_roles("vqa", viewer=("there", "eyes"), engineer=(None, "boss"))
    assert made.roles == {
        "viewer": {"endpoint": "there", "model": "eyes"},
        "engineer": {"endpoint": "here", "model": "boss"},
    }
    assert made.name == "text-model vQA engineer boss viewer eyes"
    assert EndpointModel.objects.filter(endpoint__label="there", model="eyes").exists()


def test_a_role_that_nobody_plays_is_refused() -> None:
    with pytest.raises(InvalidDocument, match=r"roles.viewer: tqa has reviewer"):
        add_roles("tqa", viewer=("there", "eyes"))
    with pytest.raises(InvalidDocument, match="otm has no role besides the modifier"):
        add_roles("otm", reviewer=(None, "boss"))
    with pytest.raises(InvalidDocument, match=r"roles.modifier"):
        add_roles("vqa", modifier=(None, "boss"))
    with pytest.raises(UnknownName, match="Unknown endpoint 'nowhere'"):
        add_roles("vqa", viewer=("nowhere", "eyes"))


def test_a_simulated_reviewer_makes_a_simulated_contestant() -> None:
    ensure_endpoint(
        EndpointRequest(label="stand-in", base_url="http://127.0.0.1:3/v1", is_simulated=True)
    )
    assert add_roles("tqa", reviewer=("stand-in", "fake-good")).is_simulated


def test_visual_qa_waits_until_the_viewer_is_probed_or_somebody_tells() -> None:
    add_roles("vqa", viewer=("there", "eyes"))
    add_scenario("street-1")
    EndpointModel.objects.filter(model="text-model").update(vision=True)
    asked = JobRequest(name="J", contestants=["one"], scenarios=["street-1"])
    with pytest.raises(Conflict) as raised:
        jobs.launch(asked)
    obstacle = find_obstacle(Contestant.objects.get())
    assert "viewer eyes at there sees pictures" in obstacle
    assert f"one: {obstacle}" in str(raised.value)
    assert not GenerationJob.objects.exists()
    EndpointModel.objects.filter(model="eyes").update(vision=True)
    assert find_obstacle(Contestant.objects.get()) == ""
    jobs.launch(asked)


def test_a_cap_in_money_needs_the_price_of_every_role() -> None:
    add_roles("tqa", reviewer=("there", "boss"))
    add_scenario("street-1")
    EndpointModel.objects.filter(model="text-model").update(price_in_usd=1, price_out_usd=2)
    capped = JobRequest(name="J", contestants=["one"], scenarios=["street-1"], cap_usd=Decimal(1))
    with pytest.raises(Conflict, match="boss at there"):
        jobs.launch(capped)


def test_each_role_is_asked_at_its_own_endpoint(server: FakeServer) -> None:
    with running(known=known) as other:
        for label, url in (("a", server.url), ("b", other.url)):
            ensure_endpoint(EndpointRequest(label=label, base_url=url, is_simulated=True))
        roles = {"viewer": ("b", "fake-careless"), "engineer": ("b", "fake-good")}
        add("two", variant="fc-plus+vqa", endpoint="a", model="fake-qa-low", roles=roles)
        add_scenario("street-1")
        EndpointModel.objects.filter(model="fake-qa-low").update(native_tools=True)
        EndpointModel.objects.filter(model="fake-careless").update(vision=True)
        job = jobs.launch(JobRequest(name="J", contestants=["two"], scenarios=["street-1"]))
        row = only_row(job)
        ran(row, wire)
    assert row.state == Augmentation.State.DONE, row.reason
    asked = [
        (call.role[0], call.request["model"]) for call in ModelCall.objects.order_by("number")
    ]
    low, boss, eyes = ("m", "fake-qa-low"), ("e", "fake-good"), ("v", "fake-careless")
    assert asked == [low, low, boss, eyes, boss] * 2
    first = ModelCall.objects.get(number=1)
    assert first.request["tools"][0]["function"]["name"] == "pose_on_lane"
    assert first.extras["tool_calls"][0]["name"] == "pose_on_lane"
    kinds = list(row.attempts.get().notes.values_list("kind", flat=True))
    assert kinds == ["tool_call", "round", "review"] * 2 + ["kept"]


KEY = "sk-planted-0123456789abcdef"
ECHO = {
    "id": KEY,
    "object": "chat.completion",
    "created": 0,
    "model": f"m {KEY}",
    "choices": [
        {
            "index": 0,
            "finish_reason": KEY,
            "message": {"role": "assistant", "content": f"You sent Bearer {KEY}."},
        }
    ],
    "usage": {"prompt_tokens": 1, "completion_tokens": 1, "total_tokens": 2},
}
REFUSED = {"error": {"message": f"Incorrect API key provided: {KEY}", "code": KEY}}


def every_stored_value() -> Iterator[str]:
    """All columns of all rows of all tables, as text."""
    for model in apps.get_models(include_auto_created=True):
        for row in model._default_manager.values():
            yield f"{model.__name__} {row}"


@pytest.mark.parametrize(("status", "body"), [(200, ECHO), (401, REFUSED)])
def test_a_planted_key_is_found_nowhere(
    settings: LazySettings,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    status: int,
    body: object,
) -> None:
    monkeypatch.setenv("PLANTED_API_KEY", KEY)
    settings.KEY_VARIABLES = ["PLANTED_API_KEY=127.0.0.1"]
    caplog.set_level(logging.DEBUG)
    row = only_row(llama_job())
    with recorder(status, body) as server:
        Endpoint.objects.update(base_url=server.url, key_variable="PLANTED_API_KEY")
        runner.AUGMENTATIONS.perform(row.pk, worker="w")
        assert server.heard[0]["authorization"] == f"Bearer {KEY}", "it was planted"
    row.refresh_from_db()
    assert row.state in (Augmentation.State.UNREADABLE, Augmentation.State.FAILED)
    assert ModelCall.objects.exists()

    staff = signed_in(people()["admin"])
    pages = [
        staff.get(reverse(name, args=[code])).content.decode()
        for name, code in (
            ("augmentation", row.code),
            ("transcript", row.code),
            ("job", row.job.code),
        )
    ]
    kept = [*every_stored_value(), caplog.text, json.dumps(full_transcript(row)), *pages]
    assert [text[:200] for text in kept if KEY in text] == []
    assert any("[key]" in text for text in kept), "the server did echo it"
