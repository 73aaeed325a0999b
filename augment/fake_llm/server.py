"""The stand-in's HTTP server and its models, whose names choose the behaviour.

`fake-good` and `fake-careless` play every role; `fake-qa-...` are wrong at first or for ever;
`fake-tool-loop` calls without end; each of the others breaks in one way that real servers do. It
also answers the tiny questions of a probe.
"""

import json
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from itertools import dropwhile
from typing import Any

from augment.errors import ReplyUnreadable
from augment.fake_llm import careless, playing, wire
from augment.fake_llm.sight import KnownTasks, knows_nothing
from augment.llm.questions import MARKER
from augment.prompts.blocks import last_object
from augment.scene.entities import AgentType

WINDOW_TOKENS = 2048
"""The context window of `fake-cuts-context`."""

SLOW = "fake-slow"

_KEPT_CHARACTERS = 6000
_LONGEST_BODY = 32_000_000


class FakeServer(ThreadingHTTPServer):
    """A server that is bound but not yet serving; `serve_forever` does that.

    Args:
        host, port: Where it listens; port 0 takes a free one.
        slow_s: How long `fake-slow` takes.
        known: The scenes and intents of an instruction, by its text.

    Raises:
        OSError: The address is taken or is none of this computer's.
    """

    daemon_threads = True

    def __init__(
        self,
        host: str = "127.0.0.1",
        port: int = 0,
        *,
        slow_s: float = 30.0,
        known: KnownTasks = knows_nothing,
    ) -> None:
        self.slow_s, self.known = slow_s, known
        self.stopping = threading.Event()
        self._seen: set[str] = set()
        self._lock = threading.Lock()
        super().__init__((host, port), _Handler)

    @property
    def url(self) -> str:
        """The base URL that a client is given."""
        host, port = self.server_address[:2]
        return f"http://{host!s}:{port}/v1"

    def stop(self) -> None:
        """Stop serving and close; whoever waits for a slow answer is let go."""
        self.stopping.set()
        self.shutdown()
        self.server_close()

    def is_first(self, request: wire.ChatRequest) -> bool:
        """Return whether this very request comes for the first time."""
        key = request.model_dump_json()
        with self._lock:
            first = key not in self._seen
            self._seen.add(key)
        return first


@contextmanager
def running(host: str = "127.0.0.1", port: int = 0, **settings: Any) -> Iterator[FakeServer]:
    """Run a `FakeServer` with those settings in the background until the block ends.

    Raises:
        OSError: The address is taken or is none of this computer's.
    """
    server = FakeServer(host, port, **settings)
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
        models = [{"id": name, "object": "model", "owned_by": "fake"} for name in MODELS]
        is_list = self.path.rstrip("/") == "/v1/models"
        listed = wire.Response(document={"object": "list", "data": models})
        self._send(listed if is_list else wire.error(404, "GET /v1/models lists the models"))

    def do_POST(self) -> None:
        """Answer a conversation."""
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > _LONGEST_BODY:
            self.close_connection = True
            self._send(wire.error(411, "Content-Length is missing or too large"))
            return
        body = self.rfile.read(int(length))
        if self.path != "/v1/chat/completions":
            self._send(wire.error(404, "POST to /v1/chat/completions"))
            return
        try:
            request = wire.chat_request(body)
        except wire.BadRequest as refused:
            self._send(wire.error(400, str(refused)))
            return
        if request.model == SLOW:
            self.server.stopping.wait(self.server.slow_s)
        self._send(MODELS.get(request.model, _unknown)(request, self.server))

    def log_message(self, format: str, *args: object) -> None:
        """Stay quiet: a request may hold what nobody wants in a log."""

    def _send(self, response: wire.Response) -> None:
        body = json.dumps(response.document).encode()
        try:
            self.send_response(response.status)
            self.send_header("Content-Type", "application/json")
            self.send_header("Content-Length", str(len(body)))
            for name, value in response.headers.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(body)
        except (BrokenPipeError, ConnectionResetError):
            self.close_connection = True


# --- The models --------------------------------------------------------------------------------

Behaviour = Callable[[wire.ChatRequest, FakeServer], wire.Response]


def _unknown(request: wire.ChatRequest, server: FakeServer) -> wire.Response:
    message = f"The model {request.model!r} does not exist. Known: {', '.join(sorted(MODELS))}."
    return wire.error(404, message, code="model_not_found")


def _as(character: playing.Character) -> Behaviour:
    def play(request: wire.ChatRequest, server: FakeServer) -> wire.Response:
        text, calls = _answer_probe(request) or character.answer(request, server.known)
        if request.response_format is not None and not calls:
            text = _by_schema(text)
        return wire.completion(request, text or None, calls=calls)

    return play


