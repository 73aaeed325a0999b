"""Every option of a contestant: what it says is what is on the wire, and what is not is said."""

import base64
import json
import struct
from collections.abc import Callable

import pytest
from django.core.management import CommandError, call_command

from augment.errors import Conflict, InvalidDocument
from augment.models import Augmentation, Contestant, EndpointModel, GenerationJob, ModelCall
from augment.prompts.fill import prompt_version
from augment.services.endpoints import contestants
from augment.services.endpoints.contestants import ContestantRequest, read_options
from augment.services.endpoints.known_endpoints import EndpointRequest, ensure_endpoint
from augment.services.running import jobs, runner
from augment.services.running.choosing import find_obstacle
from augment.services.running.jobs import JobRequest
from augment.services.running.transcript_records import full_transcript
from augment.variants.options import NAMES, options_from_document
from tests.jobs.rows import add_scenario
from tests.jobs.scripted import Bodies, Scripted, add, run
from tests.llm.json_server import serving

pytestmark = pytest.mark.django_db


def every(name: str, value: object) -> Callable[[Bodies], bool]:
    return lambda bodies: {body.get(name) for body in bodies} == {value}


def png_widths(bodies: Bodies) -> list[int]:
    """Widths in pixels of the pictures that the viewer was sent, from their PNG headers."""
    urls = [
        part["image_url"]["url"]
        for part in bodies[2]["messages"][-1]["content"]
        if part["type"] == "image_url"
    ]
    headers = [base64.b64decode(url.partition(",")[2])[16:20] for url in urls]
    return [struct.unpack(">I", header)[0] for header in headers]


def sends(calls: int) -> Callable[[Bodies], bool]:
    return lambda bodies: len(bodies) == calls


def are_wide(*px: int) -> Callable[[Bodies], bool]:
    return lambda bodies: png_widths(bodies) == [*px]


def have_form(*each: bool) -> Callable[[Bodies], bool]:
    return lambda bodies: ["response_format" in body for body in bodies] == [*each]


def shows_far(is_shown: bool) -> Callable[[Bodies], bool]:
    return lambda bodies: ("[60,0]" in json.dumps(bodies[0]["messages"])) is is_shown


def has_tools(are_there: bool) -> Callable[[Bodies], bool]:
    return lambda bodies: ("tools" in bodies[0]) is are_there


EFFORT, MOST = "reasoning_effort", "max_completion_tokens"
TABLE: list[tuple[str, str, object, Callable[[Bodies], bool], Callable[[Bodies], bool]]] = [
    ("temperature", "tqa", 0.7, every("temperature", 0.7), every("temperature", None)),
    ("seed", "tqa", 41, every("seed", 41), every("seed", None)),
    (EFFORT, "tqa", "low", every(EFFORT, "low"), every(EFFORT, None)),
    ("max_output_tokens", "tqa", 500, every(MOST, 500), every(MOST, 8192)),
    ("protocol", "fc", "native", has_tools(True), has_tools(False)),
    ("rounds", "tqa", 2, sends(4), sends(6)),
    ("accepted_from", "tqa", 3.0, sends(2), sends(6)),
    ("radius_m", "otm", 30.0, shows_far(False), shows_far(True)),
    ("prompt_version", "otm", prompt_version(), sends(1), sends(1)),
    # Too small in the first picture, what was changed is enlarged in another.
    ("picture_px", "vqa", 600, are_wide(600, 600), are_wide(1200)),
    ("block", "otm", "schema", have_form(False, True), have_form(False)),
]


def test_the_table_has_every_option() -> None:
    assert tuple(row[0] for row in TABLE) == NAMES


@pytest.mark.parametrize(("name", "variant", "value", "as_told", "by_default"), TABLE)
def test_what_is_sent_is_what_the_option_says(
    name: str,
    variant: str,
    value: object,
    as_told: Callable[[Bodies], bool],
    by_default: Callable[[Bodies], bool],
) -> None:
    with serving(Scripted()) as server:
        add(server, "told", variant, **{name: value})
        add(server, "usual", variant)
        told, usual = run("told", "usual")
        sent = len(ModelCall.objects.filter(attempt__augmentation=told))
        assert as_told(server.bodies[:sent])
        # The default set is another one: nothing of it is answered from what this one got.
        assert by_default(server.bodies[sent:]) or name == "prompt_version"
    assert told.options[name] == value
    assert full_transcript(told)["contestant"]["frozen_options"] == told.options
    assert full_transcript(told)["contestant"]["options"] == {name: value}
    assert (told.options == usual.options) is (name in ("prompt_version",))


