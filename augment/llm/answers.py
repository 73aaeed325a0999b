"""Answers of OpenAI-compatible servers: a `Reply`, or the fault that one stands for. Pure.

Vendors write the same in many forms. Each value is absent, understood, or not understood; the
last is a fault where nobody could use the answer without it, and a remark of the reply elsewhere.
What is too long is cut here, at the border: a run and its replay from the store see the same.
"""

import json
import math
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from itertools import islice

from augment.errors import ModelFault, ParameterRefused
from augment.foreign import Doubts, Value, describe_kind, read_as, read_whole
from augment.llm.costs import FAR_BELOW
from augment.llm.messages import CALL_FIELDS, LengthName, Reply, ToolCall, extra_of, shorten
from augment.llm.vendors import names_of, says

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
MOST_REMARKS = 20
MOST_LEAVES = 1_000
"""Texts of an error body that are looked at."""
MOST_TOKENS = 100_000_000
"""A count beyond is none: no model reads or writes so much at once."""

_ANSWER = "answer"
_OF_A_CALL = (*CALL_FIELDS, "name", "arguments", "input")
_KINDS = {"refusal": "refusal"} | dict.fromkeys(
    ("thinking", "redacted_thinking", "reasoning", "reasoning_content"), "thought"
)

_PASSING = frozenset({408, 409, 424, 425, 429, 498, 499})
_HEADLINE = re.compile(r"<(title|h1)\b[^>]*>(.*?)</", re.DOTALL | re.IGNORECASE)
_FILTERED = ("code", "content_filter")

_ASKS_TO_WAIT = re.compile(
    r"\b(?:try again|retry|wait) (?:in |after |for )?(\d[\dhm.]* ?m?s\w*|\d+ ?min\w*)",
    re.IGNORECASE,
)
_WAIT = re.compile(
    r"(?:PT)?(?:(?P<hours>\d+)\s*h)?(?:(?P<minutes>\d+)\s*m(?:in\w*)?)?\s*"
    r"(?:(?P<number>-?\d+(?:\.\d+)?(?:e\d+)?)\s*(?P<unit>ms|s(?:ec\w*)?)?)?",
    re.IGNORECASE,
)

# What a request can do without, or say in another way.
_DROPPABLE: tuple[str, ...] = ("temperature", "seed", "reasoning_effort", *LengthName)


@dataclass(frozen=True, slots=True, kw_only=True)
class ForeignError:
    """Error body of any form.

    Attributes:
        message: Its sentences; empty where there is none.
        code: The vendor's word for it.
        parameter: What of the request it names.
        is_withheld: Whether a filter withheld the answer.
        is_spent: Whether a quota or a balance is exhausted, which does not pass by waiting.
        texts: All of them by name; some ask to wait.
    """

    message: str
    code: str
    parameter: str
    is_withheld: bool
    is_spent: bool
    texts: Mapping[str, str]

    def __str__(self) -> str:
        code = f" ({shorten(self.code, LONGEST_CODE)})" if self.code else ""
        return code + (f": {shorten(self.message, LONGEST_MESSAGE)}" if self.message else "")


