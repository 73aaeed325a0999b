"""Moments at which conditions of OpenSCENARIO hold, and the triggers of ours that they become.

A condition is looked at while everybody goes on as at t0, the ego as recorded: its first step
becomes a trigger that fires then, and with another ego where the same distance or place is
reached. Frame: the ego frame of t0. T steps.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element

import numpy as np

from augment import foreign
from augment.foreign import Doubts, FloatArray, fault_at
from augment.formats.opendrive.geometry import read_float
from augment.formats.openscenario.events import BEGUN, ENDED, WAIT, Groups, StoryEvent, has_begun
from augment.formats.openscenario.trajectories import place_beside
from augment.geometry.frames import Pose
from augment.scene.planned_motion import EGO_ID, AtPlace, AtTime, NearEgo, Trigger

_RULES: dict[str, Callable[[FloatArray, float], np.ndarray]] = {
    **{"lessThan": np.less, "lessOrEqual": np.less_equal, "equalTo": np.isclose},
    **{"greaterThan": np.greater, "greaterOrEqual": np.greater_equal, "notEqualTo": np.not_equal},
}
_EDGES: dict[str, Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]] = {
    "none": lambda now, before, begun: now,
    "rising": lambda now, before, begun: now & ~before,
    "falling": lambda now, before, begun: ~now & before,
    "risingOrFalling": lambda now, before, begun: now != before,
    "carla:latched": lambda now, before, begun: np.maximum.accumulate(now & begun),
}
_SWITCH = {"true": True, "1": True, "false": False, "0": False}
_STRAIGHT = ("", "cartesianDistance", "euclidianDistance", "euclideanDistance")
_USUAL = {
    "ReachPositionCondition": ("tolerance", "lessOrEqual"),
    "StandStillCondition": ("duration", "greaterOrEqual"),
    "TraveledDistanceCondition": ("value", "greaterOrEqual"),
}
"""The attribute of a condition's value and its rule, where they are not written or others."""
_MARGIN_M = 1e-3
_AHEAD_M = 2.0
_STANDING_MPS = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class Done:
    """When an element of the storyboard begins and ends, in seconds since its actor's start.

    Attributes:
        start: Of its actor.
        started_s: When that fires, as far as one can tell.
    """

    actor: str
    start: Trigger
    started_s: float
    begins_s: float
    ends_s: float

    def since_s(self, wait: Element) -> float:
        """Return the moment that a condition on the element waits for."""
        moments = dict.fromkeys(BEGUN, self.begins_s) | dict.fromkeys(ENDED, self.ends_s)
        return foreign.look_up(moments, wait.get("state"), "state of a storyboard element")


@dataclass(frozen=True, slots=True, kw_only=True)
class Expectation:
    """Where everybody will be while nobody's event begins.

    Attributes:
        states: (T, 4) by the names of the file, of the middles.
        centres_m: From points of reference to middles, ahead and to the left.
        sizes_m: Length and width.
        ids: Of agents, by the names of the file.
        find_point: The place that a Position says, in the scene's frame.
        done: Elements of the storyboard that were read, by name.
    """

    times_s: FloatArray
    states: dict[str, FloatArray]
    centres_m: Mapping[str, tuple[float, float]]
    sizes_m: Mapping[str, tuple[float, float]]
    ids: Mapping[str, str]
    find_point: Callable[[Element, str], Pose]
    done: dict[str, Done] = field(default_factory=dict)

    def find_done(self, wait: Element, place: str) -> Done:
        """Return the element that a condition waits for."""
        name = wait.get("storyboardElementRef", "")
        return foreign.look_up(self.done, name.split("::")[-1], place)

    def references(self, name: str, place: str) -> FloatArray:
        """Return where somebody's point of reference is (T, 2)."""
        states, (ahead_m, left_m) = self.find_states(name, place), self.centres_m[name]
        return place_beside(states, -ahead_m, -left_m)

    def find_states(self, name: str, place: str) -> FloatArray:
        """Return where somebody's middle is (T, 4)."""
        return foreign.look_up(self.states, name, place)


