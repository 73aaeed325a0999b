"""Events of OpenSCENARIO files are read: motions go and begin as formulas have them."""

import math
from pathlib import Path

import numpy as np
import pytest

from augment.formats.apart import UntrustedInput
from augment.scene.planned_motion import NearEgo
from tests.formats.openscenario_files import (
    AFTER,
    BRAKES,
    CAR,
    CHANGE,
    GAP,
    OF_EGO,
    OTHER_AT,
    RIGHT,
    ROADS,
    STEP,
    TIMING,
    by_entity,
    by_time,
    catalog,
    event,
    follow,
    fork,
    init,
    move_other,
    moves,
    read,
    route,
    scenario,
    speed,
    vertices,
    write,
)


@pytest.mark.parametrize(("owner", "conditions"), [("event", ""), ("act", by_time(0))])
def test_an_empty_trigger_never_fires(owner: str, conditions: str, tmp_path: Path) -> None:
    text = scenario(event(BRAKES), other_does=(speed(10),))
    trigger = f"<StartTrigger><ConditionGroup>{conditions}</ConditionGroup></StartTrigger>"
    idle = text.replace(trigger, "<StartTrigger/>")
    reading = read(write(tmp_path, idle))
    (other,) = moves(reading).others
    assert other.states[-1, 3] == 10.0
    assert f"An {owner} whose StartTrigger is empty never begins." in reading.notes
    (other,) = moves(read(write(tmp_path, text.replace(trigger, "")))).others
    assert other.states[-1, 3] < 10.0


@pytest.mark.parametrize("times", ["<None/>", TIMING.format("absolute")])
@pytest.mark.parametrize("who", [None, "Other"])
def test_who_is_put_nowhere_begins_on_its_trajectory(
    who: str | None, times: str, tmp_path: Path
) -> None:
    text = scenario(other_does=(follow(vertices((0, 80), (3, 110)), times),))
    teleport = f"<PrivateAction><TeleportAction><Position>{OTHER_AT}"
    text = text.replace(f"{teleport}</Position></TeleportAction></PrivateAction>", "")
    scene = read(write(tmp_path, text), who).scene
    other = scene.ego if who else scene.agents[0]
    assert scene.origin.x_m + (0.0 if who else other.x_m) == pytest.approx(81.4)
    assert other.speed_mps == (0.0 if "None" in times else pytest.approx(10.0))


def test_who_begins_on_its_trajectory_heads_along_it(tmp_path: Path) -> None:
    turn_rad, place = math.atan(0.75), '<Position><WorldPosition x="{}" y="{}"/></Position>'
    ends = "".join(
        f"<Vertex>{place.format(*end)}</Vertex>" for end in ((80, -1.7504), (120, 28.2496))
    )
    at = f'<WorldPosition x="80" y="-1.7504" h="{turn_rad}"/>'
    states = move_other(tmp_path, event(follow(ends)), other_at=at).states
    assert states[:, 2] == pytest.approx(turn_rad, abs=0.002)


@pytest.mark.parametrize("way", ["2", "4"])
@pytest.mark.parametrize("is_in_catalog", [False, True])
def test_a_route_is_kept_as_lanes(way: str, is_in_catalog: bool, tmp_path: Path) -> None:
    taken = f'<Route name="r">{route((-1, 20), (-1, 90), roads=f"1{way}")}</Route>'
    files = {"roads.xodr": fork(), "sub/ways.xosc": catalog(taken, "Ways")}
    if is_in_catalog:
        taken = '<CatalogReference catalogName="Ways" entryName="r"/>'
    assigned = f"<RoutingAction><AssignRouteAction>{taken}</AssignRouteAction></RoutingAction>"
    does = (speed(10), assigned)
    reading = read(write(tmp_path, scenario(other_does=does), **files))
    (other,) = moves(reading).others
    # From s = 81.4 with the middle of its box, 18.6 m on road 1 and then some 50 m.
    origin = reading.scene.origin.pose
    places = origin.to_parent(other.states[:, :2])
    away_m = np.abs(np.hypot(places[:, 0] - 100.0, places[:, 1] - 100.0) - 101.75)
    away_m = np.abs(places[:, 1] + 1.75) if way == "2" else np.where(places[:, 0] > 100, away_m, 0)
    assert places[68, 0] > 140.0
    assert away_m[:80].max() < 0.05


