"""A WSGI application for tests of the worker that serves it; nothing of the product."""

import os
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

LONG = 24 * 1024 * 1024

Start = Callable[[str, list[tuple[str, str]]], object]


def application(environ: dict[str, Any], start_response: Start) -> Iterable[bytes]:
    """/ says hello, POST / how long the body is and if cut, /long is long, /held waits."""
    start_response("200 OK", [("Content-Type", "text/plain")])
    if environ["PATH_INFO"] == "/long":
        return (b"x" * 65_536 for _ in range(LONG // 65_536))
    if environ["PATH_INFO"] == "/held":
        folder = Path(os.environ["HELD"])
        (folder / "came-in").touch()
        while not (folder / "go-on").exists():
            time.sleep(0.01)
        return [b"held"]
    if environ["REQUEST_METHOD"] == "POST":
        found = (len(environ["wsgi.input"].read()), environ.get("HTTP_X_BODY_CUT"))
        return [" ".join(map(str, found)).encode()]
    return [environ.get("HTTP_X_FORWARDED_FOR", "hello").encode()]
