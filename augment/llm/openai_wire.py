"""The only door to the network: one OpenAI-compatible endpoint, spoken to with `openai`.

What that package and the many servers make of a fault ends here: the rest of the house sees a
Reply or a ModelFault. Retries are made above, where every attempt is recorded.
"""

from __future__ import annotations

import json
import math
import os
import re
import socket
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from datetime import UTC
from email.utils import parsedate_to_datetime
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from augment.errors import (
    Abandoned,
    InvalidDocument,
    ModelFault,
    NotSent,
    ParameterRefused,
    Unwanted,
)
from augment.llm.addresses import Resolve, check_resolved
from augment.llm.client import Sending, watch_nothing
from augment.llm.messages import LengthName, Reply, Request, ToolCall, shorten
from augment.llm.wire_transport import (
    ACCEPTED,
    CONNECT_TIMEOUT_S,
    LOOK_EVERY_S,
    BadPacking,
    Network,
    OutOfTime,
    TooLong,
    Transport,
    Watch,
    Watches,
)

if TYPE_CHECKING:
    import openai


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


LONGEST_REFUSAL = 4_000
LONGEST_NAME = 200
LONGEST_ARGUMENTS = 10_000
"""Of one call, in characters."""

LONGEST_EXTRA = 100_000
"""What hangs on a call goes back as it came, so it can't be cut: longer ones are left out."""

MOST_CALLS = 64
"""Of one answer."""

MOST_TOKENS = 100_000_000
"""A count beyond is none: no model reads or writes so much at once."""


def reply_of(answer: object, *, latency_s: float, secret: Secret) -> Reply:
    """The reply in an answer of the package.

    Args:
        answer: A `ChatCompletion`, or what came instead of one.
        latency_s: How long it took.
        secret: Is taken out of every text, should a server echo it.

    Raises:
        ModelFault: It is no completion.
    """
    if isinstance(answer, str):
        raise ModelFault(
            "the endpoint answered with a page of text instead of JSON: is its base URL right?",
            retryable=False,
            status=200,
        )
    choices = getattr(answer, "choices", None)
    if not isinstance(choices, list) or not choices:
        raise ModelFault("the endpoint answered without a choice", retryable=True, status=200)
    message = getattr(choices[0], "message", None)
    if message is None:
        raise ModelFault("the endpoint answered without a message", retryable=True, status=200)
    usage = getattr(answer, "usage", None)
    refusal = getattr(message, "refusal", None)
    calls = _tool_calls(getattr(message, "tool_calls", None), secret)
    return Reply(
        text=secret.out_of(_text(getattr(message, "content", None))),
        model=shorten(secret.out_of(_text(getattr(answer, "model", None))), 120),
        finish_reason=shorten(
            secret.out_of(_text(getattr(choices[0], "finish_reason", None))), 40
        ),
        refusal=shorten(secret.out_of(_text(refusal)), LONGEST_REFUSAL) or None,
        prompt_tokens=_count(getattr(usage, "prompt_tokens", None)),
        completion_tokens=_count(getattr(usage, "completion_tokens", None)),
        latency_s=latency_s,
        tool_calls=calls[:MOST_CALLS],
        calls_left_out=len(calls[MOST_CALLS:]),
    )


def _tool_calls(calls: object, secret: Secret) -> tuple[ToolCall, ...]:
    """Those calls that name a function; their arguments stay as they came."""
    made = []
    for number, call in enumerate(calls if isinstance(calls, list) else [], start=1):
        function = getattr(call, "function", None)
        name = _text(getattr(function, "name", None))
        if name:
            made.append(
                ToolCall(
                    # Some servers number no calls; the answer to one must name it.
                    id=shorten(secret.out_of(_text(getattr(call, "id", None))), LONGEST_NAME)
                    or f"call_{number}",
                    name=shorten(secret.out_of(name), LONGEST_NAME),
                    arguments=shorten(
                        secret.out_of(_text(getattr(function, "arguments", None))),
                        LONGEST_ARGUMENTS,
                    ),
                    extra=_extra(getattr(call, "model_extra", None), secret),
                )
            )
    return tuple(made)


def _extra(extra: object, secret: Secret) -> str:
    """What else hangs on a call, as JSON; empty where there is nothing, or too much."""
    text = secret.out_of(json.dumps(extra, sort_keys=True)) if extra else ""
    return text if len(text) <= LONGEST_EXTRA else ""


