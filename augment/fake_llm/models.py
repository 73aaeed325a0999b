"""The stand-in's models: behaviour is chosen by the model's name.

`fake-good` and `fake-careless` play every role; `fake-qa-...` are wrong at first, for ever, or
review without ratings; three use their function wrongly; each of the others breaks in one way
that real servers do.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from threading import Lock

from augment.fake_llm import careless, playing, probing
from augment.fake_llm.requests import ChatRequest
from augment.fake_llm.responses import Response, as_json, completion, error, prompt_tokens_of
from augment.fake_llm.sight import Intents, knows_nothing


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
    probed = probing.answer_to(request)
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
    if prompt_tokens_of(request) <= probing.WINDOW_TOKENS:
        return as_json(whole)
    cut = _completed(playing.GOOD, probing.cut_to_window(request), surroundings)
    window = probing.WINDOW_TOKENS
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
