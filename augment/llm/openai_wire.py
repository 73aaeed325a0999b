"""The only door to the network: one OpenAI-compatible endpoint, spoken to with `openai`.

What that package and the many servers make of a fault ends here: the rest of the product sees a
Reply or a ModelFault. Retries are made above, where every attempt is recorded. What a server sent
is read by `augment.llm.answers`.
"""

from __future__ import annotations

import json
import os
import re
import socket
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from augment.errors import CallDropped, InvalidDocument, ModelFault, NotNeeded, NotSent
from augment.llm import wire_transport
from augment.llm.addresses import Resolve
from augment.llm.answers import fault_of_status, read_completion, read_error
from augment.llm.client import Sending, watch_nothing
from augment.llm.costs import least_tokens
from augment.llm.messages import Reply, Request

if TYPE_CHECKING:
    import openai

DEFAULT_TIMEOUT_S = 180.0
MEGABYTE = 1_000_000
DEFAULT_MOST_BYTES = 8 * MEGABYTE

_OPENAI_HOSTS = (".openai.com", ".openai.azure.com")
_HERE = ("localhost", "127.0.0.1", "::1")
# Sent where an endpoint needs no key: without one the package would look for OPENAI_API_KEY.
_KEYLESS = "no-key"
_BROKEN_JSON = "the endpoint's answer is not valid JSON"
_ERROR_EVENT = re.compile(r"^data:[ ]*(\{.*\"error\"[ ]*:[ ]*[{\"].*)$", re.MULTILINE)
_STREAM = "the endpoint answered with a stream of events, which was not asked for"
_EMPTY = "the endpoint answered with an empty body"
_PAGE = "the endpoint answered with a page of text instead of JSON: is its base URL right?"
# A stand-in server is used with keys like "x"; those are no secret.
_SHORTEST_SECRET = 8


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
        look_every_s: float = wire_transport.LOOK_EVERY_S,
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

    def fit(self, request: Request) -> Request:
        """Return the request as it is: the wire knows no model."""
        return request

    def complete(self, request: Request, *, sending: Sending = watch_nothing) -> Reply:
        """Return the endpoint's answer to one request.

        Raises:
            Abandoned: Nobody needs it any more, and it may be billed.
            Unwanted: Nobody needs it any more, and nothing was sent.
            ModelFault: There was none; whether it may come later is said by `retryable`.
        """
        sent = request.to_document()
        sending()
        started = time.monotonic()
        reply = self._exchange("/chat/completions", sent)
        latency_s = time.monotonic() - started
        if not isinstance(reply, Reply):
            least = sum(least_tokens(message.text) for message in request.messages)
            reply = read_completion(reply, least_prompt=least)
        return replace(reply, latency_s=latency_s)

    def list_models(self) -> list[str]:
        """Return the ids of the models that the endpoint lists.

        Raises:
            ModelFault: It lists none.
        """
        document: Any = self._exchange("/models")
        rows = document
        if isinstance(rows, dict):
            rows = rows.get("data") or rows.get("models")
        rows = rows.values() if isinstance(rows, dict) else rows if isinstance(rows, list) else ()
        keys = ("id", "model", "name")
        ids = [[row[key] for key in keys if key in row] for row in rows if isinstance(row, dict)]
        named = [*rows, *(name for some in ids for name in some[:1])]
        names = {name for name in named if isinstance(name, str)}
        if not names:
            reason = read_error(document)
            raise ModelFault(f"the endpoint lists no models{reason}", retryable=False)
        return sorted(names)

    def _exchange(self, path: str, sent: dict[str, object] | None = None) -> object:
        """Return the document that is answered to a POST, or to a GET where nothing is sent.

        Raises:
            Abandoned, Unwanted, ModelFault: As `complete`.
        """
        import httpx2
        import openai

        watch = wire_transport.Watch(
            longest_s=self._timeout_s,
            most_bytes=self._most_bytes,
            still_wanted=self._still_wanted,
            look_every_s=self._look_every_s,
        )
        try:
            with wire_transport.watch_over(watch):
                # Raw: the package passes on what has wrong types as if it had the right ones.
                answer = (
                    self._client.get(path, cast_to=httpx2.Response)
                    if sent is None
                    else self._client.post(path, cast_to=httpx2.Response, body=sent)
                )
            document = self._read(answer.text)
            if not isinstance(document, str):
                return document
            is_json = "json" in answer.headers.get("content-type", "")
            is_stream = document.startswith(("data:", "event:", ":"))
            problem = _STREAM if is_stream else _BROKEN_JSON if is_json else _PAGE
            problem = problem if document.strip() else _EMPTY
            fault: ModelFault | NotNeeded | Reply = ModelFault(
                problem, retryable=problem in (_BROKEN_JSON, _EMPTY), status=200
            )
        except openai.APIStatusError as error:
            fault = fault_of_status(
                error.status_code,
                self._read(error.response.text),
                dict(error.response.headers),
                sent=sent or {},
            )
        except NotNeeded as why:
            fault = CallDropped(why) if watch.has_written else why
        except InvalidDocument as error:
            fault = NotSent(error.problems[0][1])
        except wire_transport.WireFault as error:
            # Where nothing was written there is nothing to be billed.
            kind = ModelFault if watch.has_written else NotSent
            fault = kind(str(error), retryable=error.retryable, status=error.status)
        except openai.OpenAIError as error:
            fault = ModelFault(f"the request failed: {type(error).__name__}", retryable=False)
        if isinstance(fault, Reply):
            return fault
        # Outside the handlers, so that nothing of the package's errors (which hold the request
        # with its headers) hangs on ours.
        if isinstance(fault, ModelFault):
            fault.args = (str(self._clear(str(fault))),)
        raise fault

    def __exit__(self, *fault: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._client.close()

    def _clear(self, value: object) -> object:
        """Return a document without the key and what a database can't hold, in any text."""
        if isinstance(value, dict):
            return {str(self._clear(name)): self._clear(part) for name, part in value.items()}
        if isinstance(value, list):
            return [self._clear(part) for part in value]
        if not isinstance(value, str):
            return value
        text = value.replace("\0", "\ufffd").encode("utf-8", "replace").decode("utf-8")
        return text.replace(self._key, "[key]") if len(self._key) >= _SHORTEST_SECRET else text

    def _read(self, text: str) -> object:
        """Return the document of a body or an error in its events, or the text that is no JSON."""
        error = _ERROR_EVENT.search(text)
        try:
            return self._clear(json.loads(error[1] if error else text.removeprefix("\ufeff")))
        except (ValueError, RecursionError):
            return self._clear(text)


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
    transport = wire_transport.Transport(
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
        timeout=openai.Timeout(
            timeout_s, connect=min(wire_transport.CONNECT_TIMEOUT_S, timeout_s)
        ),
        default_headers=headers if foreign else None,  # type: ignore[arg-type]
        http_client=openai.DefaultHttpxClient(
            transport=transport,  # type: ignore[arg-type]
            headers={"Accept-Encoding": wire_transport.ACCEPTED},
            # A redirect would carry the scene to a host that nobody entered.
            follow_redirects=False,
            # The environment's proxy would look the name up itself, and nobody would check it.
            trust_env=False,
        ),
    )
