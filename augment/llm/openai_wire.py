"""The only door to the network: one OpenAI-compatible endpoint, spoken to with `openai`.

What that package and the many servers make of a fault ends here: the rest of the house sees a
Reply or a ModelFault. Retries are made above, where every attempt is recorded. The package does
not check what a server sent, so nothing is taken on trust, and what is too long is cut here, at
the border: a run and its replay from the store see the same.
"""

from __future__ import annotations

import json
import math
import os
import re
import socket
import time
from collections.abc import Callable, Collection, Mapping
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from augment.errors import (
    Abandoned,
    InvalidDocument,
    ModelFault,
    NotSent,
    ParameterRefused,
    Unwanted,
)
from augment.llm.addresses import Resolve
from augment.llm.client import Sending, watch_nothing
from augment.llm.messages import LengthName, Reply, Request, ToolCall, shorten
from augment.llm.wire_transport import (
    ACCEPTED,
    CONNECT_TIMEOUT_S,
    LOOK_EVERY_S,
    Transport,
    Watch,
    WireFault,
    watch_over,
)

if TYPE_CHECKING:
    import openai

DEFAULT_TIMEOUT_S = 180.0
MEGABYTE = 1_000_000
DEFAULT_MOST_BYTES = 8 * MEGABYTE

LONGEST_REFUSAL = 4_000
LONGEST_NAME = 200
LONGEST_ARGUMENTS = 10_000
"""Of one call, in characters."""
LONGEST_EXTRA = 100_000
"""What hangs on a call goes back as it came, so it can't be cut: longer ones are left out."""
LONGEST_MESSAGE, LONGEST_CODE = 300, 80
"""Of what an error body says, in characters."""
MOST_CALLS = 64
"""Of one answer."""
MOST_TOKENS = 100_000_000
"""A count beyond is none: no model reads or writes so much at once."""

_OPENAI_HOSTS = (".openai.com", ".openai.azure.com")
_HERE = ("localhost", "127.0.0.1", "::1")
# Sent where an endpoint needs no key: without one the package would look for OPENAI_API_KEY.
_KEYLESS = "no-key"
# A stand-in server is used with keys like "x"; those are no secret.
_SHORTEST_SECRET = 8

