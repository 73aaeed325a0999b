"""Follow-ups: whose conversation goes on with what, when, and what is measured of it."""

import math
from collections.abc import Iterator
from dataclasses import replace
from io import StringIO

import pytest
from django.core.management import CommandError, call_command

from arena.scenarios.queries import step_changes
from augment import tasks
from augment.baselines.rule_placer import place
from augment.errors import Conflict, UnknownName
from augment.fake_llm.server import running
from augment.llm.messages import Message, Speaker, ToolCall, message_from_document
from augment.models import Augmentation, Scenario
from augment.scene.codec import intent_to_document, modification_to_document
from augment.scene.entities import Modification
from augment.scene.intent import Body, Intent, Shape
from augment.services.endpoints.known_endpoints import EndpointRequest, ensure_endpoint
from augment.services.judging.displacement import of_job
from augment.services.running import jobs
from augment.services.running.estimates import estimate
from augment.services.running.follow_ups import (
    FollowUpRequest,
    ask_follow_up,
    read_conversation_until,
    steps_to,
)
from augment.services.running.jobs import JobRequest, JobScope
from augment.services.running.runner import AUGMENTATIONS
from augment.services.scenarios.prompts import find_stored_tasks
from augment.services.scenarios.scenes import (
    LoadedScenario,
    NewScenario,
    add_scenario,
    change_surroundings,
)
from tests.api.asking import error_of
from tests.api.tokens import program_of
from tests.brokers import Broker
from tests.intents import cones, parked
from tests.jobs import rows
from tests.jobs.scripted import Scripted, add
from tests.llm.json_server import serving
from tests.scenes import vehicle
from tests.variants.playing import agent, answer, block, car, rating
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

State = Augmentation.State
WISH, NEXT = "Add a parked car 20 m ahead.", "Four metres further, and make it a bus."


@pytest.fixture
def server() -> Iterator[Scripted]:
    with serving(Scripted()) as made:
        yield made


def two_steps() -> tuple[Scenario, Scenario]:
    """A car and two cones; then the car becomes a bus 4 m further on, and the cones stay."""
    stay = cones(40.0, 2, Shape.LINE).requests
    asked = [
        Intent(requests=(*parked(ahead_m, body=body).requests, *stay))
        for ahead_m, body in ((20.0, Body.CAR), (24.0, Body.BUS))
    ]
    first = rows.add_scenario("street", instruction=WISH, intent=intent_to_document(asked[0]))
    made = [place(LoadedScenario(first).scene, intent).modification for intent in asked]
    Scenario.objects.filter(pk=first.pk).update(reference=modification_to_document(made[0]))
    follow_up = add_scenario(
        NewScenario(
            scene=first.base_scene.slug,
            type=first.type,
            instruction=NEXT,
            reference=modification_to_document(made[1]),
            intent=intent_to_document(asked[1]),
            follows="street",
        )
    )
    return first, follow_up


def launched(*contestants: str) -> list[Augmentation]:
    """The rows of a job on the follow-up alone, each behind the one that it follows."""
    job = jobs.launch(JobRequest(name="J", contestants=contestants, scenarios=["street-then-1"]))
    return list(job.augmentations.order_by("contestant__slug", "scenario__slug"))


def two_waiting(server: Scripted, *script: str, variant: str = "otm") -> list[Augmentation]:
    """Ann's two rows, at a server that says these things in turn."""
    two_steps()
    add(server, "ann", variant)
    server.script = list(script or server.script)
    return launched("ann")


def run(*waiting: Augmentation) -> None:
    for row in waiting:
        assert AUGMENTATIONS.perform(row.pk)
        row.refresh_from_db()


