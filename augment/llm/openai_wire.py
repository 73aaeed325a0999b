"""The only door to the network: one OpenAI-compatible endpoint, spoken to with `openai`.

What that package and the many servers make of a fault ends here: the rest of the house sees a
Reply or a ModelFault. Retries are made above, where every attempt is recorded.
"""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from augment.errors import Abandoned, InvalidDocument, ModelFault, NotSent, Unwanted
from augment.llm.addresses import Resolve, check_resolved
from augment.llm.client import Sending, watch_nothing
from augment.llm.messages import Reply, Request
from augment.llm.wire_faults import Secret, fault_of_status, retry_after_s
from augment.llm.wire_network import CONNECT_TIMEOUT_S, Network
from augment.llm.wire_reply import reply_of
from augment.llm.wire_transport import ACCEPTED, BadPacking, Transport
from augment.llm.wire_watch import LOOK_EVERY_S, OutOfTime, TooLong, Watch, Watches

if TYPE_CHECKING:
    import openai

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
