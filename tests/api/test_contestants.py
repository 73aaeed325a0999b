import pytest
from django.urls import reverse

from augment.services.endpoints import contestants
from augment.services.endpoints.contestants import ContestantRequest
from augment.services.endpoints.known_endpoints import EndpointRequest, ensure_endpoint
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def test_a_contestant_is_told_in_full_to_staff_alone() -> None:
    ensure_endpoint(EndpointRequest(label="here", base_url="http://127.0.0.1:1/v1"))
    contestants.add_contestant(
        ContestantRequest(
            slug="one", variant="otm", endpoint="here", model="m", options={"temperature": 0.7}
        )
    )
    accounts = people()
    address = reverse("api-contestants")
    assert signed_in(accounts["expert"]).get(address).status_code == 403
    (found,) = signed_in(accounts["researcher"]).get(address).json()["results"]
    assert (found["slug"], found["retired_at"]) == ("one", None)
    assert (found["options"], found["frozen_options"]) == ({"temperature": 0.7}, None)
    assert (found["endpoint"], found["model"], found["roles"]) == ("here", "m", {})
