"""Endpoints and their models as rows, and as admins edit them."""

from __future__ import annotations

from datetime import date
from typing import Any

import pytest
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse

from augment.models import Endpoint, EndpointModel, Event
from augment.services.endpoints import contestants
from augment.services.endpoints.known_endpoints import ensure_endpoint

pytestmark = pytest.mark.django_db
LOCAL = "http://127.0.0.1:11434/v1"


def form(*models: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """What a browser sends from the page of an endpoint."""
    fields = {
        "label": "local",
        "base_url": LOCAL,
        "key_variable": "",
        "max_concurrency": "4",
        "requests_per_minute": "",
    }
    sent = fields | changes
    held = sum("id" in model for model in models)
    sent |= {"models-TOTAL_FORMS": str(len(models)), "models-INITIAL_FORMS": str(held)}
    for number, model in enumerate(models):
        sent |= {f"models-{number}-{name}": value for name, value in model.items()}
    return sent


@pytest.fixture
def office(client: Client) -> Client:
    client.force_login(User.objects.create_superuser("admin", password="x"))
    return client


def problems(page: Any) -> str:
    errors = [str(page.context["adminform"].form.errors)]
    errors += [str(inline.formset.errors) for inline in page.context["inline_admin_formsets"]]
    return " ".join(errors)


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


def test_an_admin_adds_an_endpoint_with_a_model_and_it_is_logged(office: Client) -> None:
    model = {
        "model": "llama3.1",
        "model_class": "open_weight",
        "vision": "false",
        "native_tools": "unknown",
        "price_in_usd": "0.34",
        "price_out_usd": "0.39",
        "price_as_of": "2026-11-20",
        "price_source": "the host's page",
    }
    sent = form(model, base_url="http://vllm:8000/v1/", requests_per_minute="60")
    page = office.post(reverse("admin:augment_endpoint_add"), sent)
    assert page.status_code == 302, problems(page)
    endpoint = Endpoint.objects.get()
    assert (endpoint.base_url, endpoint.requests_per_minute) == ("http://vllm:8000/v1", 60)
    known = endpoint.models.get()
    assert (known.vision, known.native_tools, known.price_as_of) == (
        False,
        None,
        date(2026, 11, 20),
    )
    event = Event.objects.get()
    assert (event.verb, event.actor) == ("add", User.objects.get())
    assert event.after is not None
    assert event.after["models"][0]["price_in_usd"] == "0.340000"
