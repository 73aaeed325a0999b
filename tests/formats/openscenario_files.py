"""OpenSCENARIO files by hand: an ego at (20, -1.75) at 10 m/s on a straight road, and one other.

The road is 400 m long along x, with the lanes -1 and -2 that way and 1 back, 3.5 m wide each.
"""

from pathlib import Path

from tests.formats.opendrive_maps import WIDTH, by_hand

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