def test_a_job_first_runs_the_contestants_own_answer_and_goes_on_from_it(server: Scripted) -> None:
    two_steps()
    add(server, "ann")
    server.script = [car(20.0), car(24.0, type="BUS")]
    scope = JobScope(contestants=["ann"], scenarios=["street-then-1"])
    assert estimate(scope).rows == 2
    first, second = launched("ann")
    assert (second.follows, second.scenario.wording) == (first, f"1. {WISH}\n2. {NEXT}")
    assert AUGMENTATIONS.take(second.pk) is None  # as long as the first is under way
    assert AUGMENTATIONS.find_unblocked(first.pk) == []
    run(first)
    assert AUGMENTATIONS.find_unblocked(first.pk) == [second.pk]
    run(second)
    assert (first.state, second.state) == (State.DONE, State.DONE)
    one, two = (body["messages"] for body in server.bodies)
    assert two[:2] == one
    assert two[2] == {"role": "assistant", "content": car(20.0)}
    assert f"<instruction>\n> {NEXT}\n</instruction>" in two[3]["content"]
    assert [step.pk for step in steps_to(second)] == [first.pk, second.pk]


def test_who_has_done_the_first_sends_the_follow_up(server: Scripted, broker: Broker) -> None:
    first, second = two_waiting(server)
    tasks.enqueue_job(first.job_id)
    assert len(broker) == 1
    tasks.work.run("augmentation", first.pk)
    second.refresh_from_db()
    assert (len(broker), second.sent_at is None) == (2, False)


def test_it_goes_on_from_the_round_that_counted(server: Scripted) -> None:
    script = [car(10.0), rating(2, 2, 2, "a"), car(20.0), rating(3, 4, 4, "b"), car(30.0)]
    script += [rating(1, 1, 1, "c"), car(24.0), rating(5, 5, 5)]
    first, second = two_waiting(server, *script, variant="tqa")
    run(first, second)
    talk = server.bodies[6]["messages"]
    assert talk[-2]["content"] == car(20.0)
    assert talk[2]["content"] == car(10.0)
    assert len(talk) == 6
    reviewed = server.bodies[7]["messages"][1]["content"]
    assert f"> 1. {WISH}\n> 2. {NEXT}" in reviewed


@pytest.mark.parametrize(
    ("said", "state"), [(answer(block()), State.REFUSED), ("There.", State.UNREADABLE)]
)
def test_whoever_has_no_answer_of_its_own_has_none_to_the_follow_up(
    server: Scripted, said: str, state: str
) -> None:
    first, second = two_waiting(server, said)
    run(first)
    asked = len(server.bodies)
    run(second)
    assert (first.state, second.state, len(server.bodies)) == (state, state, asked)
    assert second.reason.startswith("It would go on from an answer that is none: ")


@pytest.mark.parametrize(
    ("said", "state", "shown_m"),
    [
        (answer(block()).replace('{"Action": "add"', "none ("), State.REFUSED, [20.0]),
        ("There is no lane left of it, so this can't be done.", State.REFUSED, [20.0]),
        (answer(block()).replace('"Action": "add"', '"Action": "remove"'), State.DONE, []),
    ],
)
def test_a_refused_follow_up_keeps_the_last_answer_and_the_next_goes_on(
    server: Scripted, said: str, state: str, shown_m: list[float]
) -> None:
    first, second = two_waiting(server, car(20.0), said, car(22.0))
    run(first, second)
    assert (second.state, bool(second.reason)) == (state, state == State.REFUSED)
    assert [one["x_m"] for one in (second.modification or {})["add"]] == shown_m
    assert (second.image == first.image) == (state == State.REFUSED)
    (measured,) = [one for one in of_job(second.job) if one.row.pk == second.pk]
    assert all(thing.is_kept == bool(shown_m) for thing in measured.kept)
    third = ask_follow_up(second, FollowUpRequest(instruction="Further."))
    run(third)
    assert third.state == State.DONE
    assert server.bodies[2]["messages"][-2]["content"] == said


