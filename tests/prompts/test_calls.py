import json
from functools import partial

import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.prompts import calls
from augment.prompts.calls import MOST_LOOKED_AT, Tools, WrittenCall, read_arguments
from tests.variants.playing import GOOD

calls_in = partial(calls.calls_in, tool=Tools.POSE_ON_LANE)

ONE = '{"call": "pose_on_lane", "arguments": {"lane": "Lane1"}}'
READ = WrittenCall(name="pose_on_lane", arguments={"lane": "Lane1"})


def test_a_call_is_a_line_or_a_block_of_its_own() -> None:
    for answer in (
        ONE,
        f"I look it up:\n\n  {ONE}  \n\nThen I wait.",
        f"`{ONE}`",
        '{"arguments": {"lane": "Lane1"}, "call": "pose_on_lane"}',
        f"```json\n{ONE}\n```",
        "```json\n" + json.dumps(json.loads(ONE), indent=2) + "\n```",
        f"<think>{ONE}\n{ONE}\n</think>\n{ONE}",
    ):
        assert calls_in(answer) == (READ,)


D = '{"lane": "Lane1", "start": "Agent1", "distance_m": 21.4}'
ARGUMENTS = {"lane": "Lane1", "start": "Agent1", "distance_m": 21.4}
ONE_OF_THEM = WrittenCall(name="pose_on_lane", arguments=ARGUMENTS, mended=True)

FORMS = {
    "in a sentence": f'I will call {{"call": "pose_on_lane", "arguments": {D}}} to find it.',
    "before other words": f'{{"call": "pose_on_lane", "arguments": {D}}} and go on',
    "bullet": f'- {{"call": "pose_on_lane", "arguments": {D}}}',
    "star": f'* `{{"call": "pose_on_lane", "arguments": {D}}}`',
    "numbered": f'1. {{"call": "pose_on_lane", "arguments": {D}}}',
    "numbered with a bracket": f'2) {{"call": "pose_on_lane", "arguments": {D}}}',
    "array": f'[{{"call": "pose_on_lane", "arguments": {D}}}]',
    "object of calls": f'{{"calls": [{{"call": "pose_on_lane", "arguments": {D}}}]}}',
    "name": f'{{"name": "pose_on_lane", "arguments": {D}}}',
    "name and parameters": f'{{"name": "pose_on_lane", "parameters": {D}}}',
    "function and args": f'{{"function": "pose_on_lane", "args": {D}}}',
    "tool": f'{{"tool": "pose_on_lane", "arguments": {D}}}',
    "arguments as text": json.dumps({"name": "pose_on_lane", "arguments": D}),
    "the wire's form": json.dumps(
        {"id": "c1", "type": "function", "function": {"name": "pose_on_lane", "arguments": D}}
    ),
    "tags": f'<tool_call>\n{{"name": "pose_on_lane", "arguments": {D}}}\n</tool_call>',
    "flat": '{"call": "pose_on_lane", ' + D[1:],
    "by its name": f'{{"pose_on_lane": {D}}}',
}


@pytest.mark.parametrize("written", FORMS.values(), ids=FORMS)
@pytest.mark.parametrize("around", ["{}", "First I look it up.\n\n{}\n\nThen I'll wait {{}}."])
def test_a_call_in_another_form_is_read_and_counts_as_mended(written: str, around: str) -> None:
    assert calls_in(around.format(written)) == (ONE_OF_THEM,)


def test_many_calls_come_in_the_order_in_which_they_were_written() -> None:
    lines = [
        '{"call": "pose_on_lane", "arguments": {"distance_m": 1}}',
        '- {"name": "pose_on_lane", "arguments": {"distance_m": 2}}',
        '{"tool": "pose_on_lane", "args": {"distance_m": 3}}; {"pose_on_lane": {"lane": "Lane1"}}',
        '[{"call": "pose_on_lane", "arguments": {"distance_m": 5}},',
        ' {"call": "pose_on_lane", "arguments": {"distance_m": 6}}]',
    ]
    calls = calls_in("\n".join(lines))
    expected = [{"distance_m": n} for n in (1, 2, 3, 5, 6)]
    assert [call.arguments for call in calls] == [*expected[:3], {"lane": "Lane1"}, *expected[3:]]
    assert [call.mended for call in calls] == [False, *[True] * 5]