def read_completion(document: object, *, least_prompt: int) -> Reply:
    """Return the reply in the body of a 200.

    Args:
        document: The body, decoded.
        least_prompt: So many tokens the texts of the prompt have at least.

    Raises:
        ModelFault: It is no completion, or the endpoint broke it off.
    """
    doubts, answer = Doubts(), document if isinstance(document, dict) else {}
    choices = answer.get("choices")
    first = choices[0] if isinstance(choices, list) and choices else None
    choice = first if isinstance(first, dict) else {}
    message = choice.get("message")
    message = message if isinstance(message, dict) else {}
    pieces, calls = _read_message(message, doubts)
    thoughts_back = extra_of(message, message.keys() - names_of("given_back")) if calls else ""
    texts, thoughts, refusals, unread = (
        [text for kind, text in pieces if kind == wanted]
        for wanted in ("text", "thought", "refusal", "unread")
    )
    native = choice.get("native_finish_reason")
    ending = choice.get("finish_reason") or native
    ending = ending.get("type", ending) if isinstance(ending, dict) else ending  # of SGLang
    ending = native if isinstance(native, str) and says("withheld", native[:40]) else ending
    reason = doubts.read(_ANSWER, read_as, ending, str, "choices.0.finish_reason") or ""
    reason = shorten(reason, 40)
    # Without a choice the answer itself is the error, whatever its form.
    error = read_error([answer.get("error"), choice.get("error")] if choice else answer)
    around = [{**answer, "choices": 0, "usage": 0}, {**choice, "message": 0}]
    if error.is_withheld or _FILTERED in _leaves(around) or says("withheld", reason):
        reason = reason if says("withheld", reason) else "content_filter"
        refusals = refusals or ([error.message] if error.message else [])
    else:
        is_usable = bool("".join(texts) or calls or refusals)
        _insist_on_answer(choice, reason, error, [] if is_usable else unread)
    notes = doubts.faults[_ANSWER]
    notes.extend(f"left out: {text}" for text in unread)
    usage = _read(doubts, answer, "usage", dict) or {}
    has_output = bool(calls or "".join([*texts, *thoughts, *refusals]))
    prompt, completion, cached = _read_usage(usage, least_prompt, doubts, has_output=has_output)
    return Reply(
        text="".join(texts),
        model=shorten(_read(doubts, answer, "model", str) or "", 120),
        finish_reason=reason,
        refusal=shorten("".join(refusals), LONGEST_REFUSAL) if refusals else None,
        prompt_tokens=prompt,
        completion_tokens=completion,
        cached_tokens=cached,
        tool_calls=tuple(calls),
        reasoning=shorten("\n".join(thoughts), LONGEST_EXTRA),
        extra=_cap(thoughts_back, "reasoning", doubts),
        remarks=tuple(shorten(note, LONGEST_MESSAGE) for note in notes[:MOST_REMARKS]),
    )


def read_error(body: object) -> ForeignError:
    """Read an error: OpenAI's form, a text, or what LM Studio, TGI, FastAPI and others write."""
    leaves = list(islice(_leaves(body), MOST_LEAVES))
    sentences = [text for name, text in leaves if name in names_of("sentences")]
    message = "; ".join(dict.fromkeys(text for text in sentences if not text.isdigit()))
    order = names_of("codes")
    codes = [text for key in order for name, text in leaves if name == key and " " not in text]
    codes = [text for text in codes if len(text) <= LONGEST_NAME]
    asked = _ASKS_TO_WAIT.search(message)
    return ForeignError(
        message=message,
        code=next((text for name, text in leaves if name in order[:3] and text != "0"), ""),
        parameter=next((text for name, text in leaves if name == "param"), ""),
        is_withheld=any(says("withheld", code) for code in codes)
        or (says("withheld_sentence", message) and not says("about_account", message)),
        is_spent=any(says("spent", text) for text in (*codes, message)),
        texts=dict(leaves) | ({"asks": asked[1]} if asked else {}),
    )


def fault_of_status(
    status: int, body: object, headers: Mapping[str, str], *, sent: Mapping[str, object]
) -> ModelFault | Reply:
    """Return the fault that an HTTP status and its decoded body stand for, or a refusal.

    Args:
        status: Of the answer.
        body: Of the answer, decoded; a text where it is no JSON.
        headers: Of the answer, by names in lower case.
        sent: What the request had, of which the endpoint may refuse something.
    """
    page = _HEADLINE.search(body[:LONGEST_REFUSAL]) if isinstance(body, str) else None
    error = read_error(page[2] if page else body)
    if error.is_withheld and status not in (401, 404, 429):
        refusal = shorten(error.message or error.code, LONGEST_REFUSAL)
        return Reply(text="", finish_reason="content_filter", refusal=refusal, completion_tokens=0)
    if error.code in names_of("ill_written"):
        return Reply(text=error.texts.get("failed_generation", ""))
    message = error.message or (json.dumps(body, ensure_ascii=False) if body else "")
    if "location" in headers:
        message = f"it leads to {headers['location']}; {message}".removesuffix("; ")
    code = "" if error.code == str(status) else error.code
    text = f"the endpoint answered {status}{replace(error, message=message, code=code)}"
    refused = _find_refused_parameter(error, sent) if status in (400, 422) else None
    asked = sent.get("response_format")
    # llama-cpp-python answers 500 to a form that it does not know.
    if isinstance(asked, dict) and status in (400, 422, 500) and says("schema", error.message):
        refused = str(asked["type"])
    if refused:
        return ParameterRefused(refused, text, status=status)
    passing = status in _PASSING or (status >= 500 and not says("lacks", error.message))
    passing = passing and not error.is_spent
    wait_s, remark = _read_wait({**error.texts, **headers}) if passing else (None, "")
    return ModelFault(text + remark, retryable=passing, status=status, retry_after_s=wait_s)


