"""Drives as rows: planned once, leased once, kept with scores, told apart from failures."""

import json
import sys
from dataclasses import asdict
from datetime import timedelta
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from django.core.management import call_command
from django.core.management.base import CommandError
from pytest_django import Settings

from arena.jobs.exports.tables import augmentation_sheet
from augment.errors import UnknownName
from augment.models import GenerationJob, Scenario, Simulation
from augment.scene.codec import intent_to_document, modification_to_document
from augment.scene.entities import Modification
from augment.scene.intent import Intent, IntentOrigin, Purpose
from augment.scene.intent_parts import Amount
from augment.services.driving import driving_scores, simulations
from augment.services.driving.simulations import DRIVES, Options
from augment.services.judging.displacement import MissingReason, of_rows
from augment.services.judging.findings import FindingKind, check_augmentation, read_findings
from augment.simulation.planning import Plan, Situation
from augment.simulation.road import Road
from augment.simulation.states import EgoBody
from tests.jobs import rows

pytestmark = pytest.mark.django_db

State, Subject = Simulation.State, Simulation.Subject
STRAIGHT = Options(planner="tests.jobs.test_simulations.Straight")
BROKEN = Options(planner="tests.jobs.test_simulations.Broken")


@pytest.fixture(autouse=True)
def allowed(settings: Settings) -> None:
    settings.PLANNERS = (STRAIGHT.planner, BROKEN.planner)


class Straight:
    """Keeps speed and heading: quick to drive, and right through every cone."""

    def start(self, road: Road, body: EgoBody) -> None:
        """Nothing to prepare."""

    def plan(self, situation: Situation) -> Plan:
        x, y, heading, speed = situation.ego[:4]
        way = speed * 0.1 * np.arange(20)
        cos, sin = np.cos(heading), np.sin(heading)
        return Plan(poses=np.stack([x + way * cos, y + way * sin, np.full(20, heading)], axis=1))


class Broken(Straight):
    """Falls over in its first step."""

    def plan(self, situation: Situation) -> Plan:
        raise RuntimeError("no idea")


def finished_job(scenarios: int = 1) -> GenerationJob:
    job = rows.launch(scenarios=scenarios)
    settle_all(job)
    return job


def settle_all(job: GenerationJob) -> None:
    for row in job.augmentations.all():
        rows.leased(row).settle(rows.done(), now=rows.NOON)


def driven(job: GenerationJob, options: Options = STRAIGHT) -> GenerationJob:
    for pk in simulations.plan_job(job=job, options=options):
        assert DRIVES.perform(pk)
    return job


def test_a_job_has_its_scenes_references_and_results_driven() -> None:
    job = finished_job(scenarios=2)
    waiting = simulations.plan_job(job=job, options=STRAIGHT)
    assert len(waiting) == 6
    assert Simulation.objects.filter(subject=Subject.AUGMENTATION).count() == 2
    assert simulations.plan_job(job=job, options=STRAIGHT) == waiting, "nothing is planned twice"


def test_a_drive_keeps_both_scores_their_parts_and_the_way() -> None:
    job = driven(finished_job())
    before = Simulation.objects.get(subject=Subject.UNMODIFIED)
    after = Simulation.objects.get(subject=Subject.AUGMENTATION)
    assert before.nuplan_score == pytest.approx(1.0, abs=0.01)
    # Two cones are run over: two collisions with things leave nothing.
    assert after.nuplan_score == 0.0
    assert after.document is not None
    assert [one["object"] for one in after.document["collisions"]] == ["Agent2", "Agent3"]
    assert after.document["criticality"]["least_distance_m"] == 0.0
    names = {metric["name"] for metric in after.document["metrics"]["nuplan"]}
    assert "no_ego_at_fault_collisions" in names
    trace = json.loads(simulations.drive_file(after))
    assert len(trace["ego"]["poses"]) == trace["steps"]
    assert [one["changed"] for one in trace["objects"]] == [True, True]
    assert {event["kind"] for event in trace["events"]} >= {"collision"}
    assert job.augmentations.count() == 1