def find_trigger(
    event: StoryEvent, actor: str, expected: Expectation, doubts: Doubts
) -> tuple[Trigger, int]:
    """Return the trigger of ours for an event, and the step at which it fires.

    Raises:
        InvalidDocument: A condition is none that is read, or never holds.
    """
    if (time_s := event.time_s) is not None:
        step = round(time_s / float(expected.times_s[1]))
        return AtTime(after_s=time_s), min(step, len(expected.times_s) - 1)
    step, watched = find_step(event, expected)
    tried = [element for condition in event.conditions for element in condition.iter()]
    goals = [e for e in tried if e.tag == "Position" and not _list_refs(e)]
    ego = next(name for name, agent_id in expected.ids.items() if agent_id == EGO_ID)
    others = [name for name in watched if name != actor]
    if step == 0 or not others:
        return AtTime(after_s=round(float(expected.times_s[step]), 6)), step
    own, other = expected.states[actor], expected.states[ego if ego in others else others[0]]
    gaps_m = np.hypot(*(own[: step + 1, :2] - other[: step + 1, :2]).T)
    if ego in others and not goals and gaps_m[step] < gaps_m[:step].min():
        return NearEgo(within_m=float(gaps_m[step]) + _MARGIN_M), step
    # A place of the condition if the other is there for the first time, else just ahead of it.
    x_m, y_m, heading_rad, _ = other[step].tolist()
    ahead = x_m + _AHEAD_M * math.cos(heading_rad), y_m + _AHEAD_M * math.sin(heading_rad)
    poses = [expected.find_point(goal, event.place) for goal in goals[:1]]
    for place in (*((pose.x_m, pose.y_m) for pose in poses), ahead):
        away_m = np.hypot(*(other[: step + 1, :2] - place).T)
        if away_m[step] < away_m[:step].min():
            break
    within_m = float(away_m[step]) + _MARGIN_M
    doubts.assume(f"{event.place} begins by the place of another as its conditions first hold")
    agent_id = expected.ids[ego if ego in others else others[0]]
    return AtPlace(agent_id=agent_id, x_m=place[0], y_m=place[1], within_m=within_m), step


def find_step(event: StoryEvent, expected: Expectation) -> tuple[int, list[str]]:
    """Return the step at which the conditions of an event first hold, and whose motion they watch.

    Raises:
        InvalidDocument: A condition is none that is read, or never holds.
    """
    step, watched = 0, list[str]()
    for groups in (event.begins, event.groups):
        if groups:
            holds, names = _find_holding(groups, event, step, expected)
            if not holds.any():
                text = f"its conditions never hold in {expected.times_s[-1]:g} s while everybody"
                raise fault_at(event.place, f"{text} goes on as at t0")
            step, watched = int(holds.argmax()), watched + names
    return step, watched


# Private


def _find_holding(
    groups: Groups, event: StoryEvent, since: int, expected: Expectation
) -> tuple[np.ndarray, list[str]]:
    """When groups of conditions hold (T,) from a step on, and whose motion they watch."""
    times_s, watched = expected.times_s, list[str]()
    holds, begun = np.zeros(len(times_s), dtype=bool), np.arange(len(times_s)) >= since
    for group in groups:
        all_hold = begun.copy()
        for condition in group:
            met, names = _watch(condition, expected, event, float(times_s[since]))
            edge = foreign.look_up(_EDGES, condition.get("conditionEdge", "none"), event.place)
            met = edge(met, np.append(met[:1], met[:-1]), begun)  # nothing is before t0
            delay_s = foreign.read_number(condition.get("delay") or "0", event.place, 0.0, 1e3)
            steps = min(round(delay_s / float(times_s[1])), len(met))
            all_hold &= np.concatenate([np.zeros(steps, dtype=bool), met[: len(met) - steps]])
            watched += names
        holds |= all_hold
    return holds, watched