# Private


def _read(
    doubts: Doubts, fields: Mapping[str, object], name: str, kind: type[Value], path: str = ""
) -> Value | None:
    return doubts.read(_ANSWER, read_as, fields.get(name), kind, f"{path}{name}")


def _read_message(
    message: Mapping[str, object], doubts: Doubts
) -> tuple[list[tuple[str, str]], list[ToolCall]]:
    """Return text, thoughts, refusal and what can't be read, each by its kind, and the calls."""
    thoughts = next((message[name] for name in names_of("thoughts") if message.get(name)), None)
    pieces = [
        *_pieces(message.get("content"), "content"),
        *_pieces(thoughts, "reasoning", "thought"),
        *_pieces(message.get("refusal") or None, "refusal", "refusal"),
    ]
    if message.keys() - {"role"} and not message.keys() & names_of("message"):
        pieces.append(("unread", "the message has none of the fields of a message"))
    made: list[ToolCall] = []
    ids: set[str] = set()
    calls, parts = message.get("tool_calls"), message.get("content")
    # Anthropic puts calls among the parts of a message.
    parts = [part for part in parts if isinstance(part, dict)] if isinstance(parts, list) else []
    calls = calls or [part for part in parts if part.get("type") == "tool_use"] or calls
    if calls is None and message.get("function_call"):
        calls = [{"function": message["function_call"]}]  # as it was called before 2024
    if calls is not None and not isinstance(calls, list):
        pieces.append(("unread", f"tool_calls is {describe_kind(calls)}, not a list"))
        calls = None
    calls = calls or []
    if calls[MOST_CALLS:]:
        pieces.append(("unread", f"{len(calls) - MOST_CALLS} more calls"))
    for number, fields in enumerate(calls[:MOST_CALLS], start=1):
        path = f"tool_calls.{number}."
        fields = fields if isinstance(fields, dict) else {}
        function = _read(doubts, fields, "function", dict, path) or fields
        name = _read(doubts, function, "name", str, path)
        if not name:
            pieces.append(("unread", f"call {number} names no function"))
            continue
        # Some servers number no calls, some all alike; the answer to one must name it.
        given = fields.get("id")
        named = {"id": str(given)} if type(given) is int else fields
        call_id = _read(doubts, named, "id", str, path)
        if not call_id or call_id in ids:
            call_id = f"call_{number}"
        ids.add(call_id)
        # A text, which may be broken; some servers send the object itself.
        arguments = function.get("arguments", function.get("input"))
        if not isinstance(arguments, str):
            arguments = "" if arguments is None else json.dumps(arguments)
        made.append(
            ToolCall(
                id=shorten(call_id, LONGEST_NAME),
                name=shorten(name, LONGEST_NAME),
                arguments=shorten(arguments, LONGEST_ARGUMENTS),
                extra=_cap(extra_of(fields, _OF_A_CALL), path, doubts),
            )
        )
    return pieces, made


def _cap(extra: str, path: str, doubts: Doubts) -> str:
    """Return what is to go back as it came, or nothing and a remark where it is too long."""
    if len(extra) <= LONGEST_EXTRA:
        return extra
    too_much = f"{path} carries more than {LONGEST_EXTRA} characters: left out"
    doubts.faults[_ANSWER].append(too_much)
    return ""


