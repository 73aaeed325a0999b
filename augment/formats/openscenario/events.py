"""Events of a storyboard, by who acts in them, with their triggers and actions still as XML."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element

from augment import foreign
from augment.foreign import Doubts, FloatArray, fault_at
from augment.formats.opendrive.geometry import read_float
from augment.formats.openscenario.sources import ScenarioSource

ACTIONS = {
    "SpeedAction": "LongitudinalAction/SpeedAction",
    "LaneChangeAction": "LateralAction/LaneChangeAction",
    "FollowTrajectoryAction": "RoutingAction/FollowTrajectoryAction",
}
GONE = "DeleteEntityAction"
_COMES = "AddEntityAction"
_TIME = "ByValueCondition/SimulationTimeCondition"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoryEvent:
    """One event of one actor.

    Attributes:
        names: Of itself and its actions, by which others wait for it.
        groups: Conditions (and) in groups (or) by which it begins; empty for at once.
        actions: Those that are read, by their kinds.
    """

    place: str
    names: tuple[str, ...]
    groups: tuple[tuple[Element, ...], ...]
    actions: tuple[tuple[str, Element], ...] = field(default=())

    @property
    def time_s(self) -> float | None:
        """When it begins if a time alone says that, None otherwise."""
        if not self.groups:
            return 0.0
        times = [condition.find(_TIME) for group in self.groups for condition in group]
        if len(times) != 1 or times[0] is None:
            return None
        delay_s = foreign.read_number(self.groups[0][0].get("delay") or "0", self.place)
        return max(read_float(times[0], "value", self.place) + delay_s, 0.0)


def list_events(source: ScenarioSource) -> dict[str, list[StoryEvent]]:
    """Return everybody's events in the order of the file; what is left out is noted."""
    events, doubts = defaultdict[str, list[StoryEvent]](list), source.doubts
    for act in source.root.findall("Storyboard/Story/Act"):
        begins = _list_conditions(act)
        for group in act.findall("ManeuverGroup"):
            maneuvers = group.findall("Maneuver")
            for reference in group.findall("CatalogReference"):
                with doubts.about("maneuvers"):
                    maneuvers.append(source.resolve_reference(reference))
            names = [row.get("entityRef", "") for row in group.findall("Actors/EntityRef")]
            for event in (event for maneuver in maneuvers for event in maneuver.findall("Event")):
                for actor, made in _split(event, names, begins, doubts):
                    events[actor].append(made)
    return events


def describe_action(action: Element) -> str:
    """Return the name of what is done: the innermost element that is called an action."""
    inner = [child.tag for child in action.iter() if child.tag.endswith("Action")]
    return inner[-1] if inner else action.tag


def read_vertices(action: Element, place: str) -> tuple[list[Element], FloatArray | None]:
    """Return the positions of a trajectory's polyline, and their times unless none count.

    Raises:
        InvalidDocument: It is none of vertices, or has fewer than two.
    """
    vertices = list(action.iter("Vertex"))
    positions = [position for vertex in vertices for position in vertex.findall("Position")]
    if len(vertices) < 2 or len(positions) != len(vertices):
        raise fault_at(place, "a trajectory needs a Polyline of two vertices at least")
    if action.find("TimeReference/Timing") is None or any(
        "time" not in v.attrib for v in vertices
    ):
        return positions, None
    times_s = foreign.read_finite([v.get("time") for v in vertices], f"{place}.Vertex", 1)[:, 0]
    if (times_s[1:] < times_s[:-1]).any():
        raise fault_at(f"{place}.Vertex", "needs times that ascend")
    return positions, times_s


# Private


def _list_conditions(owner: Element) -> tuple[tuple[Element, ...], ...]:
    """Conditions that say more than that the scenario has begun, by groups."""
    groups = []
    for group in owner.findall("StartTrigger/ConditionGroup"):
        conditions = group.findall("Condition")
        groups.append(tuple(c for c in conditions if not _holds_at_once(c)))
    return () if not all(groups) else tuple(groups)


def _holds_at_once(condition: Element) -> bool:
    time = condition.find(_TIME)
    is_zero = time is not None and (time.get("value") or "").strip("0.") == ""
    return is_zero and not (condition.get("delay") or "0").strip("0.")


def _split(
    event: Element, actors: list[str], begins: tuple[tuple[Element, ...], ...], doubts: Doubts
) -> Iterator[tuple[str, StoryEvent]]:
    """Yield an event for each of those who act in it."""
    place, groups = f"event {event.get('name', '')[:60]}", _list_conditions(event)
    if begins and groups and begins != groups:
        doubts.assume("An act's own start was left out: its events have theirs")
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
            doubts.assume(f"{kind} was left out, first in {place}")
        else:
            actions.append((kind, found))
    names = (event.get("name", ""), *(a.get("name", "") for a in event.findall("Action")))
    made = StoryEvent(place=place, names=names, groups=groups or begins, actions=tuple(actions))
    for actor in sorted(owners) if actions else ():
        yield actor, made
