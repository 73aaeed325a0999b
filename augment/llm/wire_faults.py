"""What the status and body of a failed call mean, and how a key is kept out of it."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from email.utils import parsedate_to_datetime

from augment.errors import ModelFault

_PASSING = frozenset({408, 409, 425, 429})
_SPENT = frozenset({"insufficient_quota", "billing_hard_limit_reached", "billing_not_active"})
_LONGEST_TEXT = 300


@dataclass(frozen=True, slots=True, repr=False)
class Secret:
    """A key that must not turn up in anything that is kept."""

    key: str

    def out_of(self, text: str) -> str:
        """The text without the key, and without what a database can't hold."""
        storable = text.replace("\0", "\ufffd").encode("utf-8", "replace").decode("utf-8")
        # A stand-in server is used with keys like "x"; those are no secret.
        return storable.replace(self.key, "[key]") if len(self.key) >= 8 else storable

    def cleared(self, fault: ModelFault) -> ModelFault:
        """The same fault with the key taken out of its text."""
        return ModelFault(
            self.out_of(str(fault)),
            retryable=fault.retryable,
            status=fault.status,
            retry_after_s=fault.retry_after_s,
        )


def fault_of_status(status: int, body: object, wait_s: float | None) -> ModelFault:
    """The fault that an HTTP status and its decoded body stand for.

    An exhausted quota comes as a 429 and does not pass by waiting.
    """
    message, code = _message_and_code(body)
    passing = (status in _PASSING or status >= 500) and code not in _SPENT
    shown = message if len(message) <= _LONGEST_TEXT else message[:_LONGEST_TEXT] + "..."
    text = f"the endpoint answered {status}" + (f" ({code})" if code else "")
    return ModelFault(
        f"{text}: {shown}" if shown else text,
        retryable=passing,
        status=status,
        retry_after_s=wait_s if passing else None,
    )


def retry_after_s(headers: Mapping[str, str]) -> float | None:
    """The wait that the headers (names in lower case) ask for, None where they ask for none."""
    for name, unit_s in (("retry-after-ms", 0.001), ("retry-after", 1.0)):
        value = headers.get(name)
        if value is None:
            continue
        seconds = _number(value)
        if seconds is not None:
            return max(0.0, seconds * unit_s)
        try:
            return max(0.0, parsedate_to_datetime(value).timestamp() - time.time())
        except ValueError:
            continue
    return None


def _number(value: str) -> float | None:
    try:
        number = float(value)
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def _message_and_code(body: object) -> tuple[str, str]:
    """The message and code of an error body; Gemini's compatible endpoint wraps it in a list."""
    if isinstance(body, list) and body:
        body = body[0]
    if isinstance(body, dict) and isinstance(body.get("error"), dict):
        body = body["error"]
    if not isinstance(body, dict):
        return "", ""
    message, code = body.get("message"), body.get("code")
    return str(message or ""), code if isinstance(code, str) else ""