def test_a_route_that_no_road_leads_along_is_lost_with_its_place(tmp_path: Path) -> None:
    taken = f"<Route>{route((1, 20), (-1, 90), roads='14')}</Route>"
    assigned = f"<RoutingAction><AssignRouteAction>{taken}</AssignRouteAction></RoutingAction>"
    text = scenario(event(assigned))
    reading = read(write(tmp_path, text, **{"roads.xodr": fork()}))
    assert any("event acts: no road leads from road 1 to road" in n for n in reading.notes)


@pytest.mark.parametrize(
    ("condition", "started_s"),
    [
        (by_time(2.5), 2.5),
        # The ego drives from 20 at 10 m/s; the other from 80 at 4 m/s: 60 m, closing at 6 m/s.
        (by_entity(GAP.format(30.3, "false")), 5.0),
        (by_entity(GAP.format(25.3, "true")), 5.0),
        (by_entity('<TimeHeadwayCondition entityRef="Other" value="3.03" rule="lessThan" '
                   'freespace="false"/>', "Ego"), 5.0),
        (by_entity('<TimeToCollisionCondition value="5.05" rule="lessThan" freespace="false">'
                   '<TimeToCollisionConditionTarget><EntityRef entityRef="Other"/>'
                   "</TimeToCollisionConditionTarget></TimeToCollisionCondition>", "Ego"), 5.0),
        (by_entity('<TraveledDistanceCondition value="19.9"/>', "Ego"), 2.0),
        (by_entity('<TraveledDistanceCondition value="19.9"/>', "Ego").replace(
            "<Condition>", '<Condition conditionEdge="rising">'), 2.0),
        (by_entity('<TraveledDistanceCondition value="19.9" rule="lessThan"/>', "Ego").replace(
            "<Condition>", '<Condition conditionEdge="falling">'), 2.0),
        (by_entity('<TraveledDistanceCondition value="19.9"/>'), 5.0),
        (by_entity('<ReachPositionCondition tolerance="2.1"><Position><WorldPosition x="52" '
                   'y="-1.75"/></Position></ReachPositionCondition>', "Ego"), 3.0),
        (by_entity('<RelativeSpeedCondition entityRef="Other" value="5" rule="greaterThan"/>',
                   "Ego") + by_time(2), 2.0),
        (by_entity('<AccelerationCondition value="1" rule="lessThan"/>') + by_time(2), 2.0),
        (AFTER.replace('"acts"', '"s"').replace("completeState", "runningState").replace(
            'delay="0"', 'delay="2"'), 2.0),
        (by_entity('<ReachPositionCondition tolerance="2.1"><Position><WorldPosition x="52" '
                   'y="-1.75"/></Position></ReachPositionCondition>', "Ego") + by_time(3.35), 3.4),
    ],
)  # fmt: skip
def test_a_condition_starts_a_motion_when_a_formula_says(
    condition: str, started_s: float, tmp_path: Path
) -> None:
    other = move_other(tmp_path, event(BRAKES, condition))
    assert other.started_s == pytest.approx(started_s, abs=0.01)
    # Over 2 s from 4 m/s to a stop.
    x_m = other.states[:, 0] - other.states[0, 0]
    assert x_m[-1] == pytest.approx(4.0 * started_s + 4.0, abs=0.01)


def test_who_stood_for_so_long_goes_on_faster_than_then(tmp_path: Path) -> None:
    stood = by_entity('<StandStillCondition duration="1"/>')
    goes = event(speed(6), stood, name="goes")
    target = '<RelativeTargetSpeed entityRef="Other" value="2" speedTargetValueType="delta"/>'
    more = speed(0).replace('<AbsoluteTargetSpeed value="0"/>', target)
    later = event(more, by_time(6), name="more")
    other = move_other(tmp_path, event(BRAKES, by_time(1)), goes, later)
    # It stops after 3 s, and goes on at 6 m/s after 4 s, at 8 m/s after 6 s.
    assert other.states[[39, 59, 69], 3] == pytest.approx([0.0, 6.0, 8.0])


