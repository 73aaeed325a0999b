"""Every answer says how long it may be kept and that no page asks for camera or position."""

import pytest
from django.conf import LazySettings
from django.http import HttpRequest, HttpResponse
from django.test import Client
from django.urls import include, path, reverse
from django.views.decorators.csrf import csrf_exempt

from tests.web.cast import people, signed_in, world

pytestmark = pytest.mark.django_db

GONE = "/studies/00000000-0000-4000-8000-000000000000/"


def broken(request: HttpRequest) -> HttpResponse:
    raise RuntimeError("on purpose")


urlpatterns = [path("broken/", csrf_exempt(broken)), path("", include("arena.config.urls"))]
handler404 = "arena.config.faults.answer_missing"
handler500 = "arena.config.faults.answer_broken"


@pytest.mark.parametrize(
    ("address", "status"),
    [
        ("/", 200),
        ("/jobs/", 200),
        (GONE, 404),
        ("/jobs", 301),
        ("/logout/", 405),
        ("/label/x/", 404),
        ("/broken/", 500),
        ("/api/v1/matchups", 403),
        ("/api/v1/votes", 403),
        ("/api/v1/nothing", 404),
    ],
)
@pytest.mark.urls(__name__)
def test_pages_the_wire_and_errors_are_kept_by_nobody(address: str, status: int) -> None:
    client = signed_in(people()["admin"])
    client.raise_request_exception = False
    answer = client.get(address)
    assert answer.status_code == status
    assert "no-store" in answer["Cache-Control"]
    assert "private" in answer["Cache-Control"]
    assert "camera=()" in answer["Permissions-Policy"]
    assert "geolocation=()" in answer["Permissions-Policy"]


def test_redirects_and_refusals_before_any_page_say_so_as_well(settings: LazySettings) -> None:
    forged = Client(enforce_csrf_checks=True).post(reverse("login"), {"username": "eva"})
    unknown = Client().get("/", HTTP_HOST="elsewhere.example")
    settings.SECURE_SSL_REDIRECT = True
    secured = Client().get("/")
    assert [one.status_code for one in (forged, unknown, secured)] == [403, 400, 301]
    for answer in (forged, unknown, secured):
        assert "no-store" in answer["Cache-Control"]
        assert "camera=()" in answer["Permissions-Policy"]


def test_pictures_and_static_files_keep_their_own(settings: LazySettings) -> None:
    settings.WHITENOISE_USE_FINDERS = True  # here nothing is collected
    some = world()
    matchup = some.study.matchups.filter(expert=some.expert)[0]
    picture = signed_in(some.expert).get(reverse("matchup-image", args=[matchup.left_token]))
    b"".join(picture)  # closes its file
    assert picture["Cache-Control"] == "private, max-age=31536000, immutable"
    script = Client().get("/static/js/vote.js")
    assert (script.status_code, bool(b"".join(script))) == (200, True)
    assert "public" in script["Cache-Control"]
    assert "no-store" not in script["Cache-Control"]
    assert "camera=()" in picture["Permissions-Policy"]
    assert "camera=()" in script["Permissions-Policy"]