def test_samples_are_asked_anew_with_seeds_of_their_own() -> None:
    with serving(Scripted()) as server:
        add(server, "a", seed=7, temperature=1.0)
        rows = run("a", samples=3)
        assert [body["seed"] for body in server.bodies] == [7, 8, 9]
        assert [row.sample for row in rows] == [1, 2, 3]
        # In another job each sample is served from its own answer.
        again = run("a", samples=3)
        assert len(server.bodies) == 3
    sources = [ModelCall.objects.get(attempt__augmentation=row).served_from for row in again]
    assert [one.attempt.augmentation for one in sources if one and one.attempt] == rows
    sent = [full_transcript(row)["attempts"][0]["steps"][0]["request"] for row in rows]
    assert [(call["temperature"], call["seed"]) for call in sent] == [(1.0, 7), (1.0, 8), (1.0, 9)]


def test_the_command_takes_every_option(capsys: pytest.CaptureFixture[str]) -> None:
    with serving(Scripted()) as server:
        asked = ["--variant=fc+tqa", "--endpoint=here", "--model=m", f"--base-url={server.url}"]
        options = [
            *("--temperature=0.7", "--seed=5", "--reasoning-effort=low", "--max-output=900"),
            *("--protocol=native", "--rounds=2", "--accepted-from=4.5", "--radius=60"),
        ]
        call_command("add_contestant", "a", *asked, *options)
        assert "m FC+tQA (temperature 0.7, seed 5, effort low" in capsys.readouterr().out
        made = Contestant.objects.get(slug="a")
        assert made.options == {
            **{"temperature": 0.7, "seed": 5, "reasoning_effort": "low", "rounds": 2},
            **{"max_output_tokens": 900, "protocol": "native", "accepted_from": 4.5},
            "radius_m": 60.0,
        }
        assert read_options(made).prompt_version == prompt_version()
        with pytest.raises(CommandError, match="another contestant called 'a'"):
            call_command("add_contestant", "a", *asked, "--temperature=0.8")
        with pytest.raises(CommandError, match=r"temperature.*from 0 to 2"):
            call_command("add_contestant", "c", *asked, "--temperature=2.1")
        alone = ["--variant=otm", *asked[1:], "--rounds=2"]
        with pytest.raises(CommandError, match="otm has no review, so it has one round"):
            call_command("add_contestant", "c", *alone)


@pytest.mark.parametrize(
    ("name", "good", "bad"),
    [
        ("temperature", [0, 2.0], [-0.01, 2.01, float("nan"), "1", True]),
        ("seed", [0, 2**31 - 1 - 100], [-1, 2**31 - 100, 1.5]),
        ("reasoning_effort", ["none", "max"], ["", "much", 3]),
        ("max_output_tokens", [1, 1_000_000], [0, 1_000_001]),
        ("protocol", ["prompt", "native"], ["both", 1]),
        ("rounds", [1, 10], [0, 11]),
        ("accepted_from", [1, 5], [0.9, 5.1]),
        ("radius_m", [20, 300.0], [19.9, 300.1]),
        ("prompt_version", ["0123456789ab"], ["0123456789a", "0123456789ag"]),
        ("picture_px", [300, 2400], [299, 2401]),
    ],
)
def test_an_option_out_of_range_is_refused_with_its_name(
    name: str, good: list[object], bad: list[object]
) -> None:
    for value in good:
        assert options_from_document({name: value}).to_document() == {name: value}
    for value in bad:
        with pytest.raises(InvalidDocument) as refused:
            options_from_document({name: value})
        assert refused.value.problems[0][0] == name
    with pytest.raises(InvalidDocument, match="is no option"):
        options_from_document({f"{name}s": good[0]})