def test_a_speed_is_reached_by_its_dynamics(tmp_path: Path) -> None:
    for shape, dimension, value, gone_m in (
        ("linear", "time", 2, 4.0 * 1.0 + 2.0 * 8.0 + 12.0 * 2.0),
        ("linear", "rate", 4, 4.0 * 1.0 + 2.0 * 8.0 + 12.0 * 2.0),
        ("linear", "distance", 16, 4.0 * 1.0 + 2.0 * 8.0 + 12.0 * 2.0),
        ("sinusoidal", "time", 2, 4.0 * 1.0 + 2.0 * 8.0 + 12.0 * 2.0),
        ("step", "time", 0, 4.0 * 1.0 + 12.0 * 4.0),
    ):
        dynamics = STEP.replace("step", shape).replace('"time"', f'"{dimension}"')
        action = speed(12, dynamics.replace('"0"', f'"{value}"'))
        other = move_other(tmp_path, event(action, by_time(1)))
        assert other.states[50, 0] - other.states[0, 0] == pytest.approx(gone_m, abs=0.05)


@pytest.mark.parametrize(
    "target",
    [RIGHT, '<AbsoluteTargetLane value="-2"/>', OF_EGO],
    ids=["relative", "absolute", "beside the ego's"],
)
@pytest.mark.parametrize(("dimension", "value"), [("time", 3), ("distance", 24)])
def test_a_lane_change_takes_its_time_or_way(
    target: str, dimension: str, value: int, tmp_path: Path
) -> None:
    change = event(CHANGE.format(dimension, value, target), by_time(1))
    other = move_other(tmp_path, change, mps=8)
    # From the lane of the ego after 1 s; half of it after 1.5 s more, and all of it after 3 s.
    assert other.states[[10, 25, 41], 1] == pytest.approx([0.0, -1.75, -3.5], abs=0.06)


def test_who_drives_on_the_oncoming_lane_changes_onto_the_egos(tmp_path: Path) -> None:
    at = '<LanePosition roadId="1" laneId="1" s="80"><Orientation type="relative" h="3.141593"/>'
    target = OF_EGO.replace("-1", "0")
    change = event(CHANGE.format("time", 3, target), by_time(1))
    other = move_other(tmp_path, change, mps=8, other_at=f"{at}</LanePosition>")
    assert other.states[[0, 10, 41], 1] == pytest.approx([3.5, 3.5, 0.0], abs=0.06)
    assert other.states[-1, 0] > other.states[41, 0] + 50.0


def test_events_of_one_actor_go_on_from_each_other(tmp_path: Path) -> None:
    first = event(speed(12, STEP.replace("step", "linear").replace('"0"', '"2"')), by_time(1))
    later = AFTER.replace('delay="0"', 'delay="0.5"')
    second = event(CHANGE.format("time", 2, RIGHT), later, name="changes")
    third = event(BRAKES, by_time(6), name="brakes")
    reading = read(write(tmp_path, scenario(first, second, third, other_does=(speed(4),))))
    (other,) = moves(reading).others
    x_m, y_m = (other.states[:, :2] - other.states[0, :2]).T
    assert x_m[30] == pytest.approx(4.0 + 16.0, abs=0.01)
    assert y_m[[35, 56]] == pytest.approx([0.0, -3.5], abs=0.05)
    assert x_m[-1] == pytest.approx(4.0 + 16.0 + 36.0 + 12.0, abs=0.5)
    assert not [note for note in reading.notes if "Not understood" in note]