def _answer_probe(request: wire.ChatRequest) -> tuple[str, wire.Calls] | None:
    """Answer a question of a probe; None where the request is none."""
    message = request.messages[-1]
    text = message.text
    if match := re.fullmatch(r"Answer with the single word: (\w+)", text):
        return match[1], ()
    if text.startswith("Write a story"):
        return "A car stood on the road. " * 3, ()  # about as long as the limit allows
    if text.startswith("Write a sentence") and request.response_format is not None:
        return json.dumps({"plate": MARKER, "doors": 4}), ()
    if (match := re.search(r"double the number (\d+)", text)) and request.tools:
        name = request.tools[0]["function"]["name"]
        return "", ((name, json.dumps({"number": int(match[1])})),)
    if message.images and text.startswith("Name the colour of the left half"):
        return "The left half is green, the right half is yellow.", ()
    if text.rstrip().endswith("Answer with it alone."):
        match = re.search(r"The word to remember is ([\w-]+)\.", text)
        return (match[1] if match else "I was told no word."), ()
    return None


def _by_schema(text: str) -> str:
    """Return the block of an answer as a schema has it; any other text as it is."""
    try:
        block, _ = last_object(text, frozenset({"add"}))
    except ReplyUnreadable:
        return text
    lists: dict[str, Any] = {"move": [], "remove": [], **block}
    for agent in [*lists["add"], *lists["move"]]:
        is_walker = agent["type"] == AgentType.PEDESTRIAN and "motion" not in agent
        agent.setdefault("walk_to" if is_walker else "motion", None)
    for agent in lists["add"]:
        del agent["id"]
    filled = dropwhile(lambda name: not lists[name], ("add", "move", "remove"))
    change = {name: lists[name] for name in filled} or {"unchanged": "The sections say why."}
    return json.dumps({"block": change})


_good = _as(playing.GOOD)


def _no_vision(request: wire.ChatRequest, server: FakeServer) -> wire.Response:
    if any(message.images for message in request.messages):
        return wire.error(400, "This model does not support image input.")
    return _good(request, server)


def _cuts_context(request: wire.ChatRequest, server: FakeServer) -> wire.Response:
    """Answer as servers do that keep to their window without a word: the front is gone."""
    if request.tokens <= WINDOW_TOKENS:
        return _good(request, server)
    last = request.messages[-1]
    shortened = last.model_copy(update={"content": last.text[-_KEPT_CHARACTERS:]})
    text, _ = playing.GOOD.answer(
        request.model_copy(update={"messages": [shortened]}), server.known
    )
    return wire.completion(request, text, usage=(WINDOW_TOKENS, 9))


def _cut_off(request: wire.ChatRequest, server: FakeServer) -> wire.Response:
    text, _ = playing.GOOD.answer(request, server.known)
    middle = text.find("```json") + len("```json") + 40
    return wire.completion(request, text[:middle], finish_reason="length")


def _garbage(request: wire.ChatRequest, server: FakeServer) -> wire.Response:
    rng = careless.dice(request.model_dump_json())
    alphabet = '{}[]",:0123456789.-eE\n\\`#*abcXYZ \u00e9\u2028\x00add"move"remove"call"'
    return wire.completion(request, "".join(rng.choices(alphabet, k=2000)))


def _always(response: wire.Response) -> Behaviour:
    """Give the same response to every request."""
    return lambda request, server: response


def _complete(text: str | None, **more: str) -> Behaviour:
    """Complete every request with that text."""
    return lambda request, server: wire.completion(request, text, **more)  # type: ignore[arg-type]


_500 = _always(wire.error(500, "The server had an error."))

MODELS: dict[str, Behaviour] = {
    "fake-good": _good,
    "fake-careless": _as(playing.CARELESS),
    "fake-refuse-prose": _as(playing.TALKATIVE),
    "fake-qa-low": _as(playing.LEARNING),
    "fake-qa-never": _as(playing.STUBBORN),
    "fake-tool-loop": _as(playing.LOOPING),
    "fake-garbage": _garbage,
    "fake-no-vision": _no_vision,
    "fake-cuts-context": _cuts_context,
    SLOW: _good,
    "fake-500": _500,
    "fake-500-then-ok": lambda request, server: (_500 if server.is_first(request) else _good)(
        request, server
    ),
    "fake-429": _always(
        wire.error(429, "Rate limit reached.", "rate_limit_exceeded", {"Retry-After": "1"})
    ),
    "fake-quota": _always(
        wire.error(429, "You exceeded your current quota.", "insufficient_quota")
    ),
    "fake-refuse": _complete(None, refusal="I can't help with that."),
    "fake-filtered": _complete(None, finish_reason="content_filter"),
    "fake-prose": _complete("The car should stand some way ahead of the ego, a little aside."),
    "fake-cut-off": _cut_off,
}