def _watch(
    condition: Element, expected: Expectation, event: StoryEvent, begun_s: float
) -> tuple[np.ndarray, Sequence[str]]:
    """When a condition holds (T,), and whose motion it depends on."""
    place = event.place
    paths = "ByValueCondition/*", "ByEntityCondition/EntityCondition/*"
    element = next((e for p in paths for e in condition.findall(p)), Element("nothing"))
    if (wait := condition.find(WAIT)) is not None:
        if has_begun(wait, event.around):
            return expected.times_s >= begun_s - 1e-9, []
        done = expected.find_done(wait, place)
        return expected.times_s >= done.started_s + done.since_s(wait) - 1e-9, []
    measures: dict[str, Callable[[str, Element, Expectation, str], FloatArray]] = {
        "RelativeDistanceCondition": _measure_gap,
        "DistanceCondition": _measure_gap,
        "ReachPositionCondition": _measure_gap,
        "TimeHeadwayCondition": lambda name, own, e, p: (
            _measure_gap(name, own, e, p) / e.states[name][:, 3]
        ),
        "TimeToCollisionCondition": _measure_collision,
        "TraveledDistanceCondition": _measure_way,
        "SpeedCondition": lambda name, _, e, p: e.find_states(name, p)[:, 3],
        "RelativeSpeedCondition": _measure_speed_over,
        "AccelerationCondition": lambda name, _, e, p: np.gradient(
            e.find_states(name, p)[:, 3], e.times_s
        ),
        "StandStillCondition": _measure_standing,
        "SimulationTimeCondition": lambda _, __, e, ___: e.times_s,
    }
    measure = foreign.look_up(measures, element.tag, place)
    place = f"{place}.{element.tag}"
    attribute, usual = _USUAL.get(element.tag, ("value", None))
    value = read_float(element, attribute, place)
    rule = foreign.look_up(_RULES, element.get("rule", usual), place)
    # Of other directions nobody knows how fast anything goes.
    foreign.look_up({"longitudinal": ""}, element.get("direction", "longitudinal"), place)
    triggering = condition.find("ByEntityCondition/TriggeringEntities")
    names = [] if triggering is None else [e.get("entityRef", "") for e in triggering]
    if element.tag == "SimulationTimeCondition":
        return rule(expected.times_s + 1e-9, value), []
    with np.errstate(all="ignore"):
        met = [rule(measure(name, element, expected, place), value) for name in names]
    if not met:
        raise fault_at(place, "nobody triggers it")
    assert triggering is not None
    unite = foreign.look_up(
        {"any": np.any, "all": np.all}, triggering.get("triggeringEntitiesRule", "any"), place
    )
    return unite(met, axis=0), [*names, *_list_refs(element)]


def _list_refs(element: Element) -> list[str]:
    """Whom an element names."""
    return [e.get("entityRef", "") for e in element.iter() if "entityRef" in e.attrib]


def _measure_gap(name: str, element: Element, expected: Expectation, place: str) -> FloatArray:
    """How far somebody is from another, or from a place."""
    own, position = expected.references(name, place), element.find("Position")
    if position is None:
        position = element.find("TimeToCollisionConditionTarget/Position")
    other = next(iter(_list_refs(element)), "")
    if position is not None:
        pose = expected.find_point(position, place)
        goals = np.array([[pose.x_m, pose.y_m]])
        if other:  # a place relative to somebody goes along
            states = expected.find_states(other, place)
            x_m, y_m, heading_rad, _ = states[0].tolist()
            first = Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad)
            goals = place_beside(states, *first.to_local(goals)[0].tolist())
        way = goals - own
    else:
        way = expected.references(other, place) - own
    kind = element.get("relativeDistanceType", element.get("distanceType", ""))
    heading_rad = expected.states[name][:, 2]
    ahead = way[:, 0] * np.cos(heading_rad) + way[:, 1] * np.sin(heading_rad)
    left = way[:, 1] * np.cos(heading_rad) - way[:, 0] * np.sin(heading_rad)
    gaps_m = dict.fromkeys(_STRAIGHT, np.hypot(ahead, left))
    gaps_m |= {"longitudinal": np.abs(ahead), "lateral": np.abs(left)}
    gap_m = foreign.look_up(gaps_m, kind, place)
    if foreign.look_up(_SWITCH, element.get("freespace", "false").lower(), place):
        sizes = expected.sizes_m[name], expected.sizes_m.get(other, (0.0, 0.0))
        gap_m = np.maximum(gap_m - sum(size[kind == "lateral"] for size in sizes) / 2.0, 0.0)
    return np.asarray(gap_m)


def _measure_collision(
    name: str, element: Element, expected: Expectation, place: str
) -> FloatArray:
    """Seconds until the gap closes; without an end where it doesn't."""
    gap_m = _measure_gap(name, element, expected, place)
    closing_mps = -np.gradient(gap_m, expected.times_s)
    return np.where(closing_mps > 1e-6, gap_m / closing_mps, np.inf)


def _measure_way(name: str, element: Element, expected: Expectation, place: str) -> FloatArray:
    places = expected.find_states(name, place)[:, :2]
    return np.cumsum(np.hypot(*np.diff(places, axis=0, prepend=places[:1]).T)) + 1e-9


def _measure_speed_over(
    name: str, element: Element, expected: Expectation, place: str
) -> FloatArray:
    others = [name, *_list_refs(element)[:1]]
    own_mps, mps = (expected.find_states(n, place)[:, 3] for n in (others[0], others[-1]))
    return np.asarray(own_mps - mps)


def _measure_standing(
    name: str, element: Element, expected: Expectation, place: str
) -> FloatArray:
    """Seconds since it moved last."""
    moves = ~(expected.find_states(name, place)[:, 3] <= _STANDING_MPS)
    last_s = np.maximum.accumulate(np.where(moves, expected.times_s, 0.0))
    return np.asarray(expected.times_s - last_s + 1e-9)
