"""The stand-in's HTTP server: /v1/chat/completions and /v1/models on this computer."""

from __future__ import annotations

import json
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Lock

from augment.fake_llm import careless, playing
from augment.fake_llm.sight import Intents, knows_nothing
from augment.fake_llm.wire import (
    BadRequest,
    ChatRequest,
    Response,
    as_json,
    chat_request,
    completion,
    error,
    prompt_tokens_of,
)

WINDOW_TOKENS = 2048
"""The context window of `fake-cuts-context`."""

_KEPT_CHARACTERS = 6000
_WORD = re.compile(r"Answer with the single word: (\w+)")
_SUM = re.compile(r"How much is (\d+) and (\d+) together\?")
_DOUBLE = re.compile(r"double the number (\d+)")
_REMEMBER = re.compile(r"The word to remember is ([\w-]+)\.")


def answer_to(request: ChatRequest) -> tuple[str, tuple[tuple[str, str], ...]] | None:
    """A text and calls (name, arguments); None where the request is no question of a probe."""
    message = request.messages[-1]
    text = message.text
    if match := _WORD.fullmatch(text):
        return match.group(1), ()
    if text.startswith("Write a story"):
        return "A car stood on the road. " * 3, ()  # about as long as the limit allows
    if match := _SUM.fullmatch(text):
        total = int(match.group(1)) + int(match.group(2))
        as_object = request.response_format is not None
        return (json.dumps({"sum": total}) if as_object else f"That makes {total}."), ()
    if (match := _DOUBLE.search(text)) and request.tools:
        arguments = json.dumps({"number": int(match.group(1))})
        return "", ((request.tools[0].function.name, arguments),)
    if message.images and text.startswith("Name the colour of the left half"):
        return "The left half is green, the right half is yellow.", ()
    if text.rstrip().endswith("Answer with it alone."):
        match = _REMEMBER.search(text)
        return (match.group(1) if match else "I was told no word."), ()
    return None


def cut_to_window(request: ChatRequest) -> ChatRequest:
    """The request as a server sees it that silently drops the front of a long prompt."""
    last = request.messages[-1]
    kept = last.model_copy(update={"content": last.text[-_KEPT_CHARACTERS:]})
    return request.model_copy(update={"messages": [kept]})


@dataclass(slots=True)
class Surroundings:
    """What an answer may depend on besides its request.

    Attributes:
        slow_s: How long `fake-slow` keeps everybody waiting.
        intents: What an instruction asks for, by its text.
    """

    slow_s: float = 30.0
    intents: Intents = knows_nothing
    _seen: set[str] = field(default_factory=set)
    _lock: Lock = field(default_factory=Lock)

    def is_first(self, request: ChatRequest) -> bool:
        """Whether this very request comes for the first time."""
        key = request.model_dump_json()
        with self._lock:
            first = key not in self._seen
            self._seen.add(key)
        return first


Behaviour = Callable[[ChatRequest, Surroundings], Response]


def respond(request: ChatRequest, surroundings: Surroundings) -> Response:
    """What the model of that name answers; an unknown one is a 404 that names the known."""
    behaviour = MODELS.get(request.model)
    if behaviour is None:
        known = ", ".join(sorted(MODELS))
        message = f"The model {request.model!r} does not exist. Known: {known}."
        return error(404, message, param="model", code="model_not_found")
    return behaviour(request, surroundings)


def good_answer(request: ChatRequest, surroundings: Surroundings) -> str:
    """A right answer in whatever role, or an honest one to what is not understood."""
    return playing.GOOD.answer(request, surroundings.intents).text


def _as(character: playing.Character) -> Behaviour:
    def played(request: ChatRequest, surroundings: Surroundings) -> Response:
        return as_json(_completed(character, request, surroundings))

    return played


def _completed(
    character: playing.Character, request: ChatRequest, surroundings: Surroundings
) -> dict[str, object]:
    probed = answer_to(request)
    if probed is not None:
        return completion(request, probed[0] or None, calls=probed[1])
    answer = character.answer(request, surroundings.intents)
    return completion(request, answer.text or None, calls=answer.calls)


_good = _as(playing.GOOD)


def _no_vision(request: ChatRequest, surroundings: Surroundings) -> Response:
    if any(message.images for message in request.messages):
        return error(400, "This model does not support image input.", param="messages")
    return _good(request, surroundings)