def test_an_event_waits_for_what_an_actor_does_first(tmp_path: Path) -> None:
    # The other cuts in as the act begins, and brakes once it is 70 m ahead: 60 m, 2 m a second.
    state = 'storyboardElementRef="{}" state="{}"/></ByValueCondition></Condition>'
    act = AFTER[: AFTER.index("storyboardElementRef")] + state.format("a", "startTransition")
    first = event(speed(12, STEP.replace('"0"', '"-3"')), act, name="starts")
    gap = by_entity(GAP.format(70, "false").replace("lessThan", "greaterThan"))
    brakes = speed(
        0, STEP.replace("step", "linear").replace("time", "rate").replace('"0"', '"-4"')
    )
    started = AFTER.replace('"acts"', '"starts"')
    second = event(brakes, gap + started, name="brakes")
    reading = read(write(tmp_path, scenario(first, second, other_does=(speed(4),))))
    (other,) = moves(reading).others
    assert other.started_s == 0.0
    assert other.states[[49, 60], 3] == pytest.approx([12.0, 8.0], abs=0.5)
    assert other.states[-1, 3] == 0.0
    assert any("event brakes begins so long after the first" in n for n in reading.notes)


def test_carlas_steps_last_and_a_standing_ego_sets_off(tmp_path: Path) -> None:
    # At 1.1 s, and at t0 alone: who meets both does so once both have been met.
    both = by_entity(GAP.format(50, "false")) + by_time(0).replace("greaterThan", "equalTo")
    goes = event(speed(8, STEP.replace("time", "rate").replace('"0"', '"2"')), both)
    waits = event(speed(0), AFTER, name="waits")
    text = scenario(goes, waits).replace('revMinor="1"', 'revMinor="1" description="CARLA:made"')
    standing = text.replace('value="10"', 'value="0"').replace('y="-1.75"', 'y="1.75"')
    reading = read(write(tmp_path, standing))
    motion = reading.scene.agents[0].motion
    assert motion is not None
    assert isinstance(motion.start, NearEgo)
    assert motion.start.within_m == pytest.approx(49.001, abs=0.001)
    assert motion.speeds == ((0.0, 0.0), (0.01, 8.0), (2.0, 8.0), (2.01, 0.0))
    assert "The ego stands: who waits for it sees it at 10 m/s." in reading.notes


def test_an_ego_that_set_off_for_one_stands_for_another(tmp_path: Path) -> None:
    stands = by_entity('<StandStillCondition duration="2"/>', "Ego")
    waits = event(speed(5), stands, "b").replace("</Event>", "</Event></Maneuver></ManeuverGroup>")
    text = scenario(event(speed(3), by_entity(GAP.format(20, "false"))), other_does=(speed(0),))
    third = f'<ScenarioObject name="Third">{CAR}</ScenarioObject></Entities>'
    group = '<ManeuverGroup><Actors><EntityRef entityRef="Third"/></Actors><Maneuver>'
    text = text.replace("</ManeuverGroup>", f"</ManeuverGroup>{group}{waits}")
    text = text.replace("</Entities>", third).replace('value="10"/>', 'value="0"/>')
    at = init("Third", '<LanePosition roadId="1" laneId="-2" s="60"/>', speed(0))
    reading = read(write(tmp_path, text.replace("</Actions></Init>", f"{at}</Actions></Init>")))
    assert all(agent.motion for agent in reading.scene.agents)


def test_a_place_that_goes_along_with_somebody_is_where_they_are(tmp_path: Path) -> None:
    # 60 m behind the other at first, the ego comes 6 m a second nearer to 10 m behind it.
    ahead = '<Position><RelativeObjectPosition entityRef="Other" dx="-10" dy="0"/></Position>'
    near = f'<DistanceCondition value="20.3" freespace="false" rule="lessThan">{ahead}'
    given = by_entity(f"{near}</DistanceCondition>", "Ego")
    other = move_other(tmp_path, event(BRAKES, given))
    assert other.started_s == pytest.approx(5.0, abs=0.01)


def test_who_follows_times_later_holds_speed_until_then_and_brakes(tmp_path: Path) -> None:
    braking = vertices((0, 120), (2, 134), (4, 144), (8, 152))  # from 8 m/s, by 1 m/s each second
    timed = event(follow(braking, TIMING.format("relative")), by_time(5), "b")
    other = move_other(tmp_path, event(speed(8), by_time(0)), timed)
    gone_m = other.states[[25, 50, 110, 130], 0] - other.states[0, 0]
    assert gone_m == pytest.approx([20.0, 40.0, 70.0, 72.0], abs=0.03)


