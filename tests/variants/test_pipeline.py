import pytest

from augment.errors import ModelFault
from augment.llm.messages import Reply
from augment.prompts.fill import prompt_version
from augment.variants.pipeline import EditTask, OutcomeStatus
from augment.variants.recipes import OTM
from augment.variants.respondents import RespondentClient
from augment.variants.reviews import BlockForm
from tests.llm.scripted import ScriptedClient
from tests.scenes import scene
from tests.variants.playing import (
    GOOD,
    MemoryTranscript,
    Play,
    agent,
    answer,
    block,
    call,
    native,
    play,
)


def test_one_good_answer_is_one_call_and_a_modification() -> None:
    made = Play("otm", [GOOD])
    outcome = made.outcome
    assert outcome.status is OutcomeStatus.DONE
    assert [a.id for a in outcome.modification.added] == ["Agent2"]
    assert outcome.notes == "One road, two lanes.\n\nA parked car ahead."
    assert outcome.reason == ""
    (call,) = made.transcript.calls
    assert (call.number, call.role, call.prompt_version) == (1, "modifier", prompt_version())
    assert call.request.model == "m"
    assert call.reply.text == GOOD


def test_an_unreadable_answer_is_asked_for_once_more_with_its_faults() -> None:
    made = Play("otm", [answer(block(agent(x_m="21.4"))), GOOD])
    assert made.outcome.status is OutcomeStatus.DONE
    second = made.client.requests[1].messages
    assert [m.speaker for m in second] == ["system", "user", "assistant", "user"]
    assert "add.0.x_m: Input should be a valid number" in second[3].text


def test_a_cut_off_answer_is_asked_for_again_with_twice_the_room() -> None:
    made = Play("otm", [Reply(text=GOOD[:-40], finish_reason="length"), GOOD])
    assert made.outcome.status is OutcomeStatus.DONE
    first, second = made.client.requests
    assert second.max_tokens == 2 * first.max_tokens
    assert "cut off at its length limit" in second.messages[-1].text


@pytest.mark.parametrize(
    "said",
    [
        "I'm sorry, but I can't help with that.",
        "<think>Hm.</think>Sorry, this is unsafe.",
        "[THINK]Hm.[/THINK]Regrettably, I can't.",
        "Thank you, but I'm not comfortable.",
        "Insights: There is no bus stop.\n\nSummary: none\n\nModified Vectors: none",
        "**Modified Vectors:**\n```json\n{}\n```",
        "There is no crosswalk in this scene, so the car can't be placed before it.",
        "Looking at the lanes, this wish cannot be met: no lane comes the other way.",
        "Es gibt keinen Zebrastreifen; der Wunsch kann nicht erfüllt werden.",
        "Il n'y a pas de bus : cette demande ne peut pas être satisfaite.",
        "No hay ningún autobús, así que no es posible.",
        "场景中没有公交车，所以无法完成。",
        "Unfortunately no bus exists in this scene. No changes are made.",
        "The scene contains no bus; therefore nothing can be moved.",
        "Not possible: there is no second cyclist.",
        "There is no bus in the scene. I therefore make no changes.",
        "The user's wish is unsatisfiable: no lane comes the other way.",
        "Summary: cannot be done.\n\nModification Dict: {}\n",
        "The requested placement is impossible in this scene.",
        "That's not something I can help with.",
        "Leider kann ich dabei nicht helfen.",
        "Malheureusement, je ne suis pas en mesure de le faire.",
        "К сожалению, я не могу выполнить этот запрос.",
        "Niestety nie mogę pomóc.",
        "Helaas kan ik dat niet.",
        "Maaf, saya tidak dapat membantu.",
        "Thank you for your request. Sadly, I cannot make this change.",
        "The wish names a red van, but no such vehicle is in the scene. Refused.",
        "There is no tram in this scene, so I have left everything as it was.",
        "I haven't changed anything: the wish asks for a lane that doesn't exist.",
        "This wish is unachievable: there is no oncoming lane.",
        "Abgelehnt: es gibt keine linke Nachbarspur.",
        "If I placed it at 25 m it would be past the bus, so the wish can't be met.",
        "I have added nothing: Agent3 is at (14, 0), so the wish can't be met.",
        "I can't place it there: Agent3 is too near, so the gap is 3 m too short.",
        "I cannot do this. I used the map and there is no such lane.",
        "This can't be done: our lane is narrow, so the lane is 3.5 m wide and leaves no room.",
        "Debo rechazar esta petición: la escena no tiene cruce.",
        "It's not possible to place a bus on the left lane because there is none.",
        "The scene offers no room for five cars; nothing has been modified.",
        "Given the constraints, no valid placement exists, so I return no changes.",
        "I have to turn this down because there is no parked vehicle.",
        "There is nothing I can change here because that cyclist doesn't exist.",
        "Il n'y a pas de tramway ; je ne change donc rien.",
        "场景中没有这辆车，因此不作任何修改。",
        "横断歩道が存在しないので、変更しません。",
        "<|START_THINKING|>" + GOOD + "<|END_THINKING|>I can't do that.",
        "<|channel>thought\n" + GOOD + "<channel|>I can't do that.",
    ],
)
def test_a_refusal_in_prose_is_a_refusal_that_nobody_asks_for_again(said: str) -> None:
    made = Play("otm", [said])
    assert (made.outcome.status, len(made.client.requests)) == (OutcomeStatus.REFUSED, 1)
    assert made.outcome.reason


