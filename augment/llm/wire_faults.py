"""What the status and body of a failed call mean, and how a key is kept out of it."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from datetime import UTC
from email.utils import parsedate_to_datetime

from augment.errors import ModelFault, ParameterRefused
from augment.llm.cutting import shorten
from augment.llm.messages import LengthName

_PASSING = frozenset({408, 409, 425, 429})
_SPENT = frozenset({"insufficient_quota", "billing_hard_limit_reached", "billing_not_active"})
_ABOUT_THE_REQUEST = frozenset({400, 422})
_LENGTHS = frozenset(LengthName)
_DROPPABLE = frozenset({"temperature", "seed", "reasoning_effort", "response_format"}) | _LENGTHS
"""What a request can do without, or say in another way."""
_NOT_TAKEN = frozenset({"unsupported_parameter", "unknown_parameter"})
_SAYS_UNKNOWN = re.compile(
    r"unsupported|unknown|unrecognized|unexpected|not (supported|permitted|allowed)|"
    r"extra (inputs|fields)|cannot find field",
    re.IGNORECASE,
)
LONGEST_MESSAGE = 300
LONGEST_CODE = 80
"""Of what an error body says, in characters."""


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
        fault.args = (self.out_of(str(fault)),)
        return fault


def fault_of_status(
    status: int, body: object, wait_s: float | None, *, sent: Collection[str] = ()
) -> ModelFault:
    """The fault that an HTTP status and its decoded body stand for.

    An exhausted quota comes as a 429 and does not pass by waiting.

    Args:
        status: Of the answer.
        body: Of the answer, decoded.
        wait_s: What the headers ask for.
        sent: The names of what the request had, of which the endpoint may refuse one.
    """
    message, code, param = _message_code_and_param(body)
    passing = (status in _PASSING or status >= 500) and code not in _SPENT
    shown = shorten(message, LONGEST_MESSAGE)
    text = f"the endpoint answered {status}" + (
        f" ({shorten(code, LONGEST_CODE)})" if code else ""
    )
    text = f"{text}: {shown}" if shown else text
    refused = _refused(message, code, param, sent) if status in _ABOUT_THE_REQUEST else None
    if refused:
        return ParameterRefused(refused, text, status=status)
    return ModelFault(
        text, retryable=passing, status=status, retry_after_s=wait_s if passing else None
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
        at_s = _date_s(value)
        if at_s is not None:
            return max(0.0, at_s - time.time())
    return None


def _date_s(value: str) -> float | None:
    """The time that an HTTP date stands for; one that names no zone is in UTC, as all are."""
    try:
        at = parsedate_to_datetime(value)
        return (at if at.tzinfo is not None else at.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError, TypeError, IndexError):
        return None


def _number(value: str) -> float | None:
    try:
        number = float(value)
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def _refused(message: str, code: str, param: str, sent: Collection[str]) -> str | None:
    """The parameter of the request that an error is about, None where it is about another thing.

    Servers that do not name it (`param`) name it in their message. An answer's limit that is too
    large is no parameter that is not taken.
    """
    named = [param.partition(".")[0]] if param else re.findall(r"\w+", message)
    refused = next((name for name in named if name in _DROPPABLE and name in sent), None)
    if refused in _LENGTHS and code not in _NOT_TAKEN and not _SAYS_UNKNOWN.search(message):
        return None
    return refused


def _message_code_and_param(body: object) -> tuple[str, str, str]:
    """What an error body says; Gemini's compatible endpoint wraps it in a list."""
    if isinstance(body, list) and body:
        body = body[0]
    if isinstance(body, dict) and isinstance(body.get("error"), dict):
        body = body["error"]
    if not isinstance(body, dict):
        return "", "", ""
    message, code, param = (body.get(name) for name in ("message", "code", "param"))
    return (
        str(message or ""),
        code if isinstance(code, str) else "",
        param if isinstance(param, str) else "",
    )