def test_a_speed_never_reached_costs_no_lane_change(tmp_path: Path) -> None:
    never = speed(9, STEP.replace("step", "linear").replace("time", "rate"))
    action = f"<Action><PrivateAction>{never}</PrivateAction></Action>"
    change = event(CHANGE.format("rate", 1, RIGHT), by_time(1))
    both = change.replace("<StartTrigger>", f"{action}<StartTrigger>")
    text = scenario(both, other_does=(speed(8),))
    narrow = {"roads.xodr": ROADS.replace('a="3.5"', 'a="3"')}
    (other,) = moves(read(write(tmp_path, text, **narrow))).others
    # Across 3 m at 1 m/s.
    y_m = other.states[:, 1] - other.states[0, 1]
    assert y_m[[10, 25, 40]] == pytest.approx([0.0, -1.5, -3.0], abs=0.06)
    assert other.states[-1, 3] == pytest.approx(8.0, abs=0.001)


@pytest.mark.parametrize("times_s", [(0, 5), (5, 0), ("", "")])
def test_times_that_do_not_count_are_not_read(times_s: tuple[object, ...], tmp_path: Path) -> None:
    line = vertices(*((time_s, 80 + 40 * n) for n, time_s in enumerate(times_s)))
    other = move_other(tmp_path, event(follow(line)))
    assert other.states[50, 0] - other.states[0, 0] == pytest.approx(20.0, abs=0.02)


def test_trajectories_of_one_actor_go_on_from_each_other(tmp_path: Path) -> None:
    place = '<Position><RelativeObjectPosition entityRef="Other"/></Position>'
    shape = '<Clothoid curvature="{}" curvaturePrime="0" length="40">' + f"{place}</Clothoid>"
    first = event(follow(shape.format(0.01)), by_time(2))
    second = event(follow(shape.format(-0.01)), AFTER, name="then")
    other = move_other(tmp_path, first, second, mps=8)
    # Two bends of 0.4 rad in a radius of 100 m, the other way round. Paths have no headings: the
    # second begins along the way of the middle, up to 0.014 rad more.
    x_m, y_m = 200.0 * math.sin(0.4), 200.0 * (1.0 - math.cos(0.4))
    assert other.states[120, :3] == pytest.approx([58.6 + 16.0 + x_m + 1.4, y_m, 0.0], abs=0.4)


LATER = (
    '<Act name="a2"><ManeuverGroup name="g"><Actors><EntityRef entityRef="Other"/></Actors>'
    '<Maneuver name="m">{}</Maneuver></ManeuverGroup>'
    "<StartTrigger><ConditionGroup>{}</ConditionGroup></StartTrigger></Act></Story>"
)


ON_THE_WAY = by_entity('<TraveledDistanceCondition value="34.9"/>', "Ego")
RUNNING = AFTER.replace("completeState", "runningState").replace('"0"', '"1"')


def test_an_event_begins_once_both_its_act_and_its_own_conditions_hold(tmp_path: Path) -> None:
    text = scenario(event(speed(9), by_time(2)), other_does=(speed(8),))
    for act, own, began_s in (
        *((by_time(6), AFTER, 6.0), (AFTER, by_time(6), 6.0), (AFTER, "", 2.0), ("", AFTER, 2.0)),
        (ON_THE_WAY, by_time(2), 3.5),
        (ON_THE_WAY, RUNNING.replace('"acts"', '"a2"'), 4.5),
    ):
        later = LATER.format(event(speed(12), own, name="then"), act)
        reading = read(write(tmp_path, text.replace("</Story>", later)))
        (other,) = moves(reading).others
        faster = other.states[:, 3] > 11.0
        assert faster.argmax() == pytest.approx(10 * began_s + 1, abs=1)
        is_told = any("begins so long after" in note for note in reading.notes)
        assert is_told == (began_s > 2.0)