def _pieces(value: object, path: str, kind: str = "text") -> Iterator[tuple[str, str]]:
    """Yield the texts of a message's field by their kind: a text, a part, or a list of either."""
    if isinstance(value, str):
        yield kind, value
    elif isinstance(value, list):
        for number, item in enumerate(value):
            yield from _pieces(item, f"{path}.{number}", kind)
    elif isinstance(value, dict) and value.get("type") != "tool_use":
        name = next((name for name in names_of("texts") if value.get(name) is not None), None)
        kind = "thought" if value.get("thought") is True else kind  # as Google has it
        kind = _KINDS.get(str(value.get("type")), kind)
        if name is not None:
            yield from _pieces(value[name], path, kind)
        elif kind == "thought" and value.keys() & names_of("sealed"):
            yield kind, ""
        else:
            yield "unread", f"{path} is a part of type {str(value.get('type'))[:40]!r}"
    elif value is True and kind == "refusal":
        yield kind, ""
    elif value is not None and not isinstance(value, dict):
        yield "unread", f"{path} is {describe_kind(value)}, not a text"


def _insist_on_answer(
    choice: Mapping[str, object], reason: str, error: ForeignError, unread: list[str]
) -> None:
    """Return where there is an answer that nobody broke off.

    Args:
        choice: The first; empty without one.
        reason: Why it ended.
        error: What stands beside it.
        unread: What is there instead of anything that can be used.

    Raises:
        ModelFault: There is none.
    """
    message = choice.get("message")
    if says("broken", reason):
        problem = f"broke off its answer, finish_reason {shorten(reason, 40)!r}{error}"
    elif str(error):
        problem = f"answered 200 with an error{error}"
    elif not choice:
        problem = "answered without a choice"
    elif not isinstance(message, dict):
        what = "" if message is None else f" that is an object: it is {describe_kind(message)}"
        problem = f"answered without a message{what}"
    elif unread:
        problem = f"answered in a form that can't be read: {unread[0]}"
    else:
        return
    is_lasting = error.is_spent or says("lasting", error.code)
    wait_s, remark = _read_wait(error.texts)
    text = f"the endpoint {problem}{remark}"
    raise ModelFault(text, retryable=not is_lasting, status=200, retry_after_s=wait_s)


def _read_usage(
    usage: Mapping[str, object], least_prompt: int, doubts: Doubts, *, has_output: bool
) -> tuple[int | None, int | None, int | None]:
    """Return the tokens of prompt and answer, and those of the prompt from a cache.

    Zeros are unknown. Gateways to Anthropic leave what came from the cache out of the prompt: it
    is then more than the prompt, or what lacks to the total or to what was sent.
    """
    places = {"usage.": usage}
    for name in ("prompt_tokens_details", "input_tokens_details"):
        places[f"usage.{name}."] = _read(doubts, usage, name, dict, "usage.") or {}

    def count(*names: str) -> int | None:
        rows = (
            (fields.get(name), place + name, 0, MOST_TOKENS)
            for place, fields in places.items()
            for name in names
        )
        return max(doubts.read_all(_ANSWER, read_whole, rows), default=None)

    prompt = count("prompt_tokens", "input_tokens")
    completion = count("completion_tokens", "output_tokens")
    cached = count(*names_of("cached"))
    beside = (cached or 0) + (count(*names_of("created")) or 0)
    total, least = count("total_tokens"), FAR_BELOW * least_prompt
    if usage and not any("tokens" in name for name in usage):
        doubts.faults[_ANSWER].append(f"usage has no count of tokens: {shorten(str(usage), 100)}")
    if prompt is not None and beside:
        whole = prompt + beside
        if beside > prompt or total == whole + (completion or 0) or prompt < least <= whole:
            prompt = whole
    elif prompt and prompt < least <= (total or 0) - (completion or 0):
        prompt = (total or 0) - (completion or 0)
    if prompt and total and completion is not None and has_output:
        # Google and xAI count thoughts in the total alone.
        completion = max(completion, total - prompt)
    if completion == 0 and (has_output or not prompt):
        completion = None
    if prompt and prompt < least:
        doubts.faults[_ANSWER].append(
            f"the endpoint counted {prompt} tokens of a prompt that has at least {least_prompt}"
        )
    return prompt or None, completion, cached


