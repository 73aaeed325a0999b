"""OpenSCENARIO files by hand: an ego at (20, -1.75) at 10 m/s on a straight road, and one other.

The road is 400 m long along x, with the lanes -1 and -2 that way and 1 back, 3.5 m wide each.
"""

from pathlib import Path
from typing import Any

from augment.formats.openscenario.scenario import OpenScenario
from augment.formats.reading import Reading
from augment.scene.motion import Motion, Movement, find_motion
from tests.formats.opendrive_maps import LANES, ROAD, WIDTH, by_hand

ROADS = by_hand(outer=f'<lane id="-2" type="driving">{WIDTH}</lane>').replace("100", "400")
BOX = (
    '<BoundingBox><Center x="1.4" y="0" z="0.9"/><Dimensions length="5" width="2" height="1.8"/>'
    "</BoundingBox>"
)
CAR = f'<Vehicle name="car" vehicleCategory="car">{BOX}</Vehicle>'
EGO_AT = '<WorldPosition x="20" y="-1.75" h="0"/>'
OTHER_AT = '<LanePosition roadId="1" laneId="-1" s="80"/>'
STEP = '<SpeedActionDynamics dynamicsShape="step" dynamicsDimension="time" value="0"/>'


def speed(mps: object, dynamics: str = STEP) -> str:
    target = f'<SpeedActionTarget><AbsoluteTargetSpeed value="{mps}"/></SpeedActionTarget>'
    return (
        f"<LongitudinalAction><SpeedAction>{dynamics}{target}</SpeedAction></LongitudinalAction>"
    )


def init(name: str, position: str, *actions: str) -> str:
    teleport = f"<TeleportAction><Position>{position}</Position></TeleportAction>"
    parts = "".join(f"<PrivateAction>{part}</PrivateAction>" for part in (teleport, *actions))
    return f'<Private entityRef="{name}">{parts}</Private>'


def event(action: str, condition: str = "", name: str = "acts") -> str:
    start = f"<StartTrigger><ConditionGroup>{condition}</ConditionGroup></StartTrigger>"
    inner = (
        action
        if action.startswith("<GlobalAction")
        else f"<PrivateAction>{action}</PrivateAction>"
    )
    return f'<Event name="{name}"><Action name="{name} it">{inner}</Action>{start}</Event>'


def by_time(seconds: object) -> str:
    time = f'<SimulationTimeCondition value="{seconds}" rule="greaterThan"/>'
    return f"<Condition><ByValueCondition>{time}</ByValueCondition></Condition>"


def by_entity(condition: str, who: str = "Other") -> str:
    triggering = f'<TriggeringEntities triggeringEntitiesRule="any"><EntityRef entityRef="{who}"/>'
    entity = f"</TriggeringEntities><EntityCondition>{condition}</EntityCondition>"
    return f"<Condition><ByEntityCondition>{triggering}{entity}</ByEntityCondition></Condition>"


def scenario(
    *events: str,
    other: str = CAR,
    other_at: str = OTHER_AT,
    other_does: tuple[str, ...] = (),
    ego: str = "Ego",
    head: str = "",
    logic: str = "roads.xodr",
    more: str = "",
) -> str:
    """A scenario in which the other acts in some events."""
    entities = "".join(
        f'<ScenarioObject name="{name}">{body}</ScenarioObject>'
        for name, body in ((ego, CAR), ("Other", other))
        if body
    )
    actions = init(ego, EGO_AT, speed(10)) + init("Other", other_at, *other_does)
    return (
        f'<OpenSCENARIO><FileHeader revMajor="1" revMinor="1"/>{head}'
        f'<RoadNetwork><LogicFile filepath="{logic}"/></RoadNetwork>'
        f"<Entities>{entities}</Entities><Storyboard><Init><Actions>{more}{actions}</Actions></Init>"
        '<Story name="s"><Act name="a"><ManeuverGroup name="g"><Actors>'
        f'<EntityRef entityRef="Other"/></Actors><Maneuver name="m">{"".join(events)}</Maneuver>'
        "</ManeuverGroup><StartTrigger>"
        f"<ConditionGroup>{by_time(0)}</ConditionGroup></StartTrigger></Act></Story></Storyboard>"
        "</OpenSCENARIO>"
    )


def write(folder: Path, text: str, **others: str) -> Path:
    """Write a scenario with its map, and other files."""
    for name, content in {"roads.xodr": ROADS, "made.xosc": text, **others}.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(content)
    return folder / "made.xosc"


