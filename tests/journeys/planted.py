"""Products with a leak, to prove that the suite finds it: middleware that adds too much."""

import json
import zlib
from collections.abc import Callable

from django.http import HttpRequest
from django.http.response import HttpResponseBase

from tests.web.cast import png

Next = Callable[[HttpRequest], HttpResponseBase]
HEADERS = {
    "file_name": ("Content-Disposition", 'inline; filename="3f2c.png"'),
    "etag": ("ETag", '"3f2c-66a1"'),
    "last_modified": ("Last-Modified", "Fri, 20 Nov 2026 10:00:00 GMT"),
    "shared_cache": ("Cache-Control", "public, max-age=60"),
}


def _adding(name: str, value: str) -> Callable[[Next], Next]:
    def middleware(get_response: Next) -> Next:
        def answer(request: HttpRequest) -> HttpResponseBase:
            response = get_response(request)
            if request.path.startswith("/i/"):
                response[name] = value
            return response

        return answer

    return middleware


file_name = _adding(*HEADERS["file_name"])
etag = _adding(*HEADERS["etag"])
last_modified = _adding(*HEADERS["last_modified"])
shared_cache = _adding(*HEADERS["shared_cache"])


def json_field(get_response: Next) -> Next:
    """A harmless-looking number beside every matchup: pictures of one job share it."""

    def answer(request: HttpRequest) -> HttpResponseBase:
        response = get_response(request)
        if request.path == "/api/v1/matchups":
            given = json.loads(response.getvalue())
            response.content = json.dumps([{**one, "batch": 3} for one in given])  # type: ignore[attr-defined]
        return response

    return answer


def text_with_ids(get_response: Next) -> Next:
    """The text description names agents as their modifications do."""

    def answer(request: HttpRequest) -> HttpResponseBase:
        response = get_response(request)
        if request.path == "/api/v1/matchups":
            given = json.loads(response.getvalue())
            for one in given:
                one["text"]["a"] = [f"zanzibar1: {line}" for line in one["text"]["a"]]
            response.content = json.dumps(given)  # type: ignore[attr-defined]
        return response

    return answer


def drawn(shade: int, *, width: int = 1200, height: int = 800) -> bytes:
    """A picture as large as the renderer's."""
    return png(shade, width=width, height=height)


def png_with_text() -> bytes:
    """A picture that says which program wrote it."""
    plain = drawn(200)
    body = b"tEXtSoftware\x00somebody"
    length = (len(body) - 4).to_bytes(4, "big")
    chunk = length + body + zlib.crc32(body).to_bytes(4, "big")
    return plain[:33] + chunk + plain[33:]
