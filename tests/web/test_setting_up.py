"""Catalogue, endpoint and contestant without a shell."""

import pytest
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse

from augment.models import Contestant, Endpoint, Event, Scenario
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

ENTERED = {
    **{"slug": "qwen-fc", "name": "", "variant": "fc", "model": "qwen3", "endpoint": ""},
    **{"label": "local", "base_url": "http://127.0.0.1:11434/v1", "key_variable": ""},
    **{"temperature": "0.7", "protocol": "native", "rounds": "", "seed": ""},
}


@pytest.fixture
def admin() -> User:
    return people()["admin"]


@pytest.fixture
def client(admin: User) -> Client:
    return signed_in(admin)


def enter(client: Client, **changes: str) -> str:
    answer = client.post(reverse("contestant-new"), ENTERED | changes, follow=True)
    return answer.content.decode()


def test_the_paper_set_is_loaded_by_a_button_and_loading_it_again_changes_nothing(
    client: Client, admin: User
) -> None:
    assert "Load the paper set" in client.get(reverse("scenarios")).content.decode()
    for says in ("50 added", "0 added, 0 changed, 50 as they were"):
        answer = client.post(reverse("catalogue-load"), {"set": "paper"}, follow=True)
        assert says in answer.content.decode()
    assert Scenario.objects.count() == 50
    assert set(Event.objects.values_list("actor", flat=True)) == {admin.pk, None}
    assert Contestant.objects.filter(slug="reference").exists()


def test_a_contestant_is_entered_with_a_new_endpoint_and_its_options(client: Client) -> None:
    text = enter(client)
    row = Contestant.objects.get(slug="qwen-fc")
    assert (row.variant, row.model) == ("fc", "qwen3")
    assert row.options == {"temperature": 0.7, "protocol": "native"}
    assert row.endpoint is not None
    assert row.endpoint.base_url == "http://127.0.0.1:11434/v1"
    assert "0.7" in text


@pytest.mark.parametrize("base_url", ["http://127.0.0.1:9/v1", "http://127.0.0.1:11434/v1"])
def test_a_new_endpoint_never_moves_the_one_that_has_its_label(
    client: Client, base_url: str
) -> None:
    enter(client)
    text = enter(client, slug="second", base_url=base_url)
    assert "There is an endpoint “local” already" in text
    assert 'value="qwen3"' in text, "the form stays filled in"
    assert Endpoint.objects.get().base_url == "http://127.0.0.1:11434/v1"
    assert not Contestant.objects.filter(slug="second").exists()