def _leaves(value: object, name: str = "") -> Iterator[tuple[str, str]]:
    """Yield each text and number of an error body with the name that it stands under."""
    if isinstance(value, dict):
        place = value.get("loc")
        if isinstance(place, list) and place and isinstance(value.get("msg"), str):
            yield "param", str(place[-1])
            value = {**value, "msg": f"{place[-1]}: {value['msg']}"}
        blocked = any(value.get(name) for name in names_of("blocked"))
        if blocked or any(value.get(flag) is True for flag in names_of("flags")):
            yield _FILTERED
        for key, inner in value.items():
            yield from _leaves(inner, key)
    elif isinstance(value, list):
        for item in value:
            yield from _leaves(item, name)
    elif isinstance(value, str | float | int) and not isinstance(value, bool):
        text = str(value).strip()
        if (inner := _inner(name, text)) is not None:
            yield from _leaves(inner, name)
        elif text not in ("", "None"):  # as LiteLLM writes what is absent
            yield name, text


def _inner(name: str, text: str) -> object:
    """Return the JSON that a sentence holds where a gateway passes on what it was told."""
    if text[:1] == "{" and text.count("{") <= MOST_CALLS and name in names_of("sentences"):
        with suppress(ValueError, RecursionError):
            return json.loads(text)
    return None


def _find_refused_parameter(error: ForeignError, sent: Mapping[str, object]) -> str | None:
    """Return the parameter that the endpoint says it does not know, None where it says other.

    A value that is not taken (too large, not one of a list, only the default) is no parameter
    that is not taken, and a word that stands in a sentence is no parameter at all.
    """
    named, text = error.parameter.partition(".")[0], error.message[:LONGEST_REFUSAL]
    for name in _DROPPABLE:
        if name not in sent or named not in ("", name):
            continue
        sent_value = f"{sent[name]:g}" if isinstance(sent[name], float) else str(sent[name])
        is_about_value = says("about_value", text) or re.search(
            rf"(?<![\w.-]){re.escape(sent_value)}\b", text
        )
        if (named and error.code in names_of("not_taken")) or says(
            "unknown_parameter", text, name=name
        ):
            return name
        is_unknown = says("unknown_unless_value", text, name=name) or (
            named and says("unknown", text)
        )
        if is_unknown and not is_about_value:
            return name
    return None


def _read_wait(fields: Mapping[str, str]) -> tuple[float | None, str]:
    """Return the seconds that an answer asks to wait, and a remark on what can't be read."""
    waits = {
        name: fields[name].strip() for name in names_of("waits") if fields.get(name, "").strip()
    }
    for name, text in waits.items():
        match = _WAIT.fullmatch(text)
        try:
            if match is not None:
                scale = 0.001 if name.endswith("-ms") or match["unit"] == "ms" else 1.0
                parts = (match[part] for part in ("hours", "minutes", "number"))
                hours, minutes, number = (float(part or 0) for part in parts)
                seconds = 3600.0 * hours + 60.0 * minutes + scale * number
            else:
                until, now = parsedate_to_datetime(text).replace(tzinfo=UTC), datetime.now(UTC)
                # By the server's clock where it says: ours may be wrong.
                with suppress(ValueError):
                    now = parsedate_to_datetime(fields.get("date", "")).replace(tzinfo=UTC)
                seconds = (until - now).total_seconds()  # HTTP knows GMT alone
        except (ValueError, OverflowError):
            continue
        if math.isfinite(seconds):
            return max(0.0, seconds), ""
    unread = next(iter(waits.items()), None)
    return None, f" (its {unread[0]} can't be read: {unread[1][:40]!r})" if unread else ""