_PASSING = frozenset({408, 409, 425, 429})
_SPENT = frozenset({"insufficient_quota", "billing_hard_limit_reached", "billing_not_active"})
_LENGTHS = frozenset(LengthName)
# What a request can do without, or say in another way.
_DROPPABLE = frozenset({"temperature", "seed", "reasoning_effort"}) | _LENGTHS
_NOT_TAKEN = frozenset({"unsupported_parameter", "unknown_parameter"})
_SAYS_UNKNOWN = re.compile(
    r"unsupported|unknown|unrecognized|unexpected|not (supported|permitted|allowed)|"
    r"extra (inputs|fields)|cannot find field",
    re.IGNORECASE,
)


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
        ModelFault: The key can't be sent, or OPENAI_CUSTOM_HEADERS is set: the package would add
            those headers to requests to whatever host, and who set them meant OpenAI's.
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
        key = (api_key or "").strip()
        problem = ""
        if os.environ.get("OPENAI_CUSTOM_HEADERS"):
            problem = "OPENAI_CUSTOM_HEADERS is set and would be sent to every endpoint; unset it"
        elif not (key.isascii() and key.isprintable() and " " not in key):
            problem = "the key has characters that no key may have"
        if problem:
            raise ModelFault(problem, retryable=False)
        self._key = key
        self._timeout_s, self._most_bytes = timeout_s, most_bytes
        self._still_wanted, self._look_every_s = still_wanted, look_every_s
        self._client = _client(base_url, key or _KEYLESS, timeout_s, resolve, proxy_url)

    def fitted(self, request: Request) -> Request:
        """Return the request as it is: the wire knows no model."""
        return request

    def complete(self, request: Request, *, sending: Sending = watch_nothing) -> Reply:
        """Return the endpoint's answer to one request.

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
            with watch_over(watch):
                # Typed loosely on purpose: our document is what the wire takes, and is tested so.
                answer: object = self._client.chat.completions.create(**document)  # type: ignore[call-overload]
            return self._reply(answer, time.monotonic() - started)
        except openai.APIStatusError as error:
            wait_s = _retry_after_s(dict(error.response.headers))
            fault: ModelFault | Unwanted = fault_of_status(
                error.status_code, error.body, wait_s, sent=document
            )
        except Unwanted as why:
            fault = Abandoned(why) if watch.has_written else why
        except InvalidDocument as error:
            fault = NotSent(error.problems[0][1])
        except WireFault as error:
            # Where nothing was written there is nothing to be billed.
            kind = ModelFault if watch.has_written else NotSent
            fault = kind(str(error), retryable=error.retryable, status=error.status)
        except openai.OpenAIError as error:
            fault = ModelFault(f"the request failed: {type(error).__name__}", retryable=False)
        except RecursionError:
            fault = ModelFault("the answer is nested too deeply to be read", retryable=True)
        except ValueError:
            # A body that is no JSON comes through as a bare JSONDecodeError.
            fault = ModelFault("the endpoint's answer is not valid JSON", retryable=True)
        # Outside the handlers, so that nothing of the package's errors (which hold the request
        # with its headers) hangs on ours.
        if isinstance(fault, ModelFault):
            fault.args = (self._clear(str(fault)),)
        raise fault

    def __exit__(self, *fault: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._client.close()

    def _clear(self, value: object) -> str:
        """Return a text without the key and what a database can't hold; empty for no text."""
        text = value if isinstance(value, str) else ""
        text = text.replace("\0", "\ufffd").encode("utf-8", "replace").decode("utf-8")
        return text.replace(self._key, "[key]") if len(self._key) >= _SHORTEST_SECRET else text

    def _reply(self, answer: object, latency_s: float) -> Reply:
        """Return the reply in what the package made of a 200: a `ChatCompletion`, or anything.

        Raises:
            ModelFault: It is no completion.
        """
        if isinstance(answer, str):
            raise ModelFault(
                "the endpoint answered with a page of text instead of JSON: is its base URL "
                "right?",
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
        calls = self._tool_calls(getattr(message, "tool_calls", None))
        refusal = self._clear(getattr(message, "refusal", None))
        return Reply(
            text=self._clear(getattr(message, "content", None)),
            model=shorten(self._clear(getattr(answer, "model", None)), 120),
            finish_reason=shorten(self._clear(getattr(choices[0], "finish_reason", None)), 40),
            refusal=shorten(refusal, LONGEST_REFUSAL) or None,
            prompt_tokens=_count(getattr(usage, "prompt_tokens", None)),
            completion_tokens=_count(getattr(usage, "completion_tokens", None)),
            latency_s=latency_s,
            tool_calls=tuple(calls[:MOST_CALLS]),
            calls_left_out=len(calls[MOST_CALLS:]),
        )

    def _tool_calls(self, calls: object) -> list[ToolCall]:
        """Return those calls that name a function; their arguments stay as they came."""
        made = []
        for number, call in enumerate(calls if isinstance(calls, list) else [], start=1):
            function = getattr(call, "function", None)
            name = self._clear(getattr(function, "name", None))
            if not name:
                continue
            # Some servers number no calls; the answer to one must name it.
            call_id = self._clear(getattr(call, "id", None)) or f"call_{number}"
            arguments = self._clear(getattr(function, "arguments", None))
            extra = getattr(call, "model_extra", None)
            more = self._clear(json.dumps(extra, sort_keys=True)) if extra else ""
            made.append(
                ToolCall(
                    id=shorten(call_id, LONGEST_NAME),
                    name=shorten(name, LONGEST_NAME),
                    arguments=shorten(arguments, LONGEST_ARGUMENTS),
                    extra=more if len(more) <= LONGEST_EXTRA else "",
                )
            )
        return made


def fault_of_status(
    status: int, body: object, wait_s: float | None, *, sent: Collection[str] = ()
) -> ModelFault:
    """Return the fault that an HTTP status and its decoded body stand for.

    An exhausted quota comes as a 429 and does not pass by waiting.

    Args:
        status: Of the answer.
        body: Of the answer, decoded.
        wait_s: What the headers ask for.
        sent: The names of what the request had, of which the endpoint may refuse one.
    """
    # Gemini's compatible endpoint wraps an error in a list.
    error: Any = body[0] if isinstance(body, list) and body else body
    if isinstance(error, dict) and isinstance(error.get("error"), dict):
        error = error["error"]
    fields = error if isinstance(error, dict) else {}
    message = str(fields.get("message") or "")
    code, param = (
        value if isinstance(value, str) else ""
        for value in (fields.get("code"), fields.get("param"))
    )
    text = f"the endpoint answered {status}"
    text += f" ({shorten(code, LONGEST_CODE)})" if code else ""
    text += f": {shorten(message, LONGEST_MESSAGE)}" if message else ""
    refused = _refused(message, code, param, sent) if status in (400, 422) else None
    if refused:
        return ParameterRefused(refused, text, status=status)
    passing = (status in _PASSING or status >= 500) and code not in _SPENT
    return ModelFault(
        text, retryable=passing, status=status, retry_after_s=wait_s if passing else None
    )


# Private


def _client(
    base_url: str, key: str, timeout_s: float, resolve: Resolve, proxy_url: str
) -> openai.OpenAI:
    import httpx2
    import openai

    address = urlsplit(base_url)
    host = (address.hostname or "").lower()
    foreign = not f".{host}".endswith(_OPENAI_HOSTS)
    headers = dict.fromkeys(("OpenAI-Organization", "OpenAI-Project"), openai.omit)
    transport = Transport(
        resolve=resolve,
        # Plain HTTP shows no certificate, and loading those to check one by takes longer than
        # a call on this computer.
        ssl_context=httpx2.create_ssl_context(verify=address.scheme.lower() != "http"),
        # A proxy can't reach what listens on this computer alone.
        proxy_url="" if host in _HERE else proxy_url,
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


def _refused(message: str, code: str, param: str, sent: Collection[str]) -> str | None:
    """Return the parameter that an error is about, None where it is about another thing.

    Servers that do not name it (`param`) name it in their message. An answer's limit that is too
    large is no parameter that is not taken.
    """
    named = [param.partition(".")[0]] if param else re.findall(r"\w+", message)
    refused = next((name for name in named if name in _DROPPABLE and name in sent), None)
    if refused in _LENGTHS and code not in _NOT_TAKEN and not _SAYS_UNKNOWN.search(message):
        return None
    return refused


def _retry_after_s(headers: Mapping[str, str]) -> float | None:
    """Return the wait that the headers (names in lower case) ask for, None for none or a date."""
    for name, unit_s in (("retry-after-ms", 0.001), ("retry-after", 1.0)):
        try:
            seconds = float(headers.get(name, "")) * unit_s
        except ValueError:
            continue
        if math.isfinite(seconds):
            return max(0.0, seconds)
    return None


def _count(value: object) -> int | None:
    """Return a count of tokens, None where it can't be one; some write whole numbers as 12.0."""
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if isinstance(value, bool) or not isinstance(value, int):
        return None
    return value if 0 <= value <= MOST_TOKENS else None
