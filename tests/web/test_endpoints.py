"""Endpoints, their models and prices by the pages; probes by a worker, line by line."""

from collections.abc import Callable, Iterator
from decimal import Decimal

import pytest
from django.conf import LazySettings
from django.test import Client
from django.urls import reverse

from augment.fake_llm.server import FakeServer, running
from augment.llm.questions import Ability
from augment.models import Endpoint, EndpointModel, Event, Probe
from augment.services.endpoints import known_endpoints, probing
from augment.services.endpoints.known_models import model_at
from augment.services.running.workers import Presence
from augment.services.work import Lease
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

GIVEN = {
    "label": "here",
    "base_url": "http://127.0.0.1:9/v1/",
    "key_variable": "HERE_API_KEY",
    "max_concurrency": "3",
    "requests_per_minute": "60",
}


@pytest.fixture
def admin(settings: LazySettings) -> Client:
    settings.KEY_VARIABLES = ["HERE_API_KEY=127.0.0.1:9"]
    return signed_in(people()["admin"])


@pytest.fixture
def model() -> EndpointModel:
    request = known_endpoints.EndpointRequest(label="here", base_url="http://127.0.0.1:9/v1")
    site = known_endpoints.add_endpoint(request)
    return model_at(endpoint=site, model="m")


def post(admin: Client, name: str, given: dict[str, str], **where: object) -> str:
    address = reverse(name, kwargs=where)
    return admin.post(address, given, follow=True).content.decode()


def test_an_endpoint_is_added_with_its_limits_and_shows_no_key(
    admin: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HERE_API_KEY", "sk-very-secret")
    shown = post(admin, "endpoint-new", GIVEN)
    row = Endpoint.objects.get()
    assert (row.base_url, row.max_concurrency, row.requests_per_minute) == (
        "http://127.0.0.1:9/v1",
        3,
        60,
    )
    assert "“here” is added." in shown
    pages = [shown, admin.get(reverse("endpoints")).content.decode()]
    assert all("HERE_API_KEY" in page and "sk-very-secret" not in page for page in pages)
    assert "No worker runs" in pages[1]
    Presence("here 1").beat()
    assert "Key found" in admin.get(reverse("endpoints")).content.decode()
    monkeypatch.delenv("HERE_API_KEY")
    Presence("here 2").beat()
    assert "Key not found" in admin.get(reverse("endpoints")).content.decode(), "not in each"
    told = Event.objects.get(verb="add", object_kind="endpoint").after or {}
    assert told["max_concurrency"] == 3


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("base_url", "ftp://x/v1", "An address such as https://api.openai.com/v1 is needed"),
        ("base_url", "http://169.254.169.254/v1", "no model is served from there"),
        ("base_url", "https://me:secret@x.example/v1", "Keys and passwords don&#x27;t belong"),
        ("key_variable", "DJANGO_SECRET_KEY", "may not be sent to an endpoint"),
        ("key_variable", "OPENAI_API_KEY", "OPENAI_API_KEY is not bound to 127.0.0.1:9"),
        ("key_variable", "sk-abc", "The name of an environment variable is needed, not the key"),
        ("max_concurrency", "0", "greater than or equal to 1"),
        ("requests_per_minute", "0", "greater than or equal to 1"),
    ],
)
def test_what_no_endpoint_can_be_is_refused_at_its_field(
    admin: Client, field: str, value: str, words: str
) -> None:
    shown = post(admin, "endpoint-new", GIVEN | {field: value})
    assert words in shown
    assert not Endpoint.objects.exists()


def test_a_key_goes_to_no_other_server(admin: Client) -> None:
    post(admin, "endpoint-new", GIVEN)
    row = Endpoint.objects.get()
    moved = GIVEN | {"base_url": "https://models.example.org/v1"}
    shown = post(admin, "endpoint", moved, code=row.code)
    assert "HERE_API_KEY is not bound to models.example.org:443" in shown
    row.refresh_from_db()
    assert row.base_url == "http://127.0.0.1:9/v1"


def test_a_model_keeps_what_somebody_knows_and_no_half_of_a_price(
    admin: Client, model: EndpointModel
) -> None:
    known = {"model_class": "open_weight", "vision": "false", "price_in_usd": "0.5"}
    shown = post(admin, "endpoint-model", known, code=model.code)
    assert "a price needs both halves, a date and a source" in shown.lower()
    whole = known | {
        "price_out_usd": "1.5",
        "price_as_of": "2026-11-20",
        "price_source": "our contract",
    }
    assert "Kept." in post(admin, "endpoint-model", whole, code=model.code)
    model.refresh_from_db()
    assert (model.vision, model.native_tools, model.model_class) == (False, None, "open_weight")
    assert (model.price_in_usd, model.price_out_usd) == (Decimal("0.5"), Decimal("1.5"))
    listed = admin.get(reverse("endpoint", args=[model.endpoint.code])).content.decode()
    assert "$0.50" in listed
    refused = post(admin, "endpoint-model", whole | {"price_in_usd": "-1"}, code=model.code)
    assert "a price is 0 or more" in refused


# --- Probes --------------------------------------------------------------------------------------


@pytest.fixture
def stand_in() -> Iterator[FakeServer]:
    with running() as serving:
        yield serving


def test_a_probe_is_asked_for_on_the_page_and_its_lines_appear_one_by_one(
    admin: Client,
    model: EndpointModel,
    stand_in: FakeServer,
    monkeypatch: pytest.MonkeyPatch,
    django_capture_on_commit_callbacks: Callable[..., object],
) -> None:
    Endpoint.objects.update(base_url=stand_in.url, is_simulated=True)
    model.delete()
    with django_capture_on_commit_callbacks() as waiting:  # type: ignore[attr-defined]
        asked = {"model": "fake-no-vision"}
        added = admin.post(reverse("endpoint-model-new", args=[model.endpoint.code]), asked)
    assert len(waiting) == 1, "its message is sent once the row is stored"
    probe, address = Probe.objects.get(), added["Location"]
    model = probe.model
    shown = admin.get(address).content.decode()
    assert (shown.count("data-ability"), shown.count("waiting")) == (len(Ability), len(Ability))
    assert "js/live.js" in shown
    seen: list[tuple[int, int]] = []
    note = Lease.note

    def look(held: Lease[Probe], **columns: object) -> None:
        note(held, **columns)
        page = admin.get(address).content.decode()
        seen.append((page.count("asked now"), page.count(">waiting")))

    monkeypatch.setattr(Lease, "note", look)
    assert probing.PROBES.perform(probe.pk)
    assert [asked for asked, _ in seen] == [*[1] * (len(Ability) - 1), 0], "the next one is asked"
    shown = admin.get(address).content.decode()
    assert "js/live.js" not in shown
    assert "Last report:" in shown
    model.refresh_from_db()
    assert (model.vision, model.native_tools) == (False, True)
    assert not probing.PROBES.perform(probe.pk), "a second message asks nothing"


def test_models_that_the_server_lists_and_nobody_named_are_suggested(
    admin: Client, model: EndpointModel
) -> None:
    address = reverse("endpoint-listed", args=[model.endpoint.code])
    silent = admin.get(address).json()
    assert (silent["models"], "refused" in silent["problem"]) == ([], True)
    with running() as server:
        Endpoint.objects.update(base_url=server.url)
        EndpointModel.objects.update(model="fake-good")
        listed = admin.get(address).json()
    assert listed["problem"] == ""
    assert "fake-careless" in listed["models"]
    assert "fake-good" not in listed["models"]
