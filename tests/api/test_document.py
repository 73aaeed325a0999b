"""The OpenAPI document, the one shape of faults, and clients that are sent elsewhere."""

import json

import pytest
from django.urls import reverse
from drf_spectacular.drainage import GENERATOR_STATS
from drf_spectacular.validation import validate_schema

from arena.api.views import make_document
from arena.site.api_urls import urlpatterns
from client.arena_client import ApiError, Arena
from tests.llm.json_server import recorder
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def test_the_document_is_valid_and_made_without_a_warning(
    capsys: pytest.CaptureFixture[str],
) -> None:
    make_document.cache_clear()
    with GENERATOR_STATS.silence():
        GENERATOR_STATS.reset()
        document = make_document()
        assert not GENERATOR_STATS, capsys.readouterr().err
    validate_schema(document)  # type: ignore[no-untyped-call]


def test_every_address_is_in_it() -> None:
    described = set(make_document()["paths"])
    for pattern in urlpatterns:
        if pattern.name != "api-document":
            address = "/api/v1/" + str(pattern.pattern)
            for kind in ("uuid", "slug", "str"):
                address = address.replace(f"<{kind}:", "{")
            assert address.replace(">", "}") in described


def test_every_operation_tells_its_errors_in_the_one_shape() -> None:
    for path, methods in make_document()["paths"].items():
        for method, operation in methods.items():
            answers = operation["responses"]
            assert {"422", "429", "503"} <= set(answers), (method, path)
            for status, answer in answers.items():
                if status >= "400":
                    shape = answer["content"]["application/json"]["schema"]
                    assert shape == {"$ref": "#/components/schemas/ErrorBody"}, (path, status)


def test_staff_read_it() -> None:
    accounts = people()
    assert signed_in(accounts["expert"]).get(reverse("api-document")).status_code == 403
    served = signed_in(accounts["researcher"]).get(reverse("api-document")).json()
    assert served == json.loads(json.dumps(make_document(), default=str))


def test_a_redirect_is_told_and_not_followed() -> None:
    with recorder(301, {}, {"Location": "/there"}) as moved:
        arena = Arena(moved.url.removesuffix("/v1"), "arena_secret")
        with pytest.raises(ApiError, match="301 moved: this leads to /there") as told:
            arena.vote({"matchup": "m", "question": "instruction"}, "A")
    assert told.value.code == "moved"
    assert len(moved.heard) == 1