def test_a_fault_of_the_first_is_one_of_the_second_and_both_run_again(server: Scripted) -> None:
    first, second = two_waiting(server)
    held = AUGMENTATIONS.take(first.pk)
    assert held.settle(rows.failed())
    run(second)
    assert (second.state, second.reason) == (
        State.FAILED,
        "There is no answer to go on from: m OTM on street is failed.",
    )
    jobs.retry_failed(first.job)
    server.script = [car(20.0), car(24.0)]
    run(first, second)
    assert second.state == State.DONE


def test_somebody_says_what_to_change_and_may_go_back_and_say_it_anew(server: Scripted) -> None:
    first, _ = two_waiting(server, car(20.0), car(22.0), car(18.0))
    run(first)
    further = ask_follow_up(first, FollowUpRequest(instruction="Further.", cap_calls=3))
    nearer = ask_follow_up(first, FollowUpRequest(instruction="Nearer."))
    assert further.job.cap_calls == 3
    scenario = further.scenario
    assert (scenario.slug, scenario.follows) == ("street-then-2", first.scenario)
    assert (scenario.retired_at is None, scenario.reference) == (False, None)
    run(further, nearer)
    placed = [(row.modification or {})["add"][0]["x_m"] for row in (first, further, nearer)]
    assert placed == [20.0, 22.0, 18.0]
    last = ask_follow_up(further, FollowUpRequest(instruction="A bus."))
    assert last.scenario.wording == f"1. {WISH}\n2. Further.\n3. A bus."
    assert [step.pk for step in steps_to(last)] == [first.pk, further.pk, last.pk]


def test_only_a_language_models_finished_answer_on_record_can_go_on(server: Scripted) -> None:
    two_steps()
    add(server, "ann")
    rows.add_kind("reference")
    mine, theirs = launched("ann", "reference")[::2]
    request = FollowUpRequest(instruction="Further.")
    with pytest.raises(Conflict, match="m OTM on street is waiting"):
        ask_follow_up(mine, request)
    run(mine, theirs)
    with pytest.raises(Conflict, match="No language model gave this answer"):
        ask_follow_up(theirs, request)
    with pytest.raises(Conflict, match="was deleted"):
        read_conversation_until(None)


def test_a_follow_up_has_the_scene_of_what_it_follows() -> None:
    first, follow_up = two_steps()
    assert LoadedScenario(first).scene == LoadedScenario(follow_up).scene
    with pytest.raises(Conflict, match="It follows “street”"):
        change_surroundings(follow_up, keep_traffic=True, density="", goal="")
    rows.add_scenario("elsewhere")
    new = NewScenario(
        scene=first.base_scene.slug, type=first.type, instruction=NEXT, follows="elsewhere"
    )
    with pytest.raises(UnknownName, match=r"'elsewhere'\. Known: street, street-then-1"):
        add_scenario(new)


@pytest.mark.django_db(transaction=True)
def test_the_stand_in_answers_follow_ups_and_the_careless_one_changes_the_rest() -> None:
    two_steps()
    with running(known=find_stored_tasks) as stand_in:
        request = EndpointRequest(label="fake", base_url=stand_in.url, is_simulated=True)
        endpoint = ensure_endpoint(request)
        for model in ("fake-good", "fake-careless"):
            rows.add_model(model, endpoint=endpoint, model=model)
        careless_first, careless, good_first, good = launched("fake-good", "fake-careless")
        run(careless_first, careless, good_first, good)
    found = {one.row.pk: one for one in of_job(good.job)}
    assert found[good_first.pk].kept == ()
    best = found[good.pk]
    assert best.displacement.error_m == pytest.approx(0.0, abs=0.01)
    assert (best.kept_summary.to_keep, best.kept_summary.kept) == (2, 2)
    worse = found[careless.pk].kept_summary
    assert (worse.to_keep, worse.kept) == (2, 0)


def test_a_message_with_calls_comes_back_as_it_was_written() -> None:
    call = ToolCall(id="c1", name="pose_on_lane", arguments='{"lane": 1', extra='{"seal": "x"}')
    said = (
        Message(speaker=Speaker.ASSISTANT, text="", calls=(call,), extra='{"thoughts": "Hm."}'),
        Message(speaker=Speaker.TOOL, text="{}", answers="c1"),
        Message(speaker=Speaker.USER, text="Go on."),
    )
    assert tuple(message_from_document(one.to_document()) for one in said) == said


