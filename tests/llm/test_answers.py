"""Every field of what a server answers, with the right type, another form, and the wrong one."""

import copy
import json
import re
import time
from datetime import UTC, datetime, timedelta
from email.utils import format_datetime
from itertools import product
from pathlib import Path
from typing import Any

import pytest

from augment.errors import ModelFault, ParameterRefused
from augment.llm.answers import MOST_TOKENS, fault_of_status, read_completion
from augment.llm.messages import Reply

_FILE = Path(__file__).parent / "answers.jsonl"
ROWS = [json.loads(line) for line in _FILE.read_text("utf-8").splitlines()]
CALL = {"id": "c", "type": "function", "function": {"name": "f", "arguments": "{}"}}
USAGE = {
    "prompt_tokens": 50,
    "completion_tokens": 9,
    "total_tokens": 59,
    "prompt_tokens_details": {"cached_tokens": 7},
}
MESSAGE = {"role": "assistant", "content": "Hi", "refusal": None, "reasoning_content": "Hm."}
CHOICE = {"index": 0, "finish_reason": "stop", "message": MESSAGE | {"tool_calls": [CALL]}}
WHOLE: dict[str, Any] = {"model": "m", "choices": [CHOICE], "usage": USAGE}


def answer(message: object, finish_reason: object = "stop", **more: object) -> dict[str, Any]:
    choice = {"index": 0, "finish_reason": finish_reason, "message": message} | more
    return WHOLE | {"choices": [choice]}


def read(document: object, least: int = 0) -> Reply:
    return read_completion(document, least_prompt=least)


# --- No silent default -------------------------------------------------------------------------

SENT: dict[str, Any] = {
    "temperature": 0.2, "seed": 7, "reasoning_effort": "xhigh", "max_completion_tokens": 8192
}  # fmt: skip
WRONG: tuple[object, ...] = (7, -1.5, True, "word", "", [], [7], [["a"]], {}, {"a": 1}, None)


