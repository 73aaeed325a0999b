"""The FC variants: calls in the answer and native ones, their limits, and what goes wrong."""

import json
from dataclasses import replace

import pytest

from augment.llm.messages import Message, Speaker, ToolChoice
from augment.variants.pipeline import OutcomeStatus
from tests.prompts.test_calls import FORMS
from tests.variants.playing import Play, call, car, native

POSE = '{"lane": "Lane1", "start": "Agent1", "distance_m": 21.4, "lateral_m": 0.5}'


def results(message: Message) -> list[dict[str, object]]:
    """What the program said about calls in the answer."""
    lines = [line for line in message.text.splitlines() if line[:2].rstrip(".").isdigit()]
    return [json.loads(line.partition(". ")[2]) for line in lines]


def test_calls_in_an_answer_are_answered_in_order_and_then_read_on() -> None:
    first = f"I look it up.\n{call()}\n{call(distance_m=30.0, lateral_m=-1.0)}"
    play = Play("fc-plus", [first, car(21.4)])
    assert (play.roles, play.x_m) == ("mm", 21.4)
    said, told = play.client.requests[1].messages[2:]
    assert (said.speaker, said.text) == (Speaker.ASSISTANT, first)
    assert told.speaker is Speaker.USER
    assert told.text.startswith("Function result")
    assert [(one["x_m"], one["y_m"]) for one in results(told)] == [(21.4, 0.0), (30.0, -1.0)]
    assert play.client.requests[0].tools == ()
    assert [note["tool"] for note in play.notes("tool_call")] == ["pose_on_lane"] * 2


def test_what_is_wrong_with_a_call_goes_back_as_text() -> None:
    for line, said in (
        ('{"call": "pose_on_lane", "arguments": {"lane": "Lane1"', "one line of the form"),
        (call("nearest_lane"), "there is no function 'nearest_lane'; there is pose_on_lane"),
        (call(lane="Lane9"), "there is no lane 'Lane9'"),
        ('{"call": "pose_on_lane", "arguments": [1]}', "Input should be a valid dictionary"),
        ('{"call": "pose_on_lane", "arguments": {"distance_m": NaN}}', "NaN is not a number"),
    ):
        play = Play("fc-plus", [line, car(21.4)])
        (result,) = results(play.client.requests[1].messages[-1])
        assert said in str(result["error"])
        assert play.outcome.status is OutcomeStatus.DONE


@pytest.mark.parametrize("native", [False, True])
def test_a_call_in_another_form_is_answered_and_recorded_as_mended(native: bool) -> None:
    said = f"I look it up.\n\n{FORMS['bullet']}\n"
    play = Play("fc-plus", [said, car(21.4)], native=native)
    assert (play.roles, play.x_m) == ("mm", 21.4)
    told = play.client.requests[1].messages[-1]
    assert told.speaker is Speaker.USER
    (result,) = results(told)
    assert result["x_m"] == 21.4
    assert "placement" not in told.text
    (note,) = play.notes("tool_call")
    assert (note["tool"], note["understood"], note["mended"]) == ("pose_on_lane", True, True)


def test_a_call_that_is_not_understood_is_told_so_and_never_to_keep_a_placement() -> None:
    play = Play("fc-plus", ["I would call pose_on_lane from Agent1.", car(21.4)])
    told = play.client.requests[1].messages[-1].text
    assert "is named and not called" in told
    assert "placement" not in told
    assert told.endswith("or give your answer in the five sections.")
    assert (play.roles, play.x_m) == ("mm", 21.4)
    (note,) = play.notes("tool_call")
    assert not note["mended"]


def test_after_eight_calls_none_is_answered_and_an_answer_is_due() -> None:
    calls = [call(distance_m=float(n)) for n in range(1, 11)]
    play = Play("fc-plus", [*calls[:9], car(21.4)])
    assert play.roles == "m" * 10
    last = play.client.requests[9].messages[-1].text
    assert "no call is left: 8 are allowed" in last
    assert last.endswith("Give your answer in the five sections now, with what you have.")


