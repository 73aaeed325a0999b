"""Sweeps as rows: a threshold as brute force finds it, dead workers lose nothing, what is kept."""

from dataclasses import replace
from datetime import timedelta
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from django.core.management import call_command
from django.core.management.base import CommandError
from pytest_django import Settings

from augment.errors import Conflict, InvalidDocument, UnknownName
from augment.models import Scenario, Simulation, Sweep
from augment.scene.codec import intent_to_document, modification_to_document
from augment.scene.entities import Modification
from augment.scene.intent import Intent, Shape
from augment.services.driving.driving_scores import drives_of_job, options_driven
from augment.services.driving.simulations import DRIVES, Options
from augment.services.driving.sweeps import (
    SweepRequest,
    add_family,
    list_options,
    plan_sweep,
    swept_numbers,
)
from augment.services.driving.thresholds import conclude, sweep_result
from augment.services.scenarios.editing import enter_intent
from augment.services.scenarios.scenes import LoadedScenario
from augment.simulation.drive import STEPS, find_expert, run
from augment.simulation.road import Road
from augment.simulation.score import score_drive
from augment.simulation.traffic import DriveSetting
from tests.drives import short_drive
from tests.intents import cones, metres
from tests.intents import parked as parked_car
from tests.jobs import rows
from tests.jobs.test_simulations import Straight
from tests.scenes import scene, vehicle

pytestmark = pytest.mark.django_db

State = Simulation.State
STRAIGHT = Options(planner="tests.jobs.test_simulations.Straight")
ACROSS = "add[0].y_m"


@pytest.fixture(autouse=True)
def allowed(settings: Settings, monkeypatch: pytest.MonkeyPatch) -> None:
    settings.PLANNERS = (STRAIGHT.planner,)
    monkeypatch.setitem(STEPS, False, 40)  # enough to come to whatever stands there


def parked(y_m: float) -> Modification:
    return Modification(added=(vehicle("Agent2", 30.0, y_m),))


def planned(low: float = 0.0, high: float = 3.5, count: int = 8) -> Sweep:
    """A sweep of how far to the left a car stands in front of one who never steers."""
    return plan_sweep(scenario=add_parked(), request=asked(low=low, high=high, count=count))


def add_parked() -> Scenario:
    document = modification_to_document(parked(0.0))
    return rows.add_scenario("parked", reference=document, intent=None, intent_origin="")


def asked(**changed: Any) -> SweepRequest:
    """A request: of a car's place across the lane, unless something else is said."""
    given: dict[str, Any] = {"number": ACROSS, "low": 0.0, "high": 1.0, "count": 2}
    return SweepRequest(**given | {"planner": STRAIGHT.planner} | changed)


def drive_tested() -> None:
    for pk in Simulation.objects.filter(planner=STRAIGHT.planner).values_list("pk", flat=True):
        DRIVES.perform(pk)


def settle_others(**scores: float) -> None:
    """Let all others have driven: lawfully, with a score by value, or not where none is given."""
    trace, document = short_drive()
    for drive in Simulation.objects.exclude(planner=STRAIGHT.planner).select_related("swept"):
        score = scores.get(f"at_{drive.swept.value:g}", 0.0)
        parts = {one["name"]: one["value"] for one in document["metrics"]["nuplan"]}
        parts |= {"no_ego_at_fault_collisions": float(score > 0.0)}
        parts |= {"drivable_area_compliance": 1.0, "ego_is_making_progress": 1.0}
        metrics = [{"name": name, "value": value} for name, value in parts.items()]
        Simulation.objects.filter(pk=drive.pk).update(
            state=State.DONE,
            nuplan_score=score,
            interplan_score=score,
            trace=trace,
            document=document | {"metrics": {"nuplan": metrics}},
        )