MALFORMED = [
    ('I call {"call": "pose_on_lane", "arguments": {"lane": "Lane1"', "one line of the form"),
    ('{"arguments": {}, "call": "pose_on_lane"', "one line of the form"),
    ('{"call": "pose_on_lane", "arguments": {}, "why": 1}', "no other keys"),
    ('- {"call": "pose_on_lane"}', "no other keys"),
    ('{"name": "pose_on_lane", "why": 1, "arguments": {}}', "no other keys"),
    ('{"call": {"lane": "Lane1"}, "arguments": {}}', "has the form"),
    ('{"name": "pose_on_lane", "arguments": "{lane: 1}"}', "the arguments are not JSON"),
    ("{'call': 'pose_on_lane', 'arguments': {'distance_m': NaN}}", "one line of the form"),
    ("I need pose_on_lane(lane, start, distance_m) for this.", "is named and not called"),
    ("pose_on_lane(lane='Lane1', distance_m=21.4)", "is named and not called"),
    ("I would ask pose_on_lane for the pose.", "is named and not called"),
]


@pytest.mark.parametrize(("answer", "problem"), MALFORMED)
def test_a_call_that_can_not_be_understood_says_what_is_wrong(answer: str, problem: str) -> None:
    (call,) = calls_in(answer)
    assert problem in call.problem
    assert not call.mended


def test_what_only_looks_like_a_call_is_none() -> None:
    for answer in (
        "",
        "x" * 300_000,
        '{"add": [], "move": [], "remove": []}',
        '{"name": "Agent2", "type": "VEHICLE"}',
        'Modification Dict: {"Action": "add", "Modified_Agent": "Agent2"}',
        "The pose (x=1, y=2) is purpose(ful).",
        "I compute pose(s) by hand.",
    ):
        assert calls_in(answer) == ()


@pytest.mark.parametrize("written", FORMS.values(), ids=FORMS)
def test_a_final_answer_that_tells_of_its_calls_stays_one(written: str) -> None:
    told = GOOD.replace("Step 1:", f"Step 1: I called {written} and got x 21.4.\nStep 2:")
    assert calls_in(told) == ()
    assert calls_in(f"Step 1: I called {written}, so", is_cut_off=True) == ()


def test_a_line_in_the_form_that_was_asked_for_counts_beside_a_block_and_when_cut_off() -> None:
    assert calls_in(f"{ONE}\n{GOOD}") == (READ,)
    assert calls_in(f"{ONE}\nand then", is_cut_off=True) == (READ,)


@given(st.text(alphabet="{}[]()'\"\\:,=. \npose_on_lane1Lcarguments"), st.data())
def test_no_text_breaks_the_reader_of_calls(text: str, data: st.DataObject) -> None:
    form = data.draw(st.sampled_from(sorted(FORMS.values())))
    at = data.draw(st.integers(0, len(form)))
    for call in calls_in(form[:at] + text + form[at:]):
        assert call.problem or call.name


@pytest.mark.parametrize("piece", ["{'call':", '{"name": "', '{"call": [', "pose_"])
def test_the_time_for_a_hostile_answer_is_bounded(piece: str) -> None:
    # Of a limited number of places each is read over a limited number of characters.
    assert len(calls_in(piece * (199_000 // len(piece)))) <= MOST_LOOKED_AT


def test_arguments_of_a_megabyte_are_refused_unread() -> None:
    doubled = "{" + ",".join(['"lane": 1'] * 100_000) + "}"
    assert "longer than 200000 characters" in read_arguments(doubled).problem
    short = "{" + ",".join(['"lane": 1'] * 10_000) + "}"
    assert "'lane' stands twice" in read_arguments(short).problem
    assert calls_in(doubled) == ()
