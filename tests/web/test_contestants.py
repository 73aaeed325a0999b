"""Pages of contestants: in full, and out of forms once they are retired."""

import pytest
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse

from augment.models import Contestant, Endpoint, EndpointModel, Event, Scenario
from augment.services.endpoints import contestants
from augment.services.endpoints.contestants import ContestantRequest
from augment.services.endpoints.known_endpoints import EndpointRequest, ensure_endpoint
from augment.services.running.choosing import resolve_contestants
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


def test_a_retired_contestant_is_offered_no_more_and_keeps_its_page() -> None:
    row, other = add(), add("two")
    admin = signed_in(people()["admin"])
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


@pytest.fixture
def admin() -> User:
    return people()["admin"]


@pytest.fixture
def client(admin: User) -> Client:
    return signed_in(admin)


def test_the_paper_set_is_loaded_by_a_button_and_loading_it_again_changes_nothing(
    client: Client, admin: User
) -> None:
    assert "Load the paper set" in client.get(reverse("scenarios")).content.decode()
    for says in ("50 added", "50 unchanged"):
        answer = client.post(reverse("catalogue-load"), {"set": "paper"}, follow=True)
        assert says in answer.content.decode()
    assert Scenario.objects.count() == 50
    assert set(Event.objects.values_list("actor", flat=True)) == {admin.pk, None}
    assert Contestant.objects.filter(slug="reference").exists()


def test_a_contestant_is_entered_with_its_options(client: Client) -> None:
    address = reverse("contestant-new")
    assert "No model yet" in client.get(address).content.decode()
    endpoint = Endpoint.objects.create(label="local", base_url="http://127.0.0.1:11434/v1")
    EndpointModel.objects.create(endpoint=endpoint, model="qwen3")
    assert "0.7" in client.post(address, ENTERED, follow=True).content.decode()
    row = Contestant.objects.get(slug="qwen3-fc-t0p7-native")
    assert (row.variant, row.model, row.endpoint) == ("fc", "qwen3", endpoint)
    assert row.options == {"temperature": 0.7, "protocol": "native"}
