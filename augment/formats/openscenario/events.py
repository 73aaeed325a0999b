"""Events of a storyboard, by who acts in them, with their triggers and actions still as XML."""

from collections import defaultdict
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from xml.etree.ElementTree import Element

from augment import foreign
from augment.foreign import Doubts
from augment.formats.opendrive.geometry import read_float
from augment.formats.openscenario.sources import ScenarioSource

ACTIONS = {
    "SpeedAction": "LongitudinalAction/SpeedAction",
    "LaneChangeAction": "LateralAction/LaneChangeAction",
    "FollowTrajectoryAction": "RoutingAction/FollowTrajectoryAction",
    "AssignRouteAction": "RoutingAction/AssignRouteAction",
}
GONE = "DeleteEntityAction"
_COMES = "AddEntityAction"
_TIME = "ByValueCondition/SimulationTimeCondition"
WAIT = "ByValueCondition/StoryboardElementStateCondition"
BEGUN = ("startTransition", "runningState")
ENDED = ("endTransition", "completeState", "stopTransition")
_ONSETS = ("none", "rising", "carla:latched")
_SINCE = ("greaterThan", "greaterOrEqual", "equalTo")
"""The rules by which a time is one from which on something holds."""
Groups = tuple[tuple[Element, ...], ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoryEvent:
    """One event of one actor.

    Attributes:
        names: Of itself and its actions, by which others wait for it.
        groups: Conditions (and) in groups (or) by which it begins once its act has; empty for
            at once.
        actions: Those that are read, by their kinds.
        begins: Conditions by which the act begins, likewise.
        around: Names of the story, act, group and maneuver that it is in.
        time_s: When it begins if times alone say that, None otherwise.
    """

    place: str
    names: tuple[str, ...]
    groups: Groups
    actions: tuple[tuple[str, Element], ...]
    begins: Groups = ()
    around: tuple[str, ...] = ()
    time_s: float | None = 0.0

    @property
    def conditions(self) -> list[Element]:
        """All of them, the act's first."""
        return [condition for group in (*self.begins, *self.groups) for condition in group]

    @property
    def waits_for(self) -> Element | None:
        """What it waits for if one element of the storyboard alone says when, None otherwise."""
        wait = self.conditions[0].find(WAIT) if len(self.conditions) == 1 else None
        return None if wait is None or has_begun(wait, self.around) else wait


def list_events(source: ScenarioSource) -> dict[str, list[StoryEvent]]:
    """Return everybody's events in the order of the file; what is left out is noted."""
    events, doubts = defaultdict[str, list[StoryEvent]](list), source.doubts
    for story in source.root.findall("Storyboard/Story"):
        for act in _list_beginning(story, "Act", doubts):
            begins = _list_conditions(act, ())
            for group in act.findall("ManeuverGroup"):
                actors = [row.get("entityRef", "") for row in group.findall("Actors/EntityRef")]
                for maneuver in group.findall("Maneuver"):
                    around = tuple(e.get("name", "") for e in (story, act, group, maneuver))
                    for event in _list_beginning(maneuver, "Event", doubts):
                        for actor, made in _split(event, actors, doubts):
                            made = replace(made, begins=begins, around=around)
                            with doubts.about("events"):
                                events[actor].append(_with_conditions(made, event))
    return events


def has_begun(wait: Element, around: Collection[str]) -> bool:
    """Return whether a condition waits for what it is in, which has begun before."""
    name = wait.get("storyboardElementRef", "").split("::")[-1]
    return name in around and wait.get("state") in BEGUN


def describe_action(action: Element) -> str:
    """Return the name of what is done: the innermost element that is called an action."""
    inner = [child.tag for child in action.iter() if child.tag.endswith("Action")]
    return inner[-1] if inner else action.tag


# Private


def _list_beginning(owner: Element, tag: str, doubts: Doubts) -> list[Element]:
    """Return the acts or events that can begin: no trigger fires at once, an empty one never."""
    parts = owner.findall(tag)
    idle = [part for part in parts if not all(map(len, part.findall("StartTrigger")))]
    doubts.assume(f"An {tag.lower()} whose StartTrigger is empty never begins", len(idle))
    return [part for part in parts if part not in idle]


def _with_conditions(made: StoryEvent, event: Element) -> StoryEvent:
    groups = _list_conditions(event, made.around)
    times_s = [_find_time(each, made.place) for each in (made.begins, groups)]
    known_s = [time_s for time_s in times_s if time_s is not None]
    return replace(made, groups=groups, time_s=max(known_s) if len(known_s) == 2 else None)


def _list_conditions(owner: Element, around: tuple[str, ...]) -> Groups:
    """Conditions that say more than that what is around has begun, by groups."""
    groups = []
    for group in owner.findall("StartTrigger/ConditionGroup"):
        conditions = group.findall("Condition")
        groups.append(tuple(c for c in conditions if not _holds_at_once(c, around)))
    return () if not all(groups) else tuple(groups)


def _holds_at_once(condition: Element, around: tuple[str, ...]) -> bool:
    if (condition.get("delay") or "0").strip("0."):
        return False
    time, state = condition.find(_TIME), condition.find(WAIT)
    if state is not None:
        return has_begun(state, around)
    is_since = time is not None and time.get("rule", _SINCE[0]) in _SINCE
    return time is not None and is_since and (time.get("value") or "").strip("0.") == ""


def _find_time(groups: Groups, place: str) -> float | None:
    """When conditions hold if they are a time alone, None otherwise."""
    conditions = [condition for group in groups for condition in group]
    if not conditions:
        return 0.0
    time, edge = conditions[0].find(_TIME), conditions[0].get("conditionEdge", "none")
    is_since = time is not None and time.get("rule", _SINCE[0]) in _SINCE
    if time is None or not is_since or len(conditions) > 1 or edge not in _ONSETS:
        return None
    delay_s = foreign.read_number(conditions[0].get("delay") or "0", place)
    return max(read_float(time, "value", place) + delay_s, 0.0)


def _split(event: Element, actors: list[str], doubts: Doubts) -> Iterator[tuple[str, StoryEvent]]:
    """Yield an event for each of those who act in it."""
    place = f"event {event.get('name', '')[:60]}"
    actions, owners = [], set(actors)
    for action in event.findall("Action"):
        entity = action.find("GlobalAction/EntityAction")
        kind = describe_action(action)
        if entity is not None and kind in (GONE, _COMES):
            owners = {entity.get("entityRef", "")}
            actions += [(kind, entity)] if kind == GONE else []
            continue
        found = action.find(f"PrivateAction/{ACTIONS.get(kind, '-')}")
        if found is None:
            doubts.faults[kind].append(place)
        else:
            actions.append((kind, found))
    names = (event.get("name", ""), *(a.get("name", "") for a in event.findall("Action")))
    for actor in sorted(owners) if actions else ():
        yield actor, StoryEvent(place=place, names=names, groups=(), actions=tuple(actions))
