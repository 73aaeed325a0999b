"""A client of Scenario Arena in one file: copy it; it needs nothing but Python 3.11.

    arena = Arena("https://arena.example.org", token="arena_...")
    for job in arena.list("jobs", state="running"):
        print(job["name"], job["by_state"])

docs/api.md and, for staff, /api/v1/openapi.json list every operation. `post` sends JSON, `get`
and `list` read it, `upload` sends files, `download` returns the bytes of one.
"""

from __future__ import annotations

import http.client
import json
import re
import time
import urllib.error
import urllib.request
import uuid
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

PREFIX = "/api/v1/"
BUSY = (409, 429, 503)
"""Statuses that pass where `Retry-After` comes with them; of 409 a request that is under way."""

KEY = "Idempotency-Key"
"""By it the server knows a request that was repeated, and carries it out once."""

AGAIN_S = 1.0


class ApiError(Exception):
    """The server refused a request.

    Attributes:
        status: Of the answer.
        code: For programs: "conflict", "not_found".
        fields: By field, what is wrong with it.
    """

    def __init__(self, status: int, error: dict[str, Any]) -> None:
        self.status = status
        self.code = str(error.get("code", ""))
        self.fields: dict[str, Any] = error.get("fields", {})
        wrong = "".join(f" {name}: {text}" for name, text in self.fields.items())
        super().__init__(f"{status} {self.code}: {error.get('message', '')}{wrong}")


class Arena:
    """The API of one installation. Every method raises `ApiError` where it is refused.

    Args:
        address: Of the installation, without a path.
        token: Of the page “API tokens”; empty to post to `first` and `welcome`, which give one.
        timeout_s: For one request.
        patience_s: How long to retry while the server is busy or limits the rate.
    """

    def __init__(
        self, address: str, token: str = "", *, timeout_s: float = 120, patience_s: float = 180
    ) -> None:
        self.address = address.rstrip("/")
        self.token = token
        self.timeout_s, self.patience_s = timeout_s, patience_s

    # --- Any resource --------------------------------------------------------------------------

    def get(self, path: str, **query: object) -> Any:
        """Return the JSON at a path below /api/v1/."""
        return json.loads(self.download(path, **query))

    def list(self, path: str, **query: object) -> Iterator[dict[str, Any]]:
        """Yield every row of a list."""
        page = self.get(path, **query)
        while True:
            yield from page["results"]
            if page["next"] is None:
                return
            page = self.get(page["next"])

    def post(self, path: str, **body: object) -> Any:
        """Send JSON and return the answer."""
        headers = {"Content-Type": "application/json", KEY: str(uuid.uuid4())}
        data = json.dumps(body).encode()
        return json.loads(self._send("POST", self._address(path, {}), data, headers))

    def upload(
        self, path: str, files: Mapping[str, str | Path | Sequence[str | Path]], **fields: object
    ) -> Any:
        """Send files by the name of their form field, with other fields; return the answer."""
        mark = uuid.uuid4().hex
        parts = [_part(mark, name, str(value).encode()) for name, value in fields.items()]
        for name, given in files.items():
            for file in [given] if isinstance(given, str | Path) else given:
                parts.append(_part(mark, name, Path(file).read_bytes(), file))
        data = b"".join([*parts, f"--{mark}--\r\n".encode()])
        headers = {"Content-Type": f"multipart/form-data; boundary={mark}", KEY: mark}
        return json.loads(self._send("POST", self._address(path, {}), data, headers))

    def download(self, path: str, **query: object) -> bytes:
        """Return the bytes of a file."""
        return self._send("GET", self._address(path, query))

    # --- What takes more than one request ------------------------------------------------------

    def wait_for(self, path: str, *states: str, every_s: float = 1, within_s: float = 3600) -> Any:
        """Poll a row until it has one of these states, or a job until it is over; return it.

        Raises:
            TimeoutError: It has none of them in time.
        """
        ends_at = time.monotonic() + within_s
        while True:
            row = self.get(path)
            if row["state"] in states or row.get("is_over"):
                return row
            if time.monotonic() >= ends_at:
                raise TimeoutError(f"{path} is still under way after {within_s} s")
            time.sleep(every_s)

    def submit(self, file: str | Path, benchmark: str, **waiting: float) -> Any:
        """Send a submission, wait until it is read, and return it with its report."""
        sent = self.upload("submissions", {"file": file}, benchmark=benchmark)
        return self.wait_for(f"submissions/{sent['code']}", "checked", "failed", **waiting)

    def pairs(self, study: str) -> Iterator[dict[str, Any]]:
        """Yield the pairs that are left; vote on each before taking the next.

        A pair comes once for each question of the study.
        """
        while waiting := self.get("matchups", study=study, n=1):
            yield from waiting

    def picture(self, address: str) -> bytes:
        """Return the PNG at `a`, `b` or `original` of a pair."""
        return self.download(f"pictures/{address.rpartition('/')[2]}")

    def vote(self, pair: dict[str, Any], outcome: str, **more: object) -> Any:
        """Vote "A", "B", "E" for equal, or "skip" with a reason.

        Retries send the same key, so that the vote counts once.
        """
        key = str(uuid.uuid4())
        if outcome != "skip":  # which is of the whole pair
            more = {"question": pair["question"], **more}
        return self.post("votes", key=key, matchup=pair["matchup"], outcome=outcome, **more)

    # --- Private -------------------------------------------------------------------------------

    def _address(self, path: str, query: dict[str, object]) -> str:
        if not path.startswith(PREFIX):
            path = PREFIX + path.removeprefix("/")
        return self.address + path + ("?" + urlencode(query) if query else "")

    def _send(
        self, method: str, address: str, data: bytes | None = None, headers: Any = None
    ) -> bytes:
        sent = dict(headers or {})
        if self.token:
            sent["Authorization"] = f"Bearer {self.token}"
        ends_at = time.monotonic() + self.patience_s
        while True:
            request = urllib.request.Request(address, data, sent, method=method)
            try:
                with _STAYING.open(request, timeout=self.timeout_s) as answer:
                    content: bytes = answer.read()
                    return content
            except urllib.error.HTTPError as error:
                wait_s = _wait_s(error)
                if wait_s is None or time.monotonic() + wait_s > ends_at:
                    raise ApiError(error.code, _error_in(error)) from None
            except (OSError, http.client.HTTPException):  # no answer, or not all of it
                wait_s = AGAIN_S
                if time.monotonic() + wait_s > ends_at:
                    raise
            time.sleep(wait_s)