def _cuts_context(request: ChatRequest, surroundings: Surroundings) -> Response:
    """As servers do that keep to their window without a word: 200, and the front is gone."""
    whole = _completed(playing.GOOD, request, surroundings)
    if prompt_tokens_of(request) <= WINDOW_TOKENS:
        return as_json(whole)
    cut = _completed(playing.GOOD, cut_to_window(request), surroundings)
    window = WINDOW_TOKENS
    usage = {"prompt_tokens": window, "completion_tokens": 9, "total_tokens": window + 9}
    return as_json(cut | {"usage": usage})


def _slow(request: ChatRequest, surroundings: Surroundings) -> Response:
    return replace(_good(request, surroundings), wait_s=surroundings.slow_s)


def _always(response: Response) -> Behaviour:
    """The same response to every request."""
    return lambda request, surroundings: response


def _complete(
    text: str | None, changes: dict[str, object] | None = None, **more: str
) -> Behaviour:
    """A completion with that text, whatever is asked."""
    return lambda request, surroundings: as_json(
        completion(request, text, **more) | (changes or {})  # type: ignore[arg-type]
    )


def _too_many(retry_after: str) -> Behaviour:
    return _always(
        error(
            429,
            "Rate limit reached.",
            kind="requests",
            code="rate_limit_exceeded",
            headers={"Retry-After": retry_after},
        )
    )


def _spoilt_block(fields: str) -> Behaviour:
    start = json.dumps({"id": "Agent2", "type": "VEHICLE"})[:-1]
    return _complete(f'Modified Vectors:\n```json\n{{"add": [{start}, {fields}}}]}}\n```\n')


_500 = _always(error(500, "The server had an error.", kind="server_error"))


def _500_then_ok(request: ChatRequest, surroundings: Surroundings) -> Response:
    answer = _500 if surroundings.is_first(request) else _good
    return answer(request, surroundings)