def test_page_api_and_command_say_what_comes_next(server: Scripted, broker: Broker) -> None:
    bus = answer(block(agent(type="BUS", y_m=1.0), agent(id="Agent3")))
    first, second = two_waiting(server, car(20.0), bus)
    run(first, second)
    admin = people()["admin"]
    browser, page = signed_in(admin), f"/augmentations/{second.code}/"
    shown = browser.get(page).content.decode()
    assert "Undo: back to step 1" in shown
    for line in ("Agent2: 1.72 m away, a bus", "Agent3 added: vehicle"):
        assert f"<li>{line}</li>" in shown
    asked = browser.post(f"{page}follow-up/", {"instruction": "Further.", "cap_calls": "2"})
    made = Augmentation.objects.latest("pk")
    assert asked.headers["Location"] == f"/augmentations/{made.code}/"
    assert (made.follows, made.job.cap_calls, made.job.launched_by) == (second, 2, admin)
    assert "js/live.js" in browser.get(asked.headers["Location"]).content.decode()

    wire = program_of(admin)
    address = f"/api/v1/augmentations/{second.code}"
    said = wire.post(f"{address}/follow-ups", {"instruction": "Nearer."}, "application/json")
    assert said.status_code == 201
    told = said.json()
    assert (told["state"], told["follows"], told["warnings"]) == ("queued", str(second.code), [])
    assert told["instruction"] == f"1. {WISH}\n2. {NEXT}\n3. Nearer."
    assert wire.get(address).json()["modification"]["add"][0]["type"] == "BUS"
    waiting = f"/api/v1/augmentations/{told['code']}/follow-ups"
    error_of(wire.post(waiting, {"instruction": "A bus."}, "application/json"), 409, "conflict")

    out = StringIO()
    call_command("follow_up", str(second.code), "Another one.", "--cap-tokens", "9000", stdout=out)
    last = Augmentation.objects.latest("pk")
    assert out.getvalue() == f"Augmentation {last.code} of {last.scenario.slug} waits.\n"
    assert (last.follows, last.job.cap_tokens) == (second, 9000)
    with pytest.raises(CommandError, match="No augmentation has the code 'x'"):
        call_command("follow_up", "x", "Another one.")


def test_a_step_tells_what_it_changed() -> None:
    car_of_step = modification_to_document(
        Modification(added=(replace(vehicle("Agent2", 20.0, 0.0), heading_rad=math.pi - 0.1),))
    )
    before = {**car_of_step, "remove": ["Agent7"]}
    for changes, told in (
        ({"x_m": 24.0, "y_m": 3.0}, ["Agent2: 5.00 m away"]),
        (
            {"heading_rad": -math.pi + 0.1, "speed_mps": 2.0},
            ["Agent2: turned by 11.5°, another speed"],
        ),
        ({"type": "BUS", "lane_id": "Lane2"}, ["Agent2: a bus"]),
        ({}, []),
    ):
        after = {"add": [{**car_of_step["add"][0], **changes}], "remove": ["Agent7"]}
        assert step_changes(before, after) == told
        assert step_changes(before, {"add": before["add"]}) == ["Agent7 no longer removed"]


@pytest.mark.django_db(transaction=True)
def test_a_task_is_found_by_the_text_of_its_instruction_however_it_is_spaced() -> None:
    assert find_stored_tasks(rows.INSTRUCTION) == []
    row = rows.add_scenario("street")
    spaced = f"  {rows.INSTRUCTION.replace(' ', '  ')}\n"
    assert find_stored_tasks(spaced) == [(LoadedScenario(row).scene, cones(20.0, 1, Shape.LINE))]
    assert find_stored_tasks("Paint the sky green.") == []