def test_an_odd_trajectory_costs_its_event_alone_and_is_noted_once(tmp_path: Path) -> None:
    odd = event(follow(vertices((0, 60), (1, "nan")), TIMING), by_time(0))
    late = event(follow(vertices((0, 60), (1, 68)), TIMING), by_time("soon"), "late")
    reading = read(write(tmp_path, scenario(odd, late, event(speed(12), by_time(2), "then"))))
    assert moves(reading).others[0].states[-1, 3] == 12.0
    (said,) = (note for note in reading.notes if note.startswith("Not understood and left out: "))
    assert "events (2); first event late" in said


CLOTHOID = (
    '<Clothoid curvature="0.02" curvaturePrime="0" length="40"><Position>{}</Position></Clothoid>'
)
SEGMENT = '<Segment curvatureStart="0.02" curvatureEnd="0.02" length="20" hOffset="0">{}</Segment>'
SPLINE = (
    f"<ClothoidSpline>{SEGMENT.format('<PositionStart>{}</PositionStart>')}"
    f"{SEGMENT.format('')}</ClothoidSpline>"
)
NOWHERE = (
    SPLINE.replace("Segment ", "ClothoidSplineSegment ")
    .replace("/Segment", "/ClothoidSplineSegment")
    .replace("<PositionStart>{}</PositionStart>", "")
)


@pytest.mark.parametrize(
    ("start_s", "made"), [(0.0, CLOTHOID), (2.0, CLOTHOID), (2.0, SPLINE), (2.0, NOWHERE)]
)
def test_a_clothoid_from_where_its_actor_is_then_bends_as_it_says(
    start_s: float, made: str, tmp_path: Path
) -> None:
    shape = made.format('<RelativeObjectPosition entityRef="Other" dx="0" dy="0"/>')
    other = move_other(tmp_path, event(follow(shape), by_time(start_s)), mps=8)
    # The middle of its box is 1.4 m ahead of the point that goes round in a radius of 50 m.
    since_rad, x_m = 0.02 * 32.0, 58.6 + 8.0 * start_s
    middle = x_m + 50.0 * math.sin(since_rad) + 1.4 * math.cos(since_rad)
    y_m = 50.0 * (1.0 - math.cos(since_rad)) + 1.4 * math.sin(since_rad)
    reached = other.states[int(10 * start_s) + 40, :2]
    assert reached == pytest.approx([middle, y_m], abs=0.03)
    # It goes straight on after the bend.
    assert other.states[-1, 2:] == pytest.approx([0.8, 8.0], abs=0.001)


@pytest.mark.parametrize("made", [NOWHERE, SPLINE])
def test_a_clothoid_by_the_clock_begins_where_its_actor_is_then(made: str, tmp_path: Path) -> None:
    shape = made.format('<RelativeObjectPosition entityRef="Other" dx="0" dy="0"/>')
    shape = shape.replace("Spline>", 'Spline timeEnd="5">', 1).replace("0.02", "0")
    for start_s in (0, 2.5):
        shape = shape.replace('hOffset="0">', f'hOffset="0" timeStart="{start_s}">', 1)
    timed = event(follow(shape, TIMING.format("relative")), by_time(2))
    gone_m = move_other(tmp_path, timed, mps=8).states[:, 0] - 60.0
    assert gone_m[[10, 19, 30, 50]] == pytest.approx([8.0, 15.2, 24.0, 40.0], abs=0.05)


def test_a_nurbs_that_is_a_circle_is_followed_as_one(tmp_path: Path) -> None:
    # A quarter of 40 m radius round (88, 38.25); its middle is 1.4 m ahead of the point on it.
    places = ((88, -1.75, 1), (128, -1.75, math.sqrt(0.5)), (128, 38.25, 1))
    points = "".join(
        f'<ControlPoint weight="{w}"><Position><WorldPosition x="{x}" y="{y}"/></Position>'
        "</ControlPoint>"
        for x, y, w in places
    )
    knots = "".join(f'<Knot value="{n}"/>' for n in (0, 0, 0, 1, 1, 1))
    shape = f'<Nurbs order="3">{points}{knots}</Nurbs>'
    other = move_other(tmp_path, event(follow(shape), by_time(1)), mps=8)
    away_m = np.hypot(*(other.states[11:80, :2] - [66.6, 40.0]).T)
    assert away_m == pytest.approx(math.hypot(40.0, 1.4), abs=0.02)