def _broken_json(request: ChatRequest, surroundings: Surroundings) -> Response:
    whole = _good(request, surroundings)
    return replace(whole, body=whole.body[: len(whole.body) // 2])


def _dropped(request: ChatRequest, surroundings: Surroundings) -> Response:
    whole = _good(request, surroundings)
    return replace(whole, cut_at=len(whole.body) // 2)


def _no_usage(request: ChatRequest, surroundings: Surroundings) -> Response:
    answer = good_answer(request, surroundings)
    return as_json(completion(request, answer, with_usage=False))


def _cut_off(request: ChatRequest, surroundings: Surroundings) -> Response:
    text = good_answer(request, surroundings)
    middle = text.find("```json") + len("```json") + 40
    return as_json(completion(request, text[:middle], finish_reason="length"))


def _garbage(request: ChatRequest, _: Surroundings) -> Response:
    rng = careless.dice(request.model_dump_json())
    alphabet = '{}[]",:0123456789.-eE\n\\`#*abcXYZ \u00e9\u2028\x00add"move"remove"call"'
    return as_json(completion(request, "".join(rng.choices(alphabet, k=2000))))


MODELS: dict[str, Behaviour] = {
    "fake-good": _good,
    "fake-careless": _as(playing.CARELESS),
    "fake-qa-low": _as(playing.LEARNING),
    "fake-qa-never": _as(playing.STUBBORN),
    "fake-qa-nonnumeric": _as(playing.NONNUMERIC),
    "fake-tool-loop": _as(playing.LOOPING),
    "fake-unknown-tool": _as(playing.MISNAMING),
    "fake-bad-tool-args": _as(playing.MISCALLING),
    "fake-garbage": _garbage,
    "fake-no-vision": _no_vision,
    "fake-cuts-context": _cuts_context,
    "fake-500": _500,
    "fake-500-then-ok": _500_then_ok,
    "fake-429": _too_many("1"),
    "fake-429-long": _too_many("600"),
    "fake-quota": _always(
        error(
            429,
            "You exceeded your current quota.",
            kind="insufficient_quota",
            code="insufficient_quota",
        )
    ),
    "fake-context": _always(
        error(
            400,
            "This model's maximum context length is 4096 tokens.",
            param="messages",
            code="context_length_exceeded",
        )
    ),
    "fake-list-error": _always(
        as_json(
            [{"error": {"code": 400, "message": "Invalid value.", "status": "INVALID_ARGUMENT"}}],
            status=400,
        )
    ),
    "fake-html": _always(
        Response(body=b"<html><body>Sign in</body></html>", content_type="text/html")
    ),
    "fake-slow": _slow,
    "fake-broken-json": _broken_json,
    "fake-dropped": _dropped,
    "fake-no-choices": _complete("", {"choices": []}),
    "fake-null-choices": _complete("", {"choices": None}),
    "fake-no-usage": _no_usage,
    "fake-refuse": _complete(None, refusal="I can't help with that."),
    "fake-filtered": _complete(None, finish_reason="content_filter"),
    "fake-prose": _complete(
        "The car should stand some way ahead of the ego, a little to the side of its lane."
    ),
    "fake-cut-off": _cut_off,
    "fake-nan": _spoilt_block('"x_m": NaN'),
    "fake-too-few": _spoilt_block('"x_m": 20.0'),
}


_LONGEST_BODY = 32_000_000


class FakeServer(ThreadingHTTPServer):
    """A server that is bound but not yet serving; `serve_forever` does that.

    Args:
        host, port: Where it listens; port 0 takes a free one.
        latency_s: How long every answer takes at least.
        slow_s: How long `fake-slow` takes.
        intents: What an instruction asks for, by its text.

    Raises:
        OSError: The address is taken or is none of this computer's.
    """

    daemon_threads = True

    def __init__(
        self,
        host: str = "127.0.0.1",
        port: int = 0,
        *,
        latency_s: float = 0.0,
        slow_s: float = 30.0,
        intents: Intents = knows_nothing,
    ) -> None:
        self.latency_s = latency_s
        self.surroundings = Surroundings(slow_s=slow_s, intents=intents)
        self.stopping = threading.Event()
        super().__init__((host, port), _Handler)

    @property
    def url(self) -> str:
        """The base URL that a client is given."""
        host, port = self.server_address[:2]
        return f"http://{host!s}:{port}/v1"

    def stop(self) -> None:
        """End serving and close; who waits for a slow answer is let go."""
        self.stopping.set()
        self.shutdown()
        self.server_close()


@contextmanager
def running(
    host: str = "127.0.0.1",
    port: int = 0,
    *,
    latency_s: float = 0.0,
    slow_s: float = 30.0,
    intents: Intents = knows_nothing,
) -> Iterator[FakeServer]:
    """A server that serves in the background until the block ends.

    Raises:
        OSError: The address is taken or is none of this computer's.
    """
    server = FakeServer(host, port, latency_s=latency_s, slow_s=slow_s, intents=intents)
    thread = threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.stop()
        thread.join()


class _Handler(BaseHTTPRequestHandler):
    """One connection; it may carry several requests."""

    server: FakeServer
    protocol_version = "HTTP/1.1"
    timeout = 120.0
    disable_nagle_algorithm = True

    def do_GET(self) -> None:
        """List the models."""
        if self.path.rstrip("/") == "/v1/models":
            models = [{"id": name, "object": "model", "owned_by": "fake"} for name in MODELS]
            self._send(as_json({"object": "list", "data": models}))
        else:
            self._send(_no_such_path(self.path))

    def do_POST(self) -> None:
        """Answer a conversation."""
        body = self._body()
        if body is None:
            self.close_connection = True
            self._send(error(411, "Content-Length is missing or too large"))
        elif self.path != "/v1/chat/completions":
            self._send(_no_such_path(self.path))
        else:
            self._send(self._answer(body))

    def log_message(self, format: str, *args: object) -> None:
        """Stay quiet: a request may hold what nobody wants in a log."""

    def _answer(self, body: bytes) -> Response:
        try:
            return respond(chat_request(body), self.server.surroundings)
        except BadRequest as refused:
            return error(400, str(refused), param=refused.param)

    def _body(self) -> bytes | None:
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > _LONGEST_BODY:
            return None
        return self.rfile.read(int(length))

    def _send(self, response: Response) -> None:
        self.server.stopping.wait(max(self.server.latency_s, response.wait_s))
        try:
            self.send_response(response.status)
            self.send_header("Content-Type", response.content_type)
            self.send_header("Content-Length", str(len(response.body)))
            for name, value in response.headers.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(response.body[: response.cut_at])
        except (BrokenPipeError, ConnectionResetError):
            # Who asked has gone: nobody is left to tell.
            self.close_connection = True
        if response.cut_at is not None:
            self.close_connection = True


def _no_such_path(path: str) -> Response:
    shown = json.dumps(path[:80])
    return error(404, f"There is no {shown}; POST to /v1/chat/completions", code="not_found")
