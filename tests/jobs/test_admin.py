from __future__ import annotations

import pytest
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse
from django.utils import timezone

from augment.models import (
    Attempt,
    Augmentation,
    Endpoint,
    EndpointModel,
    Event,
    GenerationJob,
    ModelCall,
)
from tests.jobs.rows import add_model, done, launch, leased, only_row

pytestmark = pytest.mark.django_db
PAST = (Augmentation, Attempt, Event, GenerationJob, ModelCall)


@pytest.fixture
def office(client: Client) -> Client:
    client.force_login(User.objects.create_superuser("admin", password="x"))
    return client


def past_job() -> None:
    row = only_row(launch())
    held = leased(row, now=timezone.now())
    ModelCall.objects.create(
        attempt=row.attempts.get(),
        number=1,
        role="modifier",
        request={},
        started_at=timezone.now(),
        settled_at=timezone.now(),
    )
    held.settle(done(), now=timezone.now())
    endpoint = Endpoint.objects.create(label="local", base_url="http://127.0.0.1:9/v1")
    EndpointModel.objects.create(endpoint=endpoint, model="llama3.1")
    add_model("llama", endpoint=endpoint, model="llama3.1")


@pytest.mark.parametrize("model", PAST)
def test_what_is_past_can_only_be_read(office: Client, model: type) -> None:
    past_job()
    name = f"admin:augment_{model._meta.model_name}"  # type: ignore[attr-defined]
    row = model.objects.first()  # type: ignore[attr-defined]
    assert office.get(reverse(f"{name}_add")).status_code == 403
    assert office.post(reverse(f"{name}_change", args=[row.pk]), {}).status_code == 403
    assert office.post(reverse(f"{name}_delete", args=[row.pk]), {}).status_code == 403
