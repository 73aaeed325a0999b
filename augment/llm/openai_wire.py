"""The only door to the network: one OpenAI-compatible endpoint, spoken to with `openai`.

What that package and the many servers make of a fault ends here: the rest of the house sees a
Reply or a ModelFault. Retries are made above, where every attempt is recorded.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from types import TracebackType
from typing import TYPE_CHECKING, Self
from urllib.parse import urlsplit

from augment.errors import InvalidDocument, ModelFault, NotSent
from augment.llm.addresses import check_resolved
from augment.llm.client import Sending, unwatched
from augment.llm.messages import Reply, Request
from augment.llm.wire_faults import Secret, fault_of_status, retry_after_s
from augment.llm.wire_reply import reply_of

if TYPE_CHECKING:
    import openai

DEFAULT_TIMEOUT_S = 180.0
CONNECT_TIMEOUT_S = 10.0

_OPENAI_HOSTS = (".openai.com", ".openai.azure.com")
_HERE = ("localhost", "127.0.0.1", "::1")
_NO_CONNECTION = {"ConnectError", "ConnectTimeout", "PoolTimeout"}
"""Kinds of the package's transport that end before the first byte of a request."""

_KEYLESS = "no-key"
"""Sent where an endpoint needs no key: without one the package would look for OPENAI_API_KEY."""


class OpenAIWire:
    """A ChatClient that makes one real HTTP call for each request.

    Args:
        base_url: Of the endpoint, up to and including "/v1" or its like.
        api_key: None where the endpoint needs none. It is sent to this endpoint and to nobody
            else; no fault and no reply ever contains it.
        timeout_s: The longest silence while waiting for the answer.

    Raises:
        ModelFault: The key can't be sent, the host's name leads to a link-local or metadata
            address today, or OPENAI_CUSTOM_HEADERS is set: the package would add
            those headers to requests to whatever host, and who set them meant OpenAI's.
    """

    def __init__(
        self, *, base_url: str, api_key: str | None, timeout_s: float = DEFAULT_TIMEOUT_S
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
            check_resolved(base_url)
        except InvalidDocument as error:
            raise ModelFault(error.problems[0][1], retryable=False) from None
        self._client = _client(base_url, key or _KEYLESS, timeout_s)

    def fitted(self, request: Request) -> Request:
        """The request as it is: the wire knows no model."""
        return request

    def complete(self, request: Request, *, sending: Sending = unwatched) -> Reply:
        """The endpoint's answer to one request.

        Raises:
            ModelFault: There was none; whether it may come later is said by `retryable`.
        """
        import openai

        document = request.to_document()
        sending()
        started = time.monotonic()
        try:
            # Typed loosely on purpose: our document is what the wire takes, and is tested so.
            answer: object = self._client.chat.completions.create(**document)  # type: ignore[call-overload]
        except openai.APITimeoutError as error:
            fault = _unanswered("the endpoint took too long to answer", error)
        except openai.APIConnectionError as error:
            fault = _unanswered(f"the connection failed: {_cause(error)}", error)
        except openai.APIStatusError as error:
            wait_s = retry_after_s(dict(error.response.headers))
            fault = fault_of_status(error.status_code, error.body, wait_s, sent=document)
        except openai.OpenAIError as error:
            fault = ModelFault(f"the request failed: {type(error).__name__}", retryable=False)
        except ValueError:
            # A body that is no JSON comes through as a bare JSONDecodeError.
            fault = ModelFault("the endpoint's answer is not valid JSON", retryable=True)
        else:
            return reply_of(answer, latency_s=time.monotonic() - started, secret=self._secret)
        # Outside the handlers, so that nothing of the package's errors (which hold the request
        # with its headers) hangs on ours.
        raise self._secret.cleared(fault)

    def close(self) -> None:
        """Close the connections."""
        self._client.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def _client(base_url: str, key: str, timeout_s: float) -> openai.OpenAI:
    import openai

    address = urlsplit(base_url)
    host = (address.hostname or "").lower()
    foreign = not f".{host}".endswith(_OPENAI_HOSTS)
    headers = dict.fromkeys(("OpenAI-Organization", "OpenAI-Project"), openai.omit)
    return openai.OpenAI(
        api_key=key,
        base_url=base_url,
        max_retries=0,
        timeout=openai.Timeout(timeout_s, connect=min(CONNECT_TIMEOUT_S, timeout_s)),
        default_headers=headers if foreign else None,  # type: ignore[arg-type]
        http_client=openai.DefaultHttpxClient(
            # A redirect would carry the scene to a host that nobody entered.
            follow_redirects=False,
            # The environment's proxy can't reach what listens on this computer alone.
            trust_env=host not in _HERE,
            # Plain HTTP shows no certificate, and loading those to check one by takes longer than
            # a call on this computer.
            verify=address.scheme != "http",
        ),
    )


def _unanswered(message: str, error: BaseException) -> ModelFault:
    """The fault of a request that got no answer; one without a connection was not even sent."""
    if any(type(one).__name__ in _NO_CONNECTION for one in _causes(error)):
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