def test_a_model_in_a_loop_is_stopped_and_unreadable() -> None:
    play = Play("fc-plus", [call()] * 6)
    assert play.outcome.status is OutcomeStatus.UNREADABLE
    assert play.roles == "m" * 6
    assert "answered 3 times" in play.client.requests[4].messages[-1].text
    assert "could not be read" in play.client.requests[5].messages[-1].text


def test_a_native_call_where_calls_are_written_is_told_so_and_counts() -> None:
    play = Play("fc-plus", [native(POSE, POSE), call(), car(21.4)])
    assert play.outcome.status is OutcomeStatus.DONE
    told = play.client.requests[1].messages[-1].text
    assert told.startswith("Function result")
    assert told.count("calls are not made natively here; a call is one line of the form") == 2
    assert len(play.notes("tool_call")) == 3


def test_native_calls_are_answered_one_by_one_and_come_back_as_they_were() -> None:
    signed = '{"extra_content": {"google": {"thought_signature": "abc"}}}'
    called = replace(native(POSE, POSE, extra=signed), extra='{"reasoning_content": "Hm."}')
    play = Play("fc-plus", [called, car(21.4)], native=True)
    first, second = play.client.requests
    assert [tool.name for tool in first.tools] == ["pose_on_lane"]
    assert '{"call"' not in first.messages[0].text
    said, *told = second.messages[2:]
    document = said.to_document()
    assert (document["content"], document["reasoning_content"]) == (None, "Hm.")
    calls = document["tool_calls"]
    assert isinstance(calls, list)
    assert calls[0]["extra_content"] == {"google": {"thought_signature": "abc"}}
    assert [(one.speaker, one.answers) for one in told] == [("tool", "c0"), ("tool", "c1")]
    assert json.loads(told[0].text)["y_m"] == 0.5
    assert (second.tool_choice, play.x_m) == (ToolChoice.AUTO, 21.4)


THERE = {"lane": "Lane1", "agent": "VEHICLE", "dist": 21.4}


@pytest.mark.parametrize("native_calls", [False, True])
def test_the_papers_function_returns_one_pose_and_nothing_else(native_calls: bool) -> None:
    points = {"lane": [[-35.0, 0.0], [80.0, 0.0]]}
    asked = [THERE, THERE | points, THERE | {"agent": "TRAFFIC_CONE"}]
    written = "\n".join(
        json.dumps({"call": "retrieve_suitable_pose", "arguments": one}) for one in asked
    )
    called = native(*map(json.dumps, asked), name="retrieve_suitable_pose")
    play = Play("fc", [called if native_calls else written, car(21.4)], native=native_calls)
    first, second = play.client.requests
    assert [tool.name for tool in first.tools] == ["retrieve_suitable_pose"] * native_calls
    assert "pose_on_lane" not in first.messages[0].text
    told = second.messages[3:]
    poses = [json.loads(one.text) for one in told] if native_calls else results(told[0])
    assert poses == [[-13.6, 0.0, 0.0]] * 3
    assert play.outcome.status is OutcomeStatus.DONE


def test_what_it_can_t_answer_goes_back_as_text() -> None:
    for changes, said in (
        ({"lane": "Lane9"}, "there is no lane 'Lane9'"),
        ({"lane": [[0.0, 0.0], [1.0, 1.0]]}, "there is no lane"),
        ({"agent": "TANK"}, "agent: String should match"),
        ({"dist": 115.1}, "this lane ends after 115.00"),
        ({"dist": -0.1}, "greater than or equal to 0"),
        ({"dist": [1.0, 2.0]}, "dist: Input should be a valid number"),
        ({"lateral_m": 0.5}, "lateral_m: is not a field of this format"),
    ):
        call = {"call": "retrieve_suitable_pose", "arguments": THERE | changes}
        play = Play("fc", [json.dumps(call), car(21.4)])
        (result,) = results(play.client.requests[1].messages[-1])
        assert said in str(result["error"])


def test_our_function_is_none_of_the_papers_variant() -> None:
    play = Play("fc", [call(), car(21.4)])
    (result,) = results(play.client.requests[1].messages[-1])
    assert "no function 'pose_on_lane'; there is retrieve_suitable_pose" in str(result["error"])