@pytest.mark.parametrize(
    "said",
    [
        "I must place the car ahead of the ego.",
        "The car should stand some way ahead of the ego, a little aside.",
        "I can't: " + GOOD.replace('"', "'"),
        "The place at 20 m is taken, so the car can stand at 24 m instead.",
        "There is no traffic behind, so the car stands 20 m ahead.",
        "There is no crosswalk, so pedestrians can't cross there; the car stands 20 m ahead.",
        "",
        "I can't wait to see it! A car stands 20 m ahead.",
        "I'm sorry for the earlier mistake. The car stands 20 m ahead.",
        "It is not possible to overtake here: the car stands 20 m ahead.",
        "No changes to existing agents; a car 20 m ahead.",
        "La voiture ne peut pas être dépassée, à 20 m.",
        "El coche no puede ser adelantado y está a 20 m.",
        "无法超车，因此车辆放在20米处。",
        "None of the lanes bends, so the car is at (20, 0).",
        "The truck blocks the lane, so overtaking is impossible. The car is at (20, 0).",
        "No changes in speed are needed. The car is at (20, 0).",
        "Nothing can be placed between the cars, so he starts behind them.",
        "It is not possible to pass on the left. The car is in the middle.",
        "I refuse to let the car stand on the line, so it's 0.3 m left.",
        "I did not change anything else. The car is 20 m ahead.",
        "I can't place it at 20 m because Agent3 is there, so I placed it at 25 m.",
        "Nothing can be placed at 20 m, so the van stands at 25 m.",
        "Es ist nicht möglich, das Auto bei 20 m abzustellen; es steht bei 25 m.",
        "La voiture est placée à 20 m ; l'ego ne peut pas la dépasser.",
        "車両を前方20メートルに配置しました。追い越しは不可能です。",
    ],
)
def test_prose_that_does_not_decline_is_unreadable(said: str) -> None:
    made = Play("otm", [said] * 2)
    assert (made.outcome.status, len(made.client.requests)) == (OutcomeStatus.UNREADABLE, 2)


def test_a_draft_in_thoughts_that_were_cut_off_is_no_answer() -> None:
    made = Play("otm", [Reply(text=f"<think>Maybe {GOOD}\nor", finish_reason="length"), GOOD])
    assert made.outcome.status is OutcomeStatus.DONE
    assert "cut off at its length limit" in made.client.requests[1].messages[-1].text


def test_an_answer_beside_the_text_is_told_so() -> None:
    for first, problem in (
        (native("{}"), "no native call is answered"),
        (Reply(text="", reasoning="Let me see."), "there are thoughts and no answer"),
    ):
        made = Play("otm", [first, GOOD])
        assert made.outcome.status is OutcomeStatus.DONE
        assert problem in made.client.requests[1].messages[-1].text


def test_the_transcript_has_the_answer_before_anybody_reads_it() -> None:
    class Stops(MemoryTranscript):
        def record_reply(self, number: int, reply: Reply, fault: ModelFault | None = None) -> None:
            raise KeyboardInterrupt

    client = ScriptedClient(["nothing that could be read"])
    task = EditTask(scene=scene(), instruction="Add a parked car.")
    with pytest.raises(KeyboardInterrupt):
        play(OTM, task, RespondentClient(client=client, model="m"), Stops())
    assert len(client.requests) == 1


def test_a_block_by_schema_is_one_more_call_after_the_sections() -> None:
    sections = GOOD.partition("Modified Vectors")[0]
    by_schema = block(*(agent(id=..., x_m=x_m, motion=None) for x_m in (20.0, 30.0)))
    made = Play("otm", [sections, by_schema], block=BlockForm.SCHEMA)
    first, second = made.client.requests
    assert (first.schema, second.messages[2].text) == (None, sections)
    assert second.to_document()["response_format"] == {
        "type": "json_schema",
        "json_schema": {"name": "block", "strict": True, "schema": second.schema},
    }
    assert [one.id for one in made.outcome.modification.added] == ["Agent2", "Agent3"]
    assert made.outcome.notes.startswith("One road, two lanes.")
    left = Play("otm", [sections, '{"unchanged": "There is no bus."}'], block=BlockForm.SCHEMA)
    assert (left.outcome.status, left.outcome.reason) == (
        OutcomeStatus.REFUSED,
        "There is no bus.",
    )
    refused = Play("otm", ["I can't do that."], block=BlockForm.SCHEMA)
    assert (refused.outcome.status, refused.roles) == (OutcomeStatus.REFUSED, "m")
    ignored = Play("fc", [call(), GOOD, "Here it is."], block=BlockForm.SCHEMA)
    assert (ignored.outcome.status, ignored.x_m) == (OutcomeStatus.DONE, 21.4)