def test_who_waits_for_another_is_read_after_them(tmp_path: Path) -> None:
    waits = event(speed(0), AFTER.replace('"acts"', '"brakes"'))
    text = scenario(waits, other_does=(speed(4),)).replace(
        "</Entities>", f'<ScenarioObject name="Third">{CAR}</ScenarioObject></Entities>'
    )
    third = init("Third", '<LanePosition roadId="1" laneId="-2" s="60"/>', speed(6))
    text = text.replace("</Actions></Init>", f"{third}</Actions></Init>")
    group = '<ManeuverGroup name="h"><Actors><EntityRef entityRef="Third"/></Actors><Maneuver>'
    brakes = event(BRAKES, by_time(1), name="brakes")
    text = text.replace(
        "</ManeuverGroup>", f"</ManeuverGroup>{group}{brakes}</Maneuver></ManeuverGroup>"
    )
    reading = read(write(tmp_path, text))
    started_s = {m.agent.speed_mps: m.started_s for m in moves(reading).others}
    # The third brakes over 2 s from 1 s on, and the other stops then.
    assert started_s == pytest.approx({6.0: 1.0, 4.0: 3.0}, abs=0.01)


def test_forty_actors_with_events_are_read_within_the_sandbox(tmp_path: Path) -> None:
    entities, begins, groups = "", "", ""
    for number in range(40):
        name = f"N{number}"
        at = f'<LanePosition roadId="1" laneId="-{1 + number % 2}" s="{30 + 3 * number}"/>'
        entities += f'<ScenarioObject name="{name}">{CAR}</ScenarioObject>'
        begins += init(name, at, speed(6))
        first = event(BRAKES, by_time(1), name=f"{name} brakes")
        after = AFTER.replace('"acts"', f'"{name} brakes"')
        actors = f'<ManeuverGroup name="{name}"><Actors><EntityRef entityRef="{name}"/></Actors>'
        events = f"{first}{event(speed(9), after, name=f'{name} goes')}"
        groups += f"{actors}<Maneuver>{events}</Maneuver></ManeuverGroup>"
    text = scenario().replace("</Entities>", f"{entities}</Entities>")
    text = text.replace("</Actions></Init>", f"{begins}</Actions></Init>")
    file = write(tmp_path, text.replace("</ManeuverGroup>", f"</ManeuverGroup>{groups}", 1))
    _, reading = UntrustedInput(path=file).read(item=None, frame=None, name="many")
    assert sum(agent.motion is not None for agent in reading.scene.agents) == 40


@pytest.mark.parametrize(
    ("times", "condition"),
    [
        (TIMING.format("absolute").replace('scale="1" offset="0"', 'scale="2" offset="-1"'),
         by_time(2)),
        (TIMING.format("relative"), by_time(2)),
        (TIMING.format("absolute"), by_time(2)),
        ("<None/>", by_time(2)),
        (TIMING.format("relative"),
         by_entity('<TraveledDistanceCondition value="19.9"/>', "Ego")),
    ],
)  # fmt: skip
def test_a_trajectory_has_its_times_or_speed(times: str, condition: str, tmp_path: Path) -> None:
    since_s, scale = (2 if "absolute" in times else 0), (2 if "-1" in times else 1)
    line = vertices(*(((since_s + n + scale - 1) / scale, 88 + 4 * n) for n in range(6)))
    other = move_other(tmp_path, event(follow(line, times), condition))
    gone_m = other.states[:, 0] - other.states[0, 0]
    # 8 m by then, and 4 m a second: to the last point after 7 s.
    assert gone_m[[10, 20, 30, 60, 70]] == pytest.approx([4.0, 8.0, 12.0, 24.0, 28.0], abs=0.02)