def test_who_ran_with_other_prompts_is_not_run_with_these() -> None:
    with serving(Scripted()) as server:
        add(server, "a")
        run("a")
        Contestant.objects.update(frozen_options={"prompt_version": "0" * 12})
        assert "version 000000000000" in find_obstacle(Contestant.objects.get(slug="a"))
        with pytest.raises(Conflict, match="Add another contestant like it"):
            run("a")
        row = Augmentation.objects.create(
            job=GenerationJob.objects.get(),
            scenario=Augmentation.objects.get().scenario,
            contestant=Contestant.objects.get(),
            sample=2,
        )
        runner.AUGMENTATIONS.perform(row.pk)
        row.refresh_from_db()
        assert (row.state, len(server.bodies)) == (Augmentation.State.FAILED, 1)
        add(server, "b", seed=1)
        run("b")


def job_at(server: Scripted, variant: str = "fc") -> None:
    ensure_endpoint(EndpointRequest(label="here", base_url=server.url))
    contestants.add_contestant(
        ContestantRequest(slug="one", variant=variant, endpoint="here", model="m")
    )
    add_scenario("first")
    add_scenario("second")
    jobs.launch(
        JobRequest(name="J", contestants=["one"], scenarios=["first", "second"], is_fresh=True)
    )


def run_on(scenario: str) -> Augmentation:
    row = Augmentation.objects.get(scenario__slug=scenario)
    runner.AUGMENTATIONS.perform(row.pk)
    row.refresh_from_db()
    return row


def learn(**known: object) -> None:
    EndpointModel.objects.filter(model="m").update(**known)


def shapes(server: Scripted) -> set[tuple[str, ...]]:
    """The names of all that was sent, and what stood beside the messages."""
    return {
        tuple(f"{name}={body[name]}" for name in sorted(body) if name != "messages")
        for body in server.bodies
    }


@pytest.mark.parametrize(
    "later",
    [
        {"native_tools": True},
        {"refused_parameters": ["max_completion_tokens"]},
        {"refused_parameters": ["reasoning_effort"], "reasoning_effort": "low"},
        {"reasoning_effort": "low"},
        {"max_output_tokens": 64},
        {"vision": False, "temperature": False},
    ],
    ids=lambda later: "+".join(later),
)
def test_what_is_learnt_after_the_first_run_changes_nothing_sent(later: dict[str, object]) -> None:
    with serving(Scripted("Sorry?")) as server:
        job_at(server)
        run_on("first")
        before = shapes(server)
        learn(**later)
        server.bodies.clear()
        run_on("second")
        assert shapes(server) == before
        # Another contestant of the same model sends what is known now.
        contestants.add_contestant(
            ContestantRequest(slug="two", variant="fc", endpoint="here", model="m", name="2")
        )
        jobs.launch(JobRequest(name="K", contestants=["two"], scenarios=["first"], is_fresh=True))
        server.bodies.clear()
        runner.AUGMENTATIONS.perform(Augmentation.objects.get(contestant__slug="two").pk)
        is_sent = not later.keys() <= {"vision", "temperature"}
        is_sent = is_sent and later != {
            "refused_parameters": ["reasoning_effort"],
            "reasoning_effort": "low",
        }
        assert (shapes(server) != before) is is_sent


def test_a_parameter_that_is_refused_before_any_answer_is_left_out_for_good() -> None:
    with serving(Scripted("Sorry?")) as server:
        server.refuses = {"reasoning_effort", "max_completion_tokens"}
        job_at(server)
        learn(reasoning_effort="low")
        run_on("first")
        server.refuses = set()
        learn(refused_parameters=[])
        run_on("second")
        assert shapes(server) == {("max_tokens=8192", "model=m")}


def test_a_parameter_that_is_refused_after_answers_with_it_is_a_fault_and_no_mixture() -> None:
    with serving(Scripted("Sorry?")) as server:
        job_at(server)
        learn(reasoning_effort="low")
        run_on("first")
        server.bodies.clear()
        server.refuses = {"reasoning_effort"}
        row = run_on("second")
        assert server.bodies == []
    assert row.state == Augmentation.State.FAILED
    assert "does not take 'reasoning_effort' any more" in row.reason
    assert "add another contestant" in row.reason
