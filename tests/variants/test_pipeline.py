import pytest

from augment.errors import ModelFault
from augment.llm.messages import Reply, Speaker
from augment.prompts.fill import prompt_version
from augment.variants.pipeline import EditTask, OutcomeStatus, run
from augment.variants.recipes import OTM
from augment.variants.respondents import RespondentClient
from tests.llm.scripted import ScriptedClient
from tests.scenes import scene
from tests.variants.memory import MemoryTranscript
from tests.variants.playing import GOOD, Play, agent, answer, block, native


def test_one_good_answer_is_one_call_and_a_modification() -> None:
    made = Play("otm", [GOOD])
    outcome = made.outcome
    assert outcome.status is OutcomeStatus.DONE
    assert outcome.modification is not None
    assert [a.id for a in outcome.modification.added] == ["Agent2"]
    assert outcome.notes == "One road, two lanes.\n\nA parked car ahead."
    assert outcome.reason == ""
    (call,) = made.transcript.calls
    assert (call.number, call.role, call.prompt_version) == (1, "modifier", prompt_version())
    assert call.request.model == "m"
    assert call.reply is not None
    assert call.reply.text == GOOD


def test_an_unreadable_answer_is_asked_for_once_more_with_its_faults() -> None:
    made = Play("otm", [answer(block(agent(x_m="21.4"))), GOOD])
    assert made.outcome.status is OutcomeStatus.DONE
    second = made.client.requests[1].messages
    assert [m.speaker for m in second] == [
        Speaker.SYSTEM,
        Speaker.USER,
        Speaker.ASSISTANT,
        Speaker.USER,
    ]
    assert "add.0.x_m: Input should be a valid number" in second[3].text


def test_a_cut_off_answer_is_asked_for_again_with_twice_the_room() -> None:
    made = Play("otm", [Reply(text=GOOD[:-40], finish_reason="length"), GOOD])
    assert made.outcome.status is OutcomeStatus.DONE
    first, second = made.client.requests
    assert second.max_tokens == 2 * first.max_tokens
    assert "cut off at its length limit" in second.messages[-1].text


@pytest.mark.parametrize(
    ("script", "status"),
    [
        (["I'm sorry, but I can't help with that."] * 2, OutcomeStatus.REFUSED),
        (["<think>Hm.</think>Sorry, this is unsafe.", "I cannot do this."], OutcomeStatus.REFUSED),
        (["[THINK]Hm.[/THINK]Regrettably, I can't.", "Lo siento."], OutcomeStatus.REFUSED),
        (["Thank you, but I'm not comfortable.", "I have to decline."], OutcomeStatus.REFUSED),
        (["I can\u2019t assist with this request.", GOOD], OutcomeStatus.DONE),
        (["I'm sorry, I can't.", "The car stands ahead."], OutcomeStatus.UNREADABLE),
        (["I must place the car ahead of the ego."] * 2, OutcomeStatus.UNREADABLE),
        (["I can't: " + GOOD.replace('"', "'")] * 2, OutcomeStatus.UNREADABLE),
    ],
)
def test_a_refusal_in_prose_that_is_repeated_is_a_refusal(
    script: list[str], status: OutcomeStatus
) -> None:
    made = Play("otm", script)
    assert (made.outcome.status, len(made.client.requests)) == (status, 2)


@pytest.mark.parametrize(
    ("first", "problem"),
    [
        (native("{}"), "no native call is answered"),
        (Reply(text="", reasoning="Let me see."), "there are thoughts and no answer"),
    ],
)
def test_an_answer_beside_the_text_is_told_so(first: Reply, problem: str) -> None:
    made = Play("otm", [first, GOOD])
    assert made.outcome.status is OutcomeStatus.DONE
    assert problem in made.client.requests[1].messages[-1].text


def test_the_transcript_has_the_answer_before_anybody_reads_it() -> None:
    class Stops(MemoryTranscript):
        def answered(self, number: int, reply: Reply, fault: ModelFault | None = None) -> None:
            raise KeyboardInterrupt

    client = ScriptedClient(["nothing that could be read"])
    with pytest.raises(KeyboardInterrupt):
        run(
            OTM,
            EditTask(scene=scene(), instruction="Add a parked car."),
            modifier=RespondentClient(client=client, model="m"),
            transcript=Stops(),
        )
    assert len(client.requests) == 1