def test_an_open_wish_about_driving_is_held_against_the_drives() -> None:
    job = finished_job()
    purpose = Purpose(braking_mps2=Amount(low=3.0, high=8.0))
    intent = intent_to_document(Intent(purpose=purpose))
    Scenario.objects.update(intent=intent, intent_origin=IntentOrigin.ENTERED)
    row = job.augmentations.select_related("scenario__base_scene").get()
    assert not any(one.kind is FindingKind.PURPOSE for one in read_findings([row.pk])[row.pk])
    drive = {"required_braking_mps2": 9.5, "least_ttc_s": 1.0, "least_distance_m": 2.0}
    Simulation.objects.create(
        scenario=row.scenario,
        augmentation=row,
        subject=Subject.AUGMENTATION,
        **asdict(Options(planner="idm")),
        state=State.DONE,
        nuplan_score=1.0,
        interplan_score=1.0,
        document={"criticality": drive, "collisions": []},
        trace=b"{}",
        finished_at=rows.NOON,
    )
    checked = check_augmentation(row)
    assert checked is not None
    for findings in (read_findings([row.pk])[row.pk], checked.findings):
        words = [one.sentence() for one in findings if one.kind is FindingKind.PURPOSE]
        assert words == [
            "The hardest braking required of idm is 9.50 m/s²; 3 to 8 m/s² is asked for."
        ]
    assert of_rows([row.pk])[0].why_not is MissingReason.OPEN_WISH
    sheet = augmentation_sheet(job)
    assert list(sheet.columns)[-2:] == ["purpose_served", "purpose_measured"]
    assert [row[-2:] for row in sheet.rows] == [(False, words[0])]


def test_a_planner_that_breaks_is_a_failed_row_that_can_be_driven_again() -> None:
    job = finished_job()
    driven(job, BROKEN)
    assert {row.state for row in Simulation.objects.all()} == {State.FAILED}
    assert {row.reason for row in Simulation.objects.all()} == {
        "unexpected: RuntimeError: no idea"
    }
    table = driving_scores.scores_of_job(job, options=BROKEN, score="nuplan")
    assert table.failures == (("unexpected: RuntimeError: no idea", 3),)
    assert len(simulations.plan_job(job=job, options=BROKEN)) == 3


@pytest.mark.slow
def test_contestants_are_ranked_by_how_much_they_lower_the_score() -> None:
    job = rows.launch(contestants=("reference", "shy"))
    settle_all(job)
    nothing = modification_to_document(Modification())
    job.augmentations.filter(contestant__slug="shy").update(modification=nothing, image="y.png")
    table = driving_scores.scores_of_job(driven(job), options=STRAIGHT, score="nuplan")
    shown = [
        (line.name, *(round(value, 1) for value in (line.mean, line.before, line.lowered)))
        for line in table.lines
    ]
    assert shown == [
        ("Unmodified scene", 1.0, 1.0, 0.0),
        ("Reference", 0.0, 1.0, 1.0),
        ("reference", 0.0, 1.0, 1.0),
        ("shy", 1.0, 1.0, 0.0),
    ]
    assert table.lines[2].by_type["approaching_construction_zone"] == 0.0
    assert table.lines[2].by_type["jaywalking_pedestrian"] is None
    assert (table.under_way, table.total) == (0, 4)


def said(*arguments: str, **options: Any) -> str:
    out = StringIO()
    call_command("simulate", *arguments, stdout=out, **options)
    return out.getvalue()


def test_a_planner_that_is_not_allowed_is_never_imported(
    settings: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "evil_planner.py").write_text("raise SystemExit('imported')")
    monkeypatch.syspath_prepend(tmp_path)
    evil = "evil_planner.Planner"
    (first, *_) = simulations.plan_job(job=finished_job(), options=STRAIGHT)
    Simulation.objects.update(planner=evil)
    assert DRIVES.find_unsent(older_than=timedelta(0)) == [], "left to who named it"
    assert DRIVES.perform(first), "a message came all the same"
    row = Simulation.objects.get(pk=first)
    assert (row.state, evil in row.reason) == (State.FAILED, True)
    with pytest.raises(UnknownName, match="evil_planner"):
        simulations.plan_job(job=GenerationJob.objects.get(), options=Options(planner=evil))
    assert "evil_planner" not in sys.modules


@pytest.mark.slow
def test_the_command_line_names_a_planner_for_its_own_process_alone(settings: Settings) -> None:
    settings.PLANNERS = ()
    finished_job()
    with pytest.raises(CommandError, match="pdm-closed"):
        said("Round 1", planner=STRAIGHT.planner, queue=True)
    assert not Simulation.objects.exists()
    first = said("Round 1", planner=STRAIGHT.planner)
    assert "[3/3]" in first
    assert said("Round 1", planner=STRAIGHT.planner) == first, "what was driven already"
    (place,) = Scenario.objects.values_list("slug", flat=True)
    assert said(place, planner=STRAIGHT.planner).count("nuPlan") == 2
