"""Contestants, endpoints, models and lists of many by the pages."""

from collections.abc import Callable, Iterator
from decimal import Decimal

import pytest
from django.conf import LazySettings
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse

from arena.models import Study
from augment.fake_llm.server import FakeServer, running
from augment.llm.questions import Ability
from augment.models import (
    Augmentation,
    BaseScene,
    Contestant,
    Endpoint,
    EndpointModel,
    Event,
    GenerationJob,
    Probe,
)
from augment.services.endpoints import contestants, known_endpoints, probing
from augment.services.endpoints.contestants import ContestantRequest
from augment.services.endpoints.known_endpoints import EndpointRequest, ensure_endpoint
from augment.services.endpoints.known_models import model_at
from augment.services.running.choosing import resolve_contestants
from augment.services.running.workers import Presence
from augment.services.work import Lease
from tests.jobs import rows
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def add(slug: str = "one") -> Contestant:
    ensure_endpoint(EndpointRequest(label="here", base_url="http://127.0.0.1:1/v1"))
    return contestants.add_contestant(
        ContestantRequest(
            slug=slug,
            variant="fc+tqa",
            endpoint="here",
            model="m",
            name=slug.upper(),
            options={"temperature": 0.7, "rounds": 2},
        )
    )


def test_a_retired_contestant_is_offered_no_more_and_keeps_its_page(admin: Client) -> None:
    row, other = add(), add("two")
    admin.post(reverse("contestant-retired", args=[row.code]), {"retired": "yes"})
    for page in ("job-new", "study-new"):
        form = admin.get(reverse(page)).content.decode()
        assert 'name="contestants" value="one"' not in form
        assert 'name="contestants" value="two"' in form
    assert "one" not in resolve_contestants(["all"])
    assert resolve_contestants(["one"]) == ["one"]
    listed = admin.get(reverse("contestants"), {"offered": "active"}).content.decode()
    assert ("ONE" in listed, "TWO" in listed) == (False, True)
    assert (
        "forms offer it no more"
        in admin.get(reverse("contestant", args=[row.code])).content.decode()
    )
    admin.post(reverse("contestant-retired", args=[row.code]), {"retired": "no"})
    assert "one" in resolve_contestants(["all"])
    told = set(Event.objects.filter(object_code=row.code).values_list("verb", flat=True))
    assert {"retire", "take back"} <= told
    assert other.retired_at is None


ENTERED = {
    **{"name": "", "variant": "fc", "model": "local|qwen3"},
    **{"temperature": "0.7", "protocol": "native", "rounds": "", "seed": ""},
}


def test_the_paper_set_is_loaded_by_a_button(admin: Client, accounts: dict[str, User]) -> None:
    assert "Load the paper set" in admin.get(reverse("scenarios")).content.decode()
    answer = admin.post(reverse("catalogue-load"), {"set": "paper"}, follow=True)
    assert "50 added" in answer.content.decode()
    assert set(Event.objects.values_list("actor", flat=True)) == {accounts["admin"].pk, None}
    assert Contestant.objects.filter(slug="reference").exists()


def test_a_contestant_is_entered_with_its_options(admin: Client) -> None:
    address = reverse("contestant-new")
    assert "No model yet" in admin.get(address).content.decode()
    endpoint = Endpoint.objects.create(label="local", base_url="http://127.0.0.1:11434/v1")
    EndpointModel.objects.create(endpoint=endpoint, model="qwen3")
    assert "0.7" in admin.post(address, ENTERED, follow=True).content.decode()
    row = Contestant.objects.get(slug="qwen3-fc-t0p7-native")
    assert (row.variant, row.model, row.endpoint) == ("fc", "qwen3", endpoint)
    assert row.options == {"temperature": 0.7, "protocol": "native"}


GIVEN = {
    "label": "here",
    "base_url": "http://127.0.0.1:9/v1/",
    "key_variable": "HERE_API_KEY",
    "max_concurrency": "3",
    "requests_per_minute": "60",
}


@pytest.fixture
def keeper(settings: LazySettings) -> Client:
    settings.KEY_VARIABLES = ["HERE_API_KEY=127.0.0.1:9"]
    return signed_in(people()["admin"])


