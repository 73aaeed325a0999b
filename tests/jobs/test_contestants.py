from __future__ import annotations

from io import StringIO

import pytest
from django.core.management import CommandError, call_command

from augment.errors import Conflict, InvalidDocument
from augment.models import Contestant, Endpoint, EndpointModel, Event
from augment.services.endpoints import contestants, known_endpoints
from augment.services.endpoints.known_endpoints import ensure_endpoint

pytestmark = pytest.mark.django_db
LOCAL = "http://127.0.0.1:11434/v1"


def local(*, is_simulated: bool = False, key_variable: str = "") -> Endpoint:
    return ensure_endpoint(
        label="local", base_url=LOCAL, is_simulated=is_simulated, key_variable=key_variable
    )


def add(slug: str = "llama-otm", **changes: str) -> Contestant:
    facts = {"variant": "OTM", "endpoint": "local", "model": "llama3.1:70b"} | changes
    return contestants.add_contestant(
        slug=slug,
        variant=facts["variant"],
        endpoint=facts["endpoint"],
        model=facts["model"],
        name=facts.get("name"),
    )


def test_the_builtin_contestants_are_made_once() -> None:
    contestants.ensure_builtin()
    contestants.ensure_builtin()
    assert list(Contestant.objects.values_list("slug", "kind")) == [
        ("quantised-20m", "baseline"),
        ("quantised-5m", "baseline"),
        ("reference", "reference"),
        ("rule-placer", "rule"),
    ]


def test_a_model_on_a_real_endpoint_is_a_language_model() -> None:
    local()
    made = add()
    assert (made.kind, made.variant, made.model) == ("llm", "otm", "llama3.1:70b")
    assert made.name == "llama3.1:70b OTM"
    event = Event.objects.filter(object_kind="contestant").get()
    assert (event.verb, event.object_code) == ("add", str(made.code))
    assert event.after is not None
    assert event.after["endpoint"] == "local"


def test_a_model_on_a_simulated_endpoint_is_simulated() -> None:
    local(is_simulated=True)
    assert add().is_simulated


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
    assert made.endpoint is not None
    assert made.endpoint.base_url == "https://api.openai.com/v1"
    assert made.endpoint.key_variable == "OPENAI_API_KEY"
    assert known_endpoints.key_of(made.endpoint) == "sk-very-secret"
    assert "sk-very-secret" not in str(list(Endpoint.objects.values()))
    assert "sk-very-secret" not in str(list(Event.objects.values()))


def test_a_key_in_place_of_its_variable_is_refused_and_not_repeated() -> None:
    with pytest.raises(InvalidDocument, match="not the key") as caught:
        local(key_variable="sk-proj-123")
    assert "sk-proj-123" not in str(caught.value)


def test_an_endpoint_that_moves_is_logged_before_and_after() -> None:
    local()
    ensure_endpoint(label="local", base_url="http://127.0.0.1:9/v1/")
    endpoint = Endpoint.objects.get()
    assert endpoint.base_url == "http://127.0.0.1:9/v1"
    event = Event.objects.filter(verb="change").get()
    assert event.before is not None
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
    facts = ("--variant", "none", "--endpoint", "here", "--model", "m", "--base-url", LOCAL)
    with pytest.raises(CommandError, match="Unknown variant"):
        call_command("add_contestant", "fake", *facts)
    assert not Endpoint.objects.exists()


def test_a_contestant_brings_its_model_which_is_unknown() -> None:
    ensure_endpoint(label="local", base_url=LOCAL)
    for variant in ("otm", "otm"):
        contestants.add_contestant(
            slug="llama", variant=variant, endpoint="local", model="llama3.1"
        )
    known = EndpointModel.objects.get()
    assert (known.endpoint.label, known.model, known.model_class) == ("local", "llama3.1", "")
    abilities = (known.native_tools, known.vision, known.json_schema, known.temperature)
    assert abilities == (None, None, None, None)
    assert (known.price_in_usd, known.price_out_usd) == (None, None)


@pytest.mark.parametrize(
    ("base_url", "says"),
    [
        ("http://169.254.169.254/v1", "link-local or metadata"),
        ("api.openai.com/v1", "an address such as"),
        ("https://x/v1?key=secret", "don't belong"),
    ],
)
def test_an_address_that_no_model_is_served_from_is_refused(base_url: str, says: str) -> None:
    with pytest.raises(InvalidDocument, match=says) as caught:
        ensure_endpoint(label="local", base_url=base_url)
    assert "secret" not in str(caught.value)
    assert not Endpoint.objects.exists()
