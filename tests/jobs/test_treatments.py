"""What a contestant sends is fixed when it first runs."""

from __future__ import annotations

import pytest

from augment.models import Augmentation, EndpointModel
from augment.services.endpoints import contestants
from augment.services.endpoints.known_endpoints import ensure_endpoint
from augment.services.running import jobs, runner
from tests.jobs.rows import add_scenario
from tests.jobs.scripted import Scripted
from tests.llm.json_server import serving

pytestmark = pytest.mark.django_db


def job_at(server: Scripted, variant: str = "fc") -> None:
    ensure_endpoint(label="here", base_url=server.url)
    contestants.add_contestant(slug="one", variant=variant, endpoint="here", model="m")
    add_scenario("first")
    add_scenario("second")
    jobs.launch(name="J", contestants=["one"], scenarios=["first", "second"], is_fresh=True)


def run(scenario: str) -> Augmentation:
    row = Augmentation.objects.get(scenario__slug=scenario)
    runner.work_on(augmentation_pk=row.pk)
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
        {"vision": False, "json_schema": False, "temperature": False},
    ],
    ids=lambda later: "+".join(later),
)
def test_what_is_learnt_after_the_first_run_changes_nothing_that_is_sent(
    later: dict[str, object],
) -> None:
    with serving(Scripted("Sorry?")) as server:
        job_at(server)
        run("first")
        before = shapes(server)
        learn(**later)
        server.bodies.clear()
        run("second")
        assert shapes(server) == before
        # Another contestant of the same model sends what is known now.
        contestants.add_contestant(slug="two", variant="fc", endpoint="here", model="m", name="2")
        jobs.launch(name="K", contestants=["two"], scenarios=["first"], is_fresh=True)
        server.bodies.clear()
        runner.work_on(augmentation_pk=Augmentation.objects.get(contestant__slug="two").pk)
        is_sent = not later.keys() <= {"vision", "json_schema", "temperature"}
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
        run("first")
        server.refuses = set()
        learn(refused_parameters=[])
        run("second")
        assert shapes(server) == {("max_tokens=8192", "model=m")}


def test_a_parameter_that_is_refused_after_answers_with_it_is_a_fault_and_no_mixture() -> None:
    with serving(Scripted("Sorry?")) as server:
        job_at(server)
        learn(reasoning_effort="low")
        run("first")
        server.bodies.clear()
        server.refuses = {"reasoning_effort"}
        row = run("second")
        assert server.bodies == []
    assert row.state == Augmentation.State.FAILED
    assert "does not take 'reasoning_effort' any more" in row.reason
    assert "add another contestant" in row.reason
