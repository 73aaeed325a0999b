"""What no resource answers for has the one shape of the wire as well: nobody gets a page there."""

from typing import Any

import pytest
from django.core.exceptions import PermissionDenied, SuspiciousOperation
from django.http import HttpRequest, HttpResponse
from django.test import Client
from django.urls import include, path
from django.views.decorators.http import require_POST
from rest_framework.exceptions import Throttled
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.views import ApiView
from tests.api.asking import error_of, signed_in
from tests.web.cast import people

pytestmark = [pytest.mark.django_db, pytest.mark.urls(__name__)]

RAISED: dict[str, tuple[Exception, int, str]] = {
    "fault": (ZeroDivisionError("secret of the house"), 500, "broken"),
    "memory": (MemoryError(), 500, "broken"),
    "depth": (RecursionError(), 500, "broken"),
    "refused": (PermissionDenied(), 403, "forbidden"),
    "suspicious": (SuspiciousOperation(), 400, "bad_request"),
    "throttled": (Throttled(wait=3), 429, "too_fast"),
}


class Raising(ApiView):
    """A resource that raises what its address says."""

    readers = ("admin",)

    def get(self, request: Request, name: str) -> Response:
        raise RAISED[name][0]


@require_POST
def view(request: HttpRequest) -> HttpResponse:
    """A plain view below the address of the wire, with Django's own check of the token."""
    raise AssertionError("never reached without a token")


urlpatterns = [
    path("api/v1/raise/<str:name>", Raising.as_view()),
    path("api/v1/plain", view),
    path("", include("arena.config.urls")),
]
handler400 = "arena.config.faults.answer_unreadable"
handler403 = "arena.config.faults.answer_refused"
handler404 = "arena.config.faults.answer_missing"
handler500 = "arena.config.faults.answer_broken"


def client_of(role: str = "admin", **options: Any) -> Client:
    client = Client(raise_request_exception=False, **options)
    client.force_login(people()[role])
    return client


def test_whatever_a_resource_raises_is_told_in_the_one_shape() -> None:
    client = client_of()
    for name, (_, status, code) in RAISED.items():
        answer = client.get(f"/api/v1/raise/{name}")
        error_of(answer, status, code)
        assert answer["Content-Type"] == "application/json", name
        assert b"secret" not in answer.content


def test_unknown_addresses_and_things_are_404_in_the_one_shape() -> None:
    client = client_of()
    error_of(client.get("/api/v1/nothing"), 404, "not_found")
    error_of(client.get("/api/"), 404, "not_found")
    error_of(client.post("/api/v1/votes/", {}, content_type="application/json"), 404, "not_found")
    gone = "00000000-0000-4000-8000-000000000000"
    error_of(client.get(f"/api/v1/jobs/{gone}/progress"), 404, "not_found")
    error_of(Client().get("/api/v1/nothing"), 404, "not_found")


def test_a_missing_token_a_wrong_host_and_a_wrong_wish_are_told_so_too() -> None:
    careful = client_of(enforce_csrf_checks=True)
    error_of(careful.post("/api/v1/plain", {}), 403, "forbidden")
    error_of(careful.get("/api/v1/nothing", HTTP_HOST="elsewhere.example"), 400, "bad_request")
    wanted = signed_in("the-expert").get("/api/v1/matchups", HTTP_ACCEPT="text/html")
    error_of(wanted, 406, "not_acceptable")