@pytest.mark.slow
def test_the_threshold_is_that_of_driving_every_value_by_hand() -> None:
    sweep = planned()
    assert Simulation.objects.count() == 8 * len(list_options(STRAIGHT)) == 32
    drive_tested()
    result = sweep_result(sweep)
    by_hand = {}
    for line in result.lines:
        setting = DriveSetting(scene=scene(), modification=parked(line.row.value))
        road = Road(setting.scene)
        drive = run(setting, Straight(), road=road)
        by_hand[line.row.value] = not score_drive(drive, find_expert(setting, road)).collisions
    assert {line.row.value: line.is_passed for line in result.lines} == by_hand
    # Bodies 2.297 m and 2 m wide pass each other at 2.149 m.
    assert result.edges == ((2.5, 2.0),)
    assert "passes 2.5 and fails 2" in result.verdict
    assert (result.under_way, sweep.concluded_at) == (24, None)


def ended(sweep: Sweep, **scores: float) -> Sweep:
    """The sweep, all of whose values were driven."""
    settle_others(**scores)
    drive_tested()
    sweep.refresh_from_db()
    return sweep


@pytest.mark.slow
def test_the_hardest_value_that_somebody_solves_becomes_a_scenario_once() -> None:
    sweep = ended(planned(1.0, 3.0, 3), at_1=0.5, at_2=0.8, at_3=0.1)
    kept = sweep.hardest
    assert sweep.concluded_at is not None
    reference = LoadedScenario(kept).reference
    assert (kept.slug, reference.added[0].y_m) == ("parked-1", 1.0)
    assert kept.instruction.endswith("(add[0].y_m: 1)")
    conclude(sweep.pk)
    assert Scenario.objects.filter(slug__startswith="parked-").count() == 1


def test_nothing_is_kept_where_nobody_solves_what_the_planner_fails() -> None:
    sweep = planned(1.0, 3.0, 3)
    Simulation.objects.filter(planner=STRAIGHT.planner).update(state=State.FAILED)
    assert sweep_result(sweep).verdict == "The planner has driven no value to its end."
    Simulation.objects.filter(planner=STRAIGHT.planner).update(state=State.QUEUED)
    sweep = ended(sweep, at_3=0.9)
    assert sweep.concluded_at is not None
    assert sweep.hardest is None


def test_a_worker_that_dies_in_a_drive_or_after_the_last_one_loses_nothing() -> None:
    sweep = planned(2.0, 3.0, 2)
    settle_others(at_2=0.8)
    first, last = Simulation.objects.filter(planner=STRAIGHT.planner).order_by("pk")
    held = DRIVES.take(first.pk, now=rows.NOON)
    assert DRIVES.take_back_lost(now=rows.NOON + rows.STALE * 10) == [first.pk]
    assert DRIVES.perform(first.pk)
    assert not DRIVES.perform(first.pk)
    again = DRIVES.take(last.pk)
    assert not held.renew()
    outcome = DRIVES.run(last, again)
    assert again.settle(outcome)  # and dies before it concludes
    DRIVES.cleanup(rows.NOON)
    sweep.refresh_from_db()
    assert sweep.hardest is not None
    assert [line.is_passed for line in sweep_result(sweep).lines] == [False, True]
    assert DRIVES.find_unsent(older_than=timedelta(0)) == []


def test_a_number_of_the_intent_is_placed_anew_and_kept_with_its_intent() -> None:
    intent = intent_to_document(cones(20.0, 1, Shape.LINE))
    scenario = rows.add_scenario("cones", intent=intent)
    number = "requests[0].spot.distance"
    assert number in swept_numbers(scenario)
    sweep = plan_sweep(
        scenario=scenario, request=asked(number=number, low=20.0, high=220.0, count=3)
    )
    near, middle, far = sweep_result(sweep).lines
    assert near.row.modification["add"][0]["x_m"] == pytest.approx(20.0, abs=0.5)
    assert (middle.row.modification, far.row.modification) == (None, None), "the lane ends"
    assert middle.row.reason
    assert not middle.drives
    assert LoadedScenario(ended(sweep, at_20=0.4).hardest).intent == cones(20.0, 1, Shape.LINE)