def catalog(body: str, name: str = "Cars") -> str:
    head = '<FileHeader revMajor="1" revMinor="0"/>'
    return f'<OpenSCENARIO>{head}<Catalog name="{name}">{body}</Catalog></OpenSCENARIO>'


# Parts of events

BRAKES = speed(0, STEP.replace("step", "linear").replace('"0"', '"2"'))
GAP = (
    '<RelativeDistanceCondition entityRef="Ego" value="{}" rule="lessThan" freespace="{}" '
    'relativeDistanceType="longitudinal"/>'
)
CHANGE = (
    '<LateralAction><LaneChangeAction><LaneChangeActionDynamics dynamicsShape="sinusoidal" '
    'dynamicsDimension="{}" value="{}"/><LaneChangeTarget>{}</LaneChangeTarget>'
    "</LaneChangeAction></LateralAction>"
)
RIGHT = '<RelativeTargetLane entityRef="Other" value="-1"/>'
OF_EGO = '<RelativeTargetLane entityRef="Ego" value="-1"/>'
AFTER = (
    '<Condition delay="0"><ByValueCondition><StoryboardElementStateCondition storyboardElementRef='
    '"acts" storyboardElementType="event" state="completeState"/></ByValueCondition></Condition>'
)
FOLLOW = (
    '<RoutingAction><FollowTrajectoryAction><Trajectory name="t" closed="false"><Shape><Polyline>'
    "{}</Polyline></Shape></Trajectory><TimeReference>{}</TimeReference>"
    '<TrajectoryFollowingMode followingMode="position"/></FollowTrajectoryAction></RoutingAction>'
)
TIMING = '<Timing domainAbsoluteRelative="{}" scale="1" offset="0"/>'


def read(file: Path, item: str | None = None) -> Reading:
    return OpenScenario().read(file, item=item, frame=None, name="made")


def moves(reading: Reading) -> Motion:
    return find_motion(reading.scene, recording=reading.recording, with_later=True)


def move_other(folder: Path, *events: str, mps: object = 4, **parts: Any) -> Movement:
    """What the other does that drives at that speed at first."""
    text = scenario(*events, other_does=(speed(mps),), **parts)
    return moves(read(write(folder, text))).others[0]


def follow(shape: str, times: str = "<None/>") -> str:
    """Along a shape, or a line of vertices."""
    line = FOLLOW.format(shape if "<Vertex" in shape else "", times)
    return line if "<Vertex" in shape else line.replace("<Polyline></Polyline>", shape)


def vertices(*places: tuple[object, object], y: float = -1.75) -> str:
    """By time and x."""
    at = '<Position><WorldPosition x="{}" y="{}" h="0"/></Position>'
    return "".join(f'<Vertex time="{time}">{at.format(x, y)}</Vertex>' for time, x in places)


def route(*waypoints: tuple[int, float], roads: str = "11") -> str:
    return "".join(
        f'<Waypoint routeStrategy="shortest"><Position><LanePosition roadId="{road}" '
        f'laneId="{lane}" s="{s}"/></Position></Waypoint>'
        for road, (lane, s) in zip(roads, waypoints, strict=True)
    )


def on_route(inside: str, *waypoints: tuple[int, float], roads: str = "11") -> str:
    made = f"<RouteRef><Route>{route(*waypoints, roads=roads)}</Route></RouteRef>"
    return f"<RoutePosition>{made}<InRoutePosition>{inside}</InRoutePosition></RoutePosition>"


def fork() -> str:
    """Road 1 of 100 m forks into road 2, straight on, and road 4, which bends to the left."""
    parts = {"junction": "9", "more": "", "type": "", "x": "100", "offset": "", "end": ""}
    parts |= {"lanes": LANES.format(width=WIDTH, outer=""), "link": ""}
    ways = {"2": "<line/>", "4": '<arc curvature="0.01"/>'}
    roads = "".join(ROAD.format(id=n, shape=shape, **parts) for n, shape in ways.items())
    joints = "".join(
        f'<connection incomingRoad="1" connectingRoad="{n}" contactPoint="start">'
        '<laneLink from="-1" to="-1"/></connection>'
        for n in ways
    )
    link = '<link><successor elementType="junction" elementId="9"/></link>'
    return by_hand(link=link, rest=f'{roads}<junction id="9">{joints}</junction>')
