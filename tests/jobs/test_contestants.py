from __future__ import annotations

from io import StringIO
from typing import Any

import pytest
from django.core.management import CommandError, call_command

from augment.errors import Conflict, InvalidDocument
from augment.models import Augmentation, Contestant, Endpoint, Event
from augment.services.endpoints import contestants, known_endpoints
from augment.services.endpoints.known_endpoints import ensure_endpoint, may_hold_key, move_of
from augment.services.running import jobs, runner
from augment.services.running.choosing import find_obstacle, keys_missing
from tests.jobs.models import add_llama, llama_job
from tests.jobs.rows import add_scenario, only_row
from tests.llm.recorder import recorder

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


SECRETS = ("ARENA_SECRET_KEY", "DATABASE_URL", "REDIS_URL", "AWS_SECRET_ACCESS_KEY", "HOME")
URL = "http://127.0.0.1:9/v1"


@pytest.mark.parametrize(
    ("variable", "may"),
    [
        ("OPENAI_API_KEY", True),
        ("_my_API_KEY", True),
        ("LAB_TOKEN", True),
        ("LAB_TOKEN_2", False),
        ("LAB_TOKE", False),
        ("lab_token", False),
        ("API_KEY", False),
        ("_API_KEY", False),
        ("OPENAI_API_KEY_FILE", False),
        ("openai_api_key", False),
        ("2_API_KEY", False),
        ("MY_API_KEY\n", False),
        *((name, False) for name in SECRETS),
    ],
)
def test_which_variables_may_hold_a_key(settings: Any, variable: str, may: bool) -> None:
    settings.KEY_VARIABLES = ["LAB_TOKEN"]
    assert may_hold_key(variable) is may


@pytest.mark.parametrize("variable", SECRETS)
def test_a_variable_that_is_not_for_keys_can_not_be_entered(variable: str) -> None:
    with pytest.raises(InvalidDocument, match=f"{variable} may not be sent to an endpoint"):
        ensure_endpoint(label="thief", base_url=URL, key_variable=variable)
    with pytest.raises(CommandError, match="ends in _API_KEY"):
        call_command(
            *("add_contestant", "thief", "--variant", "otm", "--endpoint", "thief"),
            *("--model", "m", "--base-url", URL, "--key-variable", variable),
        )
    assert not Endpoint.objects.exists()


@pytest.mark.parametrize("variable", SECRETS)
def test_a_variable_that_is_not_for_keys_is_never_read(
    monkeypatch: pytest.MonkeyPatch, variable: str
) -> None:
    monkeypatch.setenv(variable, "the-crown-jewels")
    row = only_row(llama_job())
    with recorder() as server:
        # As if it were written into the table by hand, or from before there was a rule.
        Endpoint.objects.update(base_url=server.url, key_variable=variable)
        runner.work_on(augmentation_pk=row.pk)
    row.refresh_from_db()
    assert server.heard == []
    assert row.state == Augmentation.State.FAILED
    assert f"names the environment variable {variable}, which may not be sent" in row.reason
    assert "the-crown-jewels" not in row.reason


def test_a_contestant_with_such_a_variable_is_refused_at_launch() -> None:
    add_llama()
    add_scenario("street")
    Endpoint.objects.update(key_variable="DATABASE_URL")
    llama = Contestant.objects.get()
    assert "DATABASE_URL may not hold a key" in find_obstacle(llama)
    assert keys_missing(llama) == []
    with pytest.raises(Conflict, match="llama: the variable DATABASE_URL may not hold a key"):
        jobs.launch(name="J", contestants=["llama"], scenarios=["street"])


# --- Another host ------------------------------------------------------------------------------

OLD, NEW = "https://models.example:443", "https://thief.example:443"


def keyed() -> Endpoint:
    return Endpoint.objects.create(
        label="local", base_url="https://models.example/v1", key_variable="MY_API_KEY"
    )


@pytest.mark.parametrize(
    ("base_url", "key_variable", "moves"),
    [
        ("https://thief.example/v1", "MY_API_KEY", True),
        ("https://thief.example/v1", "OTHER_API_KEY", True),
        ("http://models.example/v1", "MY_API_KEY", True),
        ("https://models.example:8443/v1", "MY_API_KEY", True),
        ("https://models.example.evil/v1", "MY_API_KEY", True),
        ("https://thief.example/v1", "", False),
        ("https://models.example/v2", "MY_API_KEY", False),
        ("https://MODELS.example:443/v1", "MY_API_KEY", False),
        ("https://models.example/v1", "OTHER_API_KEY", False),
    ],
)
def test_when_a_key_would_go_to_another_server(
    base_url: str, key_variable: str, moves: bool
) -> None:
    found = move_of(endpoint=keyed(), base_url=base_url, key_variable=key_variable)
    assert (found is not None) is moves


def test_a_key_goes_to_another_host_only_when_told_twice_and_is_logged() -> None:
    keyed()
    command = (
        *("add_contestant", "one", "--variant", "otm", "--endpoint", "local", "--model", "m"),
        *("--base-url", "https://thief.example/v1", "--key-variable", "MY_API_KEY"),
    )
    with pytest.raises(CommandError, match=f"went to {OLD} and would go to {NEW}. Say"):
        call_command(*command)
    assert Endpoint.objects.get().base_url == "https://models.example/v1"
    assert not Event.objects.exists()
    call_command(*command, "--move-key")
    assert Endpoint.objects.get().base_url == "https://thief.example/v1"
    event = Event.objects.get(verb="move key")
    assert (event.before, event.after) == (
        {"server": OLD},
        {"server": NEW, "key_variable": "MY_API_KEY"},
    )