@pytest.mark.parametrize("now", [cones(60.0, 1, Shape.LINE), parked_car(20.0)])
def test_a_value_is_kept_without_an_intent_that_asks_for_something_else_now(now: Intent) -> None:
    scenario = rows.add_scenario("cones", intent=intent_to_document(cones(20.0, 2, Shape.LINE)))
    sweep = plan_sweep(
        scenario=scenario, request=asked(number="requests[0].count", low=1.0, high=2.0)
    )
    enter_intent(scenario="cones", document=intent_to_document(now))
    assert LoadedScenario(ended(sweep, at_2=0.4).hardest).intent is None


def test_it_is_said_that_workers_do_not_drive_the_planner_of_a_command(settings: Settings) -> None:
    """A sweep by a command that was interrupted waits for ever unless somebody allows it."""
    sweep = planned(count=2)
    assert "ARENA_PLANNERS" not in sweep_result(sweep).verdict
    settings.PLANNERS = ()
    assert sweep_result(sweep).verdict.endswith(
        f"Workers drive {STRAIGHT.planner} only if ARENA_PLANNERS names it."
    )
    Simulation.objects.update(state=State.FAILED)
    assert "ARENA_PLANNERS" not in sweep_result(sweep).verdict


def test_a_sweep_that_can_not_be_is_refused() -> None:
    scenario = add_parked()
    for changed, error, words in (
        ({"number": "add[7].y_m"}, UnknownName, r"add\[0\]\.y_m"),
        ({"planner": "nobody.Knows"}, UnknownName, "pdm-closed"),
        ({"high": -1.0}, InvalidDocument, "above low"),
        ({"number": "add[0].width_m", "low": 200.0, "high": 300.0}, Conflict, "No value"),
    ):
        with pytest.raises(error, match=words):
            plan_sweep(scenario=scenario, request=asked(**changed))
        assert not Sweep.objects.exists()


def test_a_family_becomes_scenarios_with_exact_numbers_named_after_the_first() -> None:
    spot = replace(cones(20.0, 1, Shape.LINE).requests[0].spot, distance=metres(20.0, 200.0))
    ranged = Intent(requests=(replace(cones(20.0, 1, Shape.LINE).requests[0], spot=spot),))
    scenario = rows.add_scenario("cones", intent=intent_to_document(ranged))
    made, refused = add_family(scenario=scenario, count=10, seed=1)
    assert (len(made) + len(refused), bool(made), bool(refused)) == (10, True, True)
    assert [row.slug for row in made] == [f"cones-{n}" for n in range(1, len(made) + 1)]
    for row in made:
        intent, reference = LoadedScenario(row).intent, LoadedScenario(row).reference
        distance = intent.requests[0].spot.distance
        assert reference.added[0].x_m == pytest.approx(distance.low_m, abs=0.5)
        assert f"{distance} ahead" in row.instruction
    with pytest.raises(Conflict, match="1 to 100"):
        add_family(scenario=scenario, count=0, seed=1)
    with pytest.raises(Conflict, match="0 or more, not -1"):
        add_family(scenario=scenario, count=1, seed=-1)


def said(command: str, *arguments: str, **options: Any) -> str:
    out = StringIO()
    call_command(command, *arguments, stdout=out, stderr=StringIO(), **options)
    return out.getvalue()


@pytest.mark.slow
def test_the_command_tells_the_values_and_where_the_planner_fails(tmp_path: Path) -> None:
    add_parked()
    how = {"low": 2.0, "high": 3.0, "count": 2}
    told = said("sweep", "parked", ACROSS, planner=STRAIGHT.planner, **how)
    assert f"2: {STRAIGHT.planner} 0.0 (fails); idm " in told
    assert told.endswith("passes 3 and fails 2.\nKept as parked-1.\n")
    out = tmp_path / "values"
    assert "6 files" in said("sweep", "parked", ACROSS, to=out, **how)
    assert (out / "parked--2.before.json").exists()
    with pytest.raises(CommandError, match="parked"):
        said("sample_family", "nobody", "3")


def test_drives_of_a_sweep_are_not_among_those_of_a_job() -> None:
    job = rows.launch()
    scenario = Scenario.objects.get()
    plan_sweep(scenario=scenario, request=asked(number="add[0].x_m", low=20.0, high=25.0))
    assert options_driven(drives_of_job(job)) == []