def _text(value: object) -> str:
    return value if isinstance(value, str) else ""


def _count(value: object) -> int | None:
    """A count of tokens, None where it can't be one; some servers write whole numbers as 12.0."""
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if isinstance(value, bool) or not isinstance(value, int):
        return None
    return value if 0 <= value <= MOST_TOKENS else None


DEFAULT_TIMEOUT_S = 180.0
MEGABYTE = 1_000_000
DEFAULT_MOST_BYTES = 8 * MEGABYTE

_OPENAI_HOSTS = (".openai.com", ".openai.azure.com")
_HERE = ("localhost", "127.0.0.1", "::1")

_KEYLESS = "no-key"
"""Sent where an endpoint needs no key: without one the package would look for OPENAI_API_KEY."""


class OpenAIWire(AbstractContextManager["OpenAIWire"]):
    """A ChatClient that makes one real HTTP call for each request.

    Args:
        base_url: Of the endpoint, up to and including "/v1" or its like.
        api_key: None where the endpoint needs none. It is sent to this endpoint and to nobody
            else; no fault and no reply ever contains it.
        timeout_s: How long a call may take, from its start to the last byte of the answer.
        most_bytes: Of an answer, unpacked.
        still_wanted: Raises Unwanted where nobody needs a call's answer any more; the call is
            given up then.
        look_every_s: How often it is asked that.
        proxy_url: What all calls go through, but those to this computer; empty for none. The
            environment's proxies are not used.
        resolve: From a name to addresses.

    Raises:
        ModelFault: The key can't be sent, the host's name leads to a forbidden address today, or
            OPENAI_CUSTOM_HEADERS is set: the package would add those headers to requests to
            whatever host, and who set them meant OpenAI's.
    """

    def __init__(
        self,
        *,
        base_url: str,
        api_key: str | None,
        timeout_s: float = DEFAULT_TIMEOUT_S,
        most_bytes: int = DEFAULT_MOST_BYTES,
        still_wanted: Callable[[], None] = watch_nothing,
        look_every_s: float = LOOK_EVERY_S,
        proxy_url: str = "",
        resolve: Resolve = socket.getaddrinfo,
    ) -> None:
        if os.environ.get("OPENAI_CUSTOM_HEADERS"):
            raise ModelFault(
                "OPENAI_CUSTOM_HEADERS is set and would be sent to every endpoint; unset it",
                retryable=False,
            )
        key = (api_key or "").strip()
        if not (key.isascii() and key.isprintable() and " " not in key):
            raise ModelFault("the key has characters that no key may have", retryable=False)
        self._secret = Secret(key)
        try:
            check_resolved(base_url, resolve=resolve)
        except InvalidDocument as error:
            raise ModelFault(error.problems[0][1], retryable=False) from None
        self._timeout_s, self._most_bytes = timeout_s, most_bytes
        self._still_wanted, self._look_every_s = still_wanted, look_every_s
        self._watches = Watches()
        self._client = _client(
            base_url, key or _KEYLESS, timeout_s, self._watches, resolve, proxy_url
        )

    def fitted(self, request: Request) -> Request:
        """The request as it is: the wire knows no model."""
        return request

    def complete(self, request: Request, *, sending: Sending = watch_nothing) -> Reply:
        """The endpoint's answer to one request.

        Raises:
            Abandoned: Nobody needs it any more, and it may be billed.
            Unwanted: Nobody needs it any more, and nothing was sent.
            ModelFault: There was none; whether it may come later is said by `retryable`.
        """
        import openai

        document = request.to_document()
        sending()
        started = time.monotonic()
        watch = Watch(
            longest_s=self._timeout_s,
            most_bytes=self._most_bytes,
            still_wanted=self._still_wanted,
            look_every_s=self._look_every_s,
        )
        try:
            with self._watches.over(watch):
                # Typed loosely on purpose: our document is what the wire takes, and is tested so.
                answer: object = self._client.chat.completions.create(**document)  # type: ignore[call-overload]
            return reply_of(answer, latency_s=time.monotonic() - started, secret=self._secret)
        except openai.APIStatusError as error:
            fault: ModelFault | Unwanted = _fault_of_status(error, sent=document)
        except openai.OpenAIError as error:
            fault = self._unanswered(error, watch)
        except RecursionError:
            fault = ModelFault(
                "the endpoint's answer is nested too deeply to be read", retryable=True
            )
        except ValueError:
            # A body that is no JSON comes through as a bare JSONDecodeError.
            fault = ModelFault("the endpoint's answer is not valid JSON", retryable=True)
        # Outside the handlers, so that nothing of the package's errors (which hold the request
        # with its headers) hangs on ours.
        raise fault if isinstance(fault, Unwanted) else self._secret.cleared(fault)

    def __exit__(self, *fault: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._client.close()

    def _unanswered(self, error: BaseException, watch: Watch) -> ModelFault | Unwanted:
        """The fault of a request that got no answer, or why nothing of it was sent."""
        import openai

        match watch.ended_by:
            case Unwanted() as why:
                return Abandoned(why) if watch.has_written else why
            case OutOfTime():
                return _broken(
                    f"the endpoint took too long to answer: more than {self._timeout_s:g} s", watch
                )
            case TooLong():
                size = f"{self._most_bytes / MEGABYTE:g} MB"
                return ModelFault(
                    f"the endpoint's answer is longer than {size}", retryable=False, status=200
                )
        for inner in _causes(error):
            if isinstance(inner, InvalidDocument):
                return NotSent(inner.problems[0][1])
            if isinstance(inner, BadPacking):
                return ModelFault(
                    f"the endpoint's answer can't be unpacked: {inner}", retryable=True, status=200
                )
        if isinstance(error, openai.APIConnectionError):
            return _broken(f"the connection failed: {_cause(error)}", watch)
        return ModelFault(f"the request failed: {type(error).__name__}", retryable=False)


# --- Private -----------------------------------------------------------------------------------


def _client(
    base_url: str, key: str, timeout_s: float, watches: Watches, resolve: Resolve, proxy_url: str
) -> openai.OpenAI:
    import httpx2
    import openai

    address = urlsplit(base_url)
    host = (address.hostname or "").lower()
    foreign = not f".{host}".endswith(_OPENAI_HOSTS)
    headers = dict.fromkeys(("OpenAI-Organization", "OpenAI-Project"), openai.omit)
    # A proxy can't reach what listens on this computer alone.
    proxy = "" if host in _HERE else proxy_url
    transport = Transport(
        Network(watches, resolve=resolve, checks=not proxy),
        watches,
        # Plain HTTP shows no certificate, and loading those to check one by takes longer than
        # a call on this computer.
        ssl_context=httpx2.create_ssl_context(verify=address.scheme.lower() != "http"),
        proxy_url=proxy,
    )
    return openai.OpenAI(
        api_key=key,
        base_url=base_url,
        max_retries=0,
        timeout=openai.Timeout(timeout_s, connect=min(CONNECT_TIMEOUT_S, timeout_s)),
        default_headers=headers if foreign else None,  # type: ignore[arg-type]
        http_client=openai.DefaultHttpxClient(
            transport=transport,  # type: ignore[arg-type]
            headers={"Accept-Encoding": ACCEPTED},
            # A redirect would carry the scene to a host that nobody entered.
            follow_redirects=False,
            # The environment's proxy would look the name up itself, and nobody would check it.
            trust_env=False,
        ),
    )


def _fault_of_status(error: openai.APIStatusError, *, sent: Collection[str]) -> ModelFault:
    wait_s = retry_after_s(dict(error.response.headers))
    return fault_of_status(error.status_code, error.body, wait_s, sent=sent)


def _broken(message: str, watch: Watch) -> ModelFault:
    """A fault that may pass; where nothing was written there is nothing to be billed for."""
    if not watch.has_written:
        return NotSent(message, retryable=True)
    return ModelFault(message, retryable=True)


def _causes(error: BaseException) -> Iterator[BaseException]:
    """The error and what led to it, the innermost last."""
    inner: BaseException | None = error
    while inner is not None:
        yield inner
        inner = inner.__cause__ or inner.__context__


def _cause(error: BaseException) -> str:
    """The kind of the innermost fault; its text may hold parts of the request."""
    *_, inner = _causes(error)
    if isinstance(inner, OSError) and inner.strerror:
        return inner.strerror
    return type(inner).__name__