def paths(document: object, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Every place of a document but the parts that nobody reads."""
    if isinstance(document, dict):
        inner = [(name, part) for name, part in document.items() if name not in ("index", "role")]
    else:
        inner = list(enumerate(document)) if isinstance(document, list) else []
    return [
        place for name, part in inner for place in [(*path, name), *paths(part, (*path, name))]
    ]


def put(document: object, path: tuple[Any, ...], value: object) -> Any:
    changed = copy.deepcopy(document)
    place: Any = changed
    for name in path[:-1]:
        place = place[name]
    place[path[-1]] = value
    return changed


def is_empty(value: object) -> bool:
    return value is None or value in ("", [], {})


def rows(kind: str) -> list[dict[str, Any]]:
    return [row for row in ROWS if row["kind"] == kind]


def outcome(document: object) -> Reply | ModelFault:
    try:
        return read(document)
    except ModelFault as fault:
        return fault


def fault_of(
    status: int, body: Any, headers: dict[str, str] | None = None, **sent: object
) -> ModelFault:
    fault = fault_of_status(status, body, headers or {}, sent=sent)
    assert isinstance(fault, ModelFault)
    return fault


def test_no_value_of_an_answer_is_silently_another() -> None:
    """Whatever stands in a place is shown, remarked upon or a fault, unless it says nothing."""
    for path, value in product(paths(WHOLE), WRONG):
        reply = outcome(put(WHOLE, path, value))
        says_nothing = is_empty(value) or path[-1] in ("type", "total_tokens")
        says_nothing |= value == {"a": 1} and str(path[-1]).startswith(
            ("usage", "prompt_tokens_d")
        )
        if isinstance(reply, ModelFault):
            assert reply.retryable
        elif not (reply.remarks or says_nothing or reply.refusal is not None):
            texts = (reply.text, reply.reasoning, reply.model, reply.finish_reason)
            calls = [
                text for one in reply.tool_calls for text in (one.id, one.name, one.arguments)
            ]
            counts = (reply.prompt_tokens, reply.completion_tokens, reply.cached_tokens)
            written: set[object] = {json.dumps(value), "a" if value == [["a"]] else str(value)}
            written |= {value} if isinstance(value, int) else set()
            assert written & {*texts, *calls, *counts}, (path, value, reply)
    assert all(isinstance(outcome(value), ModelFault) for value in WRONG)


ERROR = {"message": "No.", "type": "t", "param": "messages", "code": "c"}


def test_whatever_an_error_body_is_it_is_shown() -> None:
    bodies: tuple[Any, ...] = (
        *({"error": ERROR | {name: value}} for name in ERROR for value in WRONG),
        *({name: value} for name in ("error", "detail", "message", "errors") for value in WRONG),
        *WRONG,
    )
    for body in bodies:
        fault = fault_of(400, body, seed=7, temperature=0.5)
        assert not isinstance(fault, ParameterRefused)
        assert is_empty(body) or ": " in str(fault), (body, fault)


@pytest.mark.parametrize("row", rows("reason"), ids=str)
def test_a_reason_is_shown_whatever_form_it_has(row: dict[str, Any]) -> None:
    assert str(fault_of_status(400, row["body"], {}, sent={})).endswith(f": {row['reason']}")


@pytest.mark.parametrize("row", rows("content"), ids=str)
def test_texts_are_joined_and_thoughts_kept_apart(row: dict[str, Any]) -> None:
    reply = read(answer({"content": row["content"]}))
    assert (reply.text, reply.reasoning, reply.remarks) == (row["text"], row["reasoning"], ())


def test_what_nobody_can_read_is_a_fault_alone_and_a_remark_beside_a_text() -> None:
    sound = {"type": "audio", "data": "x"}
    with pytest.raises(ModelFault, match=r"read: content\.0 is a part of type 'audio'"):
        read(answer({"content": [sound, {"type": "thinking", "thinking": "Hm."}]}))
    reply = read(answer({"content": ["Hi", sound]}))
    assert reply.remarks == ("left out: content.1 is a part of type 'audio'",)


def test_calls_in_other_forms_are_calls() -> None:
    part = {"type": "tool_use", "id": "c", "name": "f", "input": {"a": 1}}
    assert [one.arguments for one in read(answer({"content": [part]})).tool_calls] == ['{"a": 1}']
    calls = [
        {"function": {"name": "f", "arguments": {"a": 1}}},
        {"id": 3, "function": {"name": "f", "arguments": None}},
        {"id": "3", "function": {"name": "f", "arguments": "{}"}, "extra_content": {"x": 1}},
    ]
    made = read(answer({"content": None, "tool_calls": calls})).tool_calls
    read_as = [("call_1", '{"a": 1}'), ("3", ""), ("call_3", "{}")]
    assert [(one.id, one.arguments) for one in made] == read_as
    thoughts = {"reasoning_content": "", "reasoning_details": [{"data": "x"}], "reasoning": "Hm."}
    back = read(answer({"content": None, "tool_calls": calls} | thoughts))
    del thoughts["reasoning"]
    assert json.loads(back.extra) == thoughts, "DeepSeek refuses the next request without"
    assert read(answer({"content": "Hi"} | thoughts)).extra == ""
    old = read(answer({"content": None, "function_call": {"name": "f", "arguments": "{}"}}))
    assert [one.name for one in old.tool_calls] == ["f"]


@pytest.mark.parametrize("row", rows("broken"), ids=str)
def test_an_answer_that_the_endpoint_broke_off_may_be_asked_for_again(row: dict[str, Any]) -> None:
    with pytest.raises(ModelFault, match=re.escape(row["reason"])) as caught:
        read(row["answer"])
    assert (caught.value.retryable, caught.value.status) == (True, 200)


@pytest.mark.parametrize("row", rows("withheld"), ids=str)
def test_a_filter_that_withholds_an_answer_says_so_in_many_words(row: dict[str, Any]) -> None:
    assert read(row["answer"]).is_withheld


@pytest.mark.parametrize("reason", ["stop", "eos", "tool_calls", "", "length", "OTHER"])
def test_an_answer_of_its_own_is_withheld_by_nobody(reason: str) -> None:
    quiet = {"hate": {"filtered": False}, "error": {"code": "content_filter_error"}}
    assert not read(answer({"content": "Hi"}, reason, content_filter_results=quiet)).is_withheld


def test_a_limit_has_several_names() -> None:
    for reason in (
        *("length", "MAX_TOKENS", "model_length", "max_output_tokens"),
        *("contextLengthReached", "TOO_LONG", "model_context_window_exceeded"),
    ):
        assert read(answer({"content": "Hi"}, reason)).is_cut_off


@pytest.mark.parametrize("row", [*rows("refusal"), *rows("fault")], ids=str)
def test_an_error_of_a_filter_is_a_refusal_and_no_other_is(row: dict[str, Any]) -> None:
    reply = fault_of_status(row["status"], row["body"], {}, sent={})
    assert isinstance(reply, Reply) == (row["kind"] == "refusal")
    if isinstance(reply, Reply):
        assert reply.is_withheld
        assert reply.refusal


@pytest.mark.parametrize("row", rows("lasting"), ids=str)
def test_what_does_not_pass_by_waiting_is_not_asked_for_again(row: dict[str, Any]) -> None:
    assert not fault_of(row["status"], row["body"]).retryable


@pytest.mark.parametrize("what", ["capacity", "GPU memory", "resources"])
def test_what_a_server_lacks_for_a_while_is_asked_for_again(what: str) -> None:
    body = {"error": {"message": f"The cluster has insufficient {what} at the moment."}}
    assert all(fault_of(status, body).retryable for status in (424, 498, 499, 503))


def test_what_a_model_wrote_in_no_form_is_its_answer() -> None:
    body = {"error": {"message": "No JSON schema.", "code": "json_validate_failed"}}
    body["error"]["failed_generation"] = '{"block": {'
    sent = {"response_format": {"type": "json_schema"}}
    assert fault_of_status(400, body, {}, sent=sent) == Reply(text='{"block": {')


@pytest.mark.parametrize("code", [400, "402", "invalid_api_key", "model_not_found"])
def test_an_error_in_a_200_that_stays_is_not_asked_for_again(code: object) -> None:
    fault = outcome({"error": {"message": "No.", "code": code}})
    assert isinstance(fault, ModelFault)
    assert not fault.retryable


def test_an_error_in_a_200_may_ask_to_wait() -> None:
    fault = outcome({"error": {"message": "Slow down, try again in 8s.", "code": 429}})
    assert isinstance(fault, ModelFault)
    assert (fault.retryable, fault.retry_after_s) == (True, 8.0)


def test_thoughts_that_nobody_may_read_are_thoughts() -> None:
    """OpenRouter hands out those of several vendors sealed; all tokens may have gone into them."""
    details = [{"type": "reasoning.encrypted", "data": "x"}]
    sealed = {"reasoning": None, "reasoning_details": details}
    reply = read(answer({"content": ""} | sealed, "length"))
    assert (reply.text, reply.is_cut_off, reply.remarks) == ("", True, ())


SEED = "does not support the parameter 'seed' "


@pytest.mark.parametrize("words", ["<title>", "unsupported ", "seed_", SEED, "max", "1m"])
def test_nothing_that_a_server_repeats_without_end_holds_a_worker_up(words: str) -> None:
    text, started = words * 50_000, time.process_time()
    fields = {"message": text, "code": text, "retryDelay": text}
    for body in (text, {"error": fields}, {"error": [fields] * 3}):
        fault_of(500, body, **SENT)
    assert not read(answer({"content": "Hi"}, text)).is_withheld
    assert time.process_time() - started < 10.0


@pytest.mark.parametrize("row", rows("usage"), ids=str)
def test_cached_tokens_are_the_prompts_and_a_small_count_is_a_remark(row: dict[str, Any]) -> None:
    reply = read(answer({"content": "Hi"}) | {"usage": row["usage"]}, least=4900)
    counts = [reply.prompt_tokens, reply.completion_tokens, reply.cached_tokens]
    assert (counts, len(reply.remarks)) == (row["counts"], row["remarks"]), reply.remarks


def test_a_count_of_tokens_that_can_not_be_is_unknown() -> None:
    for written, count in (
        *(("7", 7), ("7.0", 7), ('"7"', 7), (str(MOST_TOKENS), MOST_TOKENS)),
        *((written, None) for written in ("0", "7.5", "-1", "true", '"7.5"', "null", "[7]")),
        *((written, None) for written in (str(MOST_TOKENS + 1), "9" * 400)),
        *((written, None) for written in ("1e300", "1e999", "NaN")),
    ):
        usage = dict.fromkeys(("prompt_tokens", "completion_tokens"), json.loads(written))
        reply = read(answer({"content": "Hi"}) | {"usage": usage})
        assert (reply.text, reply.prompt_tokens, reply.completion_tokens) == ("Hi", count, count)


@pytest.mark.parametrize("row", [*rows("unknown parameter"), *rows("refused value")], ids=str)
def test_a_parameter_is_dropped_where_it_is_unknown_alone(row: dict[str, Any]) -> None:
    """Not where a value is not taken, and not where its name is a word in a sentence."""
    refused = fault_of(422, row["body"], **SENT)
    parameter = refused.parameter if isinstance(refused, ParameterRefused) else None
    assert (parameter, refused.retryable) == (row.get("parameter"), "parameter" in row)


DATE = "Wed, 21 Oct 2015 07:28:00 GMT"


def test_the_wait_asked_for_has_three_forms() -> None:
    for headers, wait_s in (
        ({"retry-after-ms": "800", "retry-after": "1"}, 0.8),
        ({"retry-after": "45"}, 45.0),
        ({"retry-after": "1m30s"}, 90.0),
        ({"retry-after-ms": "x", "retry-after": "5 seconds"}, 5.0),
        ({"retry-after": DATE}, 0.0),
        ({"retry-after": DATE, "date": DATE.replace("28:00", "27:15")}, 45.0),
        ({"retry-after": DATE, "date": "2015-10-21T07:27:15Z"}, 0.0),
        ({"body": "37.5s"}, 37.5),
        *(
            ({"sentence": f"Slow down. {asks}. More at x."}, wait_s)
            for asks, wait_s in {
                **{"Please try again in 8s": 8.0, "Please try again in 612ms": 0.612},
                **{"Please retry in 34.07s": 34.07, "Try again in 7m12.5s": 432.5},
                **{"Please retry after 12 seconds": 12.0, "wait 1 minute": 60.0},
                **{"Please try again in 2h13m11.5s. Need more tokens?": 7991.5},
            }.items()
        ),
        *(
            ({"retry-after": said}, wait_s)
            for said, wait_s in {
                **{"0": 0.0, "-5": 0.0, "1e3": 1000.0, "99999999999999999999": 1e20},
                **dict.fromkeys(("soon", "inf", "1e400", "-inf", "9" * 5000, ","), None),
                "Wed, 21 Oct 2015 07:28:00 -0000": 0.0,
            }.items()
        ),
    ):
        details = [{"retryDelay": headers.pop("body", "")}]
        body = {"details": details, "message": headers.pop("sentence", "")}
        fault = fault_of(429, body, headers)
        assert fault.retry_after_s == wait_s
        assert ("can't be read" in str(fault)) == (wait_s is None)


@pytest.mark.parametrize("wait", [{"retry_after": 20}, {"estimated_time": 20.0}], ids=str)
def test_a_wait_may_be_a_number_of_the_body(wait: dict[str, object]) -> None:
    for body in (wait, {"error": "m is loading"} | wait, {"error": wait}):
        assert fault_of(503, body).retry_after_s == 20.0


def test_a_date_is_waited_for() -> None:
    until = format_datetime(datetime.now(UTC) + timedelta(seconds=60), usegmt=True)
    assert fault_of(503, "", {"retry-after": until}).retry_after_s == pytest.approx(60.0, abs=5.0)
