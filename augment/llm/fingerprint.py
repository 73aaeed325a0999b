"""By what two requests are the same: for the store of answers, and for images kept apart."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping

IMAGE_SCHEME = "sha256:"


def image_reference(png: bytes) -> str:
    """How a stored request names an image: by the hash of its bytes."""
    return IMAGE_SCHEME + hashlib.sha256(png).hexdigest()


def request_hash(
    *,
    base_url: str,
    document: dict[str, object],
    prompt_version: str,
    options: Mapping[str, object] | None = None,
) -> str:
    """The SHA-256 of everything that an answer depends on, as 64 hexadecimal digits.

    Args:
        base_url: Where the request goes.
        document: The stored request: model, messages with references to images, parameters.
        prompt_version: Of the texts that the messages were made from.
        options: What else keeps answers apart: options of who asks, the number of the sample.
    """
    asked: dict[str, object] = {
        "base_url": base_url.rstrip("/"),
        "prompt_version": prompt_version,
        "request": document,
    }
    if options:
        asked["options"] = dict(options)
    canonical = json.dumps(asked, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(canonical.encode("ascii")).hexdigest()
