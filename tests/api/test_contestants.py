from __future__ import annotations

import pytest
from django.db import connection
from django.test.utils import CaptureQueriesContext
from django.urls import reverse

from augment.models import EndpointModel
from augment.services.endpoints import contestants
from augment.services.endpoints.known_endpoints import ensure_endpoint
from augment.variants.options import ContestantOptions
from augment.variants.transcript import ModelRole
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def test_a_contestant_is_told_in_full_to_staff_alone() -> None:
    ensure_endpoint(label="here", base_url="http://127.0.0.1:1/v1")
    contestants.add_contestant(
        slug="one",
        variant="otm",
        endpoint="here",
        model="m",
        options=ContestantOptions(temperature=0.7),
    )
    EndpointModel.objects.update(temperature=False)
    accounts = people()
    address = reverse("api-contestants")
    assert signed_in(accounts["expert"]).get(address).status_code == 403
    (found,) = signed_in(accounts["analyst"]).get(address).json()["results"]
    assert (found["slug"], found["retired_at"]) == ("one", None)
    assert (found["options"], found["frozen_options"]) == ({"temperature": 0.7}, None)
    assert found["left_out"] == {"modifier": ["temperature"]}


def test_a_list_asks_as_often_however_many_have_not_run() -> None:
    for label in ("here", "there"):
        ensure_endpoint(label=label, base_url="http://127.0.0.1:1/v1")
    asking, address = signed_in(people()["analyst"]), reverse("api-contestants")

    def add(number: int) -> None:
        contestants.add_contestant(
            slug=f"one-{number}",
            variant="tqa",
            endpoint="here",
            model=f"m-{number}",
            roles={ModelRole.REVIEWER: ("there", "r")},
            options=ContestantOptions(temperature=number / 10),
        )

    def ask() -> int:
        with CaptureQueriesContext(connection) as seen:
            answer = asking.get(address)
        assert answer.status_code == 200
        return len(seen)

    add(1)
    ask()
    few = ask()
    for number in range(2, 6):
        add(number)
    EndpointModel.objects.filter(model="m-5").update(temperature=False)
    assert ask() == few
    last = asking.get(address).json()["results"][-1]
    assert (last["slug"], last["left_out"]) == ("one-5", {"modifier": ["temperature"]})