class _StaysHere(urllib.request.HTTPRedirectHandler):
    """Refuse redirects: they would drop a posted body and leak the token."""

    def redirect_request(self, *args: Any, **more: Any) -> None:
        """Follow none."""


_STAYING = urllib.request.build_opener(_StaysHere)


def _part(mark: str, name: str, content: bytes, file: str | Path | None = None) -> bytes:
    """Return one field of a form; file names are reduced to ASCII."""
    head = f'--{mark}\r\nContent-Disposition: form-data; name="{name}"'
    if file is not None:
        plain = re.sub(r"[^A-Za-z0-9._-]", "-", Path(file).name)
        head += f'; filename="{plain}"\r\nContent-Type: application/octet-stream'
    return f"{head}\r\n\r\n".encode() + content + b"\r\n"


def _wait_s(error: urllib.error.HTTPError) -> float | None:
    """Return how long to wait before a retry, None where it would not help."""
    given = error.headers.get("Retry-After", "")
    return float(given) if error.code in BUSY and given.isdigit() else None


def _error_in(error: urllib.error.HTTPError) -> dict[str, Any]:
    body = error.read()
    if 300 <= error.code < 400:
        there = error.headers.get("Location", "elsewhere")
        return {"code": "moved", "message": f"this leads to {there}: use the address of that"}
    try:
        found = json.loads(body)["error"]
    except (ValueError, KeyError, TypeError):
        return {"message": body[:200].decode(errors="replace")}
    return found if isinstance(found, dict) else {}
