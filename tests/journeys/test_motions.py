"""Eight motions by name, from the sentence to a ballot that moves, a drive and OpenSCENARIO."""

from collections.abc import Iterator
from xml.etree import ElementTree as ET

import pytest

from arena.voting.queries.showings import as_shown
from augment.fake_llm.server import FakeServer, running
from augment.models import Contestant, GenerationJob, Scenario, Simulation
from augment.scene.codec import modification_from_document
from augment.scene.planned_motion import MotionPreset
from augment.services.driving.simulations import Drives, Options, plan_job
from augment.services.endpoints.contestants import (
    REFERENCE,
    ContestantRequest,
    add_contestant,
    ensure_builtin,
)
from augment.services.endpoints.known_endpoints import EndpointRequest, ensure_endpoint
from augment.services.judging.scenario_export import export_job
from augment.services.running.jobs import JobRequest, launch
from augment.services.running.runner import AUGMENTATIONS
from augment.services.scenarios.catalogue import load_catalogue
from augment.services.scenarios.pictures import film_document
from augment.services.scenarios.prompts import find_stored_tasks
from tests import study_rows
from tests.opening import open_study

pytestmark = [pytest.mark.django_db(transaction=True), pytest.mark.slow, pytest.mark.timeout(600)]

CONDITIONS = {"RelativeDistanceCondition", "DistanceCondition", "SimulationTimeCondition"}


@pytest.fixture
def server() -> Iterator[FakeServer]:
    with running(known=find_stored_tasks) as serving:
        yield serving


def ran_job(server: FakeServer) -> GenerationJob:
    """The reference and a stand-in on the first scenario of each of the eight kinds."""
    load_catalogue(sets=("paper", "hard", "moving"))
    ensure_builtin()
    ensure_endpoint(EndpointRequest(label="e", base_url=server.url, is_simulated=True))
    add_contestant(ContestantRequest(slug="ann", variant="otm", endpoint="e", model="fake-good"))
    moving = Scenario.objects.filter(catalogue_set="moving", paraphrase_of=None)
    chosen = {kind: moving.filter(type=kind).order_by("slug")[0].slug for kind in MotionPreset}
    asked = JobRequest(
        name="J", contestants=(REFERENCE, "ann"), scenarios=tuple(sorted(chosen.values()))
    )
    job = launch(asked)
    for pk in job.augmentations.values_list("pk", flat=True):
        assert AUGMENTATIONS.perform(pk)
    return job


def test_each_motion_is_answered_filmed_shown_driven_and_written(server: FakeServer) -> None:
    job = ran_job(server)
    answers = job.augmentations.filter(contestant__slug="ann", state="done")
    assert {answer.scenario.type for answer in answers} == {*MotionPreset}
    for answer in answers:
        changed = modification_from_document(answer.modification).changed
        assert any(agent.motion for agent in changed)
        film = film_document(answer.image)
        assert film is not None
        assert any(len(values) > 3 for _, _, _, values in film["movers"])

    study = open_study(
        name="S",
        contestants=[REFERENCE, "ann"],
        scenarios=list(job.scenarios.values_list("slug", flat=True)),
        experts=[study_rows.expert("eva").username],
        votes_per_expert=5,  # of three the stand-in draws what the reference does
        seed=1,
        allow_simulated=True,
    )
    shown = [as_shown(matchup) for matchup in study.matchups.all()]
    assert len(shown) == 5
    assert all(one["is_filmed"] for one in shown)

    drives = plan_job(
        job=job, options=Options(planner="pdm-closed", offsets="paper", is_reactive=False)
    )
    driven = Simulation.objects.filter(pk__in=drives, augmentation__contestant__slug="ann")
    assert driven.count() == 8
    for drive in driven:
        assert Drives().perform(drive.pk)
        drive.refresh_from_db()
        document = drive.document or {}
        assert (drive.state, document["collisions"]) == ("done", []), drive.scenario.slug

    written = export_job(job, file_format="openscenario", contestant="ann")
    scenarios = [body for name, body in written.written.files.items() if name.endswith(".xosc")]
    assert len(scenarios) == 8
    for body in scenarios:
        events = ET.fromstring(body).iter("Event")
        starts = [event for event in events if "sets out" in event.get("name", "")]
        assert starts
        parts = {part.tag for event in starts for part in event.iter()}
        assert parts & CONDITIONS
        assert "FollowTrajectoryAction" in parts
    assert Contestant.objects.get(slug="ann").is_simulated
