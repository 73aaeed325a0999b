from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.prompts.calls import WrittenCall, calls_in, read_arguments

ONE = '{"call": "pose_on_lane", "arguments": {"lane": "Lane1"}}'
READ = WrittenCall(name="pose_on_lane", arguments={"lane": "Lane1"})


@pytest.mark.parametrize(
    "answer",
    [
        ONE,
        f"I look it up:\n\n  {ONE}  \n\nThen I wait.",
        f"`{ONE}`",
        f"```json\n{ONE}\n```",
        "```json\n" + json.dumps(json.loads(ONE), indent=2) + "\n```",
        f"<think>{ONE}\n{ONE}\n</think>\n{ONE}",
    ],
)
def test_a_call_is_a_line_or_a_block_of_its_own(answer: str) -> None:
    assert calls_in(answer) == (READ,)


@pytest.mark.parametrize(
    "answer",
    [
        "",
        f"I would write {ONE} here.",
        f"{ONE} and go on",
        '{"add": [], "move": [], "remove": []}',
        '{"arguments": {}, "call": "pose_on_lane"',
        "x" * 300_000,
    ],
)
def test_what_only_looks_like_a_call_is_none_or_has_a_problem(answer: str) -> None:
    assert all(call.problem for call in calls_in(answer))


@given(st.lists(st.sampled_from([ONE, '{"call":', "```", "\n", "}", "{", '"', "NaN", " ", "a"])))
def test_no_answer_breaks_the_reader_of_calls(parts: list[str]) -> None:
    for call in calls_in("".join(parts)):
        assert call.problem or call.name


@given(st.text())
def test_no_text_breaks_the_reader_of_arguments(text: str) -> None:
    read_arguments(text)