@pytest.fixture
def model() -> EndpointModel:
    request = known_endpoints.EndpointRequest(label="here", base_url="http://127.0.0.1:9/v1")
    site = known_endpoints.add_endpoint(request)
    return model_at(endpoint=site, model="m")


def post(keeper: Client, name: str, given: dict[str, str], **where: object) -> str:
    address = reverse(name, kwargs=where)
    return keeper.post(address, given, follow=True).content.decode()


def test_an_endpoint_is_added_with_its_limits_and_shows_no_key(
    keeper: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HERE_API_KEY", "sk-very-secret")
    shown = post(keeper, "endpoint-new", GIVEN)
    row = Endpoint.objects.get()
    assert (row.base_url, row.max_concurrency, row.requests_per_minute) == (
        "http://127.0.0.1:9/v1",
        3,
        60,
    )
    assert "“here” is added." in shown
    pages = [shown, keeper.get(reverse("endpoints")).content.decode()]
    assert all("HERE_API_KEY" in page and "sk-very-secret" not in page for page in pages)
    assert "No worker runs" in pages[1]
    Presence("here 1").beat()
    assert "Key found" in keeper.get(reverse("endpoints")).content.decode()
    monkeypatch.delenv("HERE_API_KEY")
    Presence("here 2").beat()
    assert "Key not found" in keeper.get(reverse("endpoints")).content.decode(), "not in each"
    told = Event.objects.get(verb="add", object_kind="endpoint").after or {}
    assert told["max_concurrency"] == 3


def test_what_no_endpoint_can_be_is_refused_at_its_field(keeper: Client) -> None:
    for field, value, words in (
        ("base_url", "ftp://x/v1", "An address such as https://api.openai.com/v1 is needed"),
        ("base_url", "http://169.254.169.254/v1", "no model is served from there"),
        ("base_url", "https://me:secret@x.example/v1", "Keys and passwords don&#x27;t belong"),
        ("key_variable", "DJANGO_SECRET_KEY", "may not be sent to an endpoint"),
        ("key_variable", "sk-abc", "The name of an environment variable is needed, not the key"),
        ("max_concurrency", "0", "greater than or equal to 1"),
    ):
        assert words in post(keeper, "endpoint-new", GIVEN | {field: value}), (field, value)
    assert not Endpoint.objects.exists()
    post(keeper, "endpoint-new", GIVEN)
    row = Endpoint.objects.get()
    moved = GIVEN | {"base_url": "https://models.example.org/v1"}
    shown = post(keeper, "endpoint", moved, code=row.code)
    assert "HERE_API_KEY is not bound to models.example.org:443" in shown
    row.refresh_from_db()
    assert row.base_url == "http://127.0.0.1:9/v1"


def test_a_model_keeps_what_somebody_knows_and_no_half_of_a_price(
    keeper: Client, model: EndpointModel
) -> None:
    known = {"model_class": "open_weight", "vision": "false", "price_in_usd": "0.5"}
    shown = post(keeper, "endpoint-model", known, code=model.code)
    assert "a price needs both halves, a date and a source" in shown.lower()
    whole = known | {
        "price_out_usd": "1.5",
        "price_as_of": "2026-11-20",
        "price_source": "our contract",
    }
    assert "Kept." in post(keeper, "endpoint-model", whole, code=model.code)
    model.refresh_from_db()
    assert (model.vision, model.native_tools, model.model_class) == (False, None, "open_weight")
    assert (model.price_in_usd, model.price_out_usd) == (Decimal("0.5"), Decimal("1.5"))
    listed = keeper.get(reverse("endpoint", args=[model.endpoint.code])).content.decode()
    assert "$0.50" in listed
    refused = post(keeper, "endpoint-model", whole | {"price_in_usd": "-1"}, code=model.code)
    assert "a price is 0 or more" in refused


# --- Probes --------------------------------------------------------------------------------------


@pytest.fixture
def stand_in() -> Iterator[FakeServer]:
    with running() as serving:
        yield serving


def test_a_probe_is_asked_for_on_the_page_and_its_lines_appear_one_by_one(
    keeper: Client,
    model: EndpointModel,
    stand_in: FakeServer,
    monkeypatch: pytest.MonkeyPatch,
    django_capture_on_commit_callbacks: Callable[..., object],
) -> None:
    Endpoint.objects.update(base_url=stand_in.url, is_simulated=True)
    model.delete()
    with django_capture_on_commit_callbacks() as waiting:  # type: ignore[attr-defined]
        asked = {"model": "fake-no-vision"}
        added = keeper.post(reverse("endpoint-model-new", args=[model.endpoint.code]), asked)
    assert len(waiting) == 1, "its message is sent once the row is stored"
    probe, address = Probe.objects.get(), added["Location"]
    model = probe.model
    shown = keeper.get(address).content.decode()
    assert (shown.count("data-ability"), shown.count("waiting")) == (len(Ability), len(Ability))
    assert "js/live.js" in shown
    seen: list[tuple[int, int]] = []
    note = Lease.note

    def look(held: Lease[Probe], **columns: object) -> None:
        note(held, **columns)
        page = keeper.get(address).content.decode()
        seen.append((page.count("asked now"), page.count(">waiting")))

    monkeypatch.setattr(Lease, "note", look)
    assert probing.PROBES.perform(probe.pk)
    assert [asked for asked, _ in seen] == [*[1] * (len(Ability) - 1), 0], "the next one is asked"
    shown = keeper.get(address).content.decode()
    assert "js/live.js" not in shown
    assert "Last report:" in shown
    model.refresh_from_db()
    assert (model.vision, model.native_tools) == (False, True)
    assert not probing.PROBES.perform(probe.pk), "a second message asks nothing"


def test_models_that_the_server_lists_and_nobody_named_are_suggested(
    keeper: Client, model: EndpointModel
) -> None:
    address = reverse("endpoint-listed", args=[model.endpoint.code])
    silent = keeper.get(address).json()
    assert (silent["models"], "refused" in silent["problem"]) == ([], True)
    with running() as server:
        Endpoint.objects.update(base_url=server.url)
        EndpointModel.objects.update(model="fake-good")
        listed = keeper.get(address).json()
    assert listed["problem"] == ""
    assert "fake-careless" in listed["models"]
    assert "fake-good" not in listed["models"]


MANY = 130
Questions = Callable[[int], object]


def list_of(client: Client, name: str, query: str = "") -> str:
    return client.get(reverse(name) + query).content.decode()


def add_many() -> None:
    """So many of everything, and a row of each job."""
    (street, *_), (who, *_) = rows.add_many_scenarios(MANY), rows.add_many_contestants(MANY)
    BaseScene.objects.update(slug="recorded")
    jobs = GenerationJob.objects.bulk_create(
        GenerationJob(name=f"Job {number:03}", state="finished") for number in range(MANY)
    )
    Study.objects.bulk_create(
        Study(name=f"Study {number:03}", votes_per_expert=1, seed=1) for number in range(MANY)
    )
    Augmentation.objects.bulk_create(
        Augmentation(job=job, scenario=street, contestant=who, state="failed", reason="broke")
        for job in jobs
    )


LISTS = {
    # page: what a row is told by, how many a page has
    "jobs": ("Job ", 25),
    "studies": ('">Study ', 25),
    "contestants": ('/">Who ', 50),
    "scenarios": ("<b>street-", 16),
}


def test_lists_are_shown_page_by_page_and_found_in(
    admin: Client, django_assert_max_num_queries: Questions
) -> None:
    add_many()
    for name, (mark, size) in LISTS.items():
        admin.get(reverse(name))
        with django_assert_max_num_queries(18):  # type: ignore[attr-defined]
            first = list_of(admin, name)
        assert (first.count(mark), "<span>1 of " in first) == (size, True), name
        assert 0 < list_of(admin, name, "?page=99").count(mark) <= size, name
        assert list_of(admin, name, "?page=nonsense").count(mark) == size, name
        assert list_of(admin, name, "?q=077").count(mark) == 1, name
        nothing = list_of(admin, name, "?q=no-such-thing")
        assert (nothing.count(mark), "Nothing is like that." in nothing) == (0, True), name
