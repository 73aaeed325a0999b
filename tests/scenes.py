"""Small hand-made scenes whose right answers can be seen by eye."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from augment.geometry.frames import Pose, wrap
from augment.geometry.polyline import Polyline
from augment.scene import entities

EGO = entities.TrafficAgent(
    id="Agent1",
    type=entities.AgentType.EGO_VEHICLE,
    x_m=0.0,
    y_m=0.0,
    heading_rad=0.0,
    width_m=2.297,
    length_m=5.176,
    speed_mps=8.0,
    lane_id="Lane1",
)


_LINES = ("centerline", "left_boundary", "right_boundary")


def vehicle(
    name: str, x_m: float, y_m: float, heading_rad: float = 0.0, **parts: Any
) -> entities.TrafficAgent:
    """A parked car; its parts may be others, as those of whatever is below."""
    made: dict[str, Any] = {"id": name, "x_m": x_m, "y_m": y_m, "heading_rad": heading_rad}
    made |= {"type": entities.AgentType.VEHICLE, "width_m": 2.0, "length_m": 4.8}
    return entities.TrafficAgent(**made | parts)


def cone(name: str, x_m: float, y_m: float, **parts: Any) -> entities.TrafficAgent:
    made: dict[str, Any] = {"type": entities.AgentType.TRAFFIC_CONE}
    return vehicle(name, x_m, y_m, **made | {"width_m": 0.5, "length_m": 0.5} | parts)


def pedestrian(
    name: str, x_m: float, y_m: float, walk_to_m: entities.Point | None = None, **parts: Any
) -> entities.TrafficAgent:
    heading = 0.0 if walk_to_m is None else math.atan2(walk_to_m[1] - y_m, walk_to_m[0] - x_m)
    made: dict[str, Any] = {"type": entities.AgentType.PEDESTRIAN, "walk_to_m": walk_to_m}
    made |= {"heading_rad": heading, "width_m": 0.791, "length_m": 0.9}
    return vehicle(name, x_m, y_m, **made | parts)


def lane(name: str, points_m: ArrayLike, **parts: Any) -> entities.Lane:
    """A lane 3.5 m wide."""
    return entities.Lane(id=name, centerline=Polyline(points_m), width_m=3.5, **parts)


def connector(
    name: str, start: str | None, end: str | None, points_m: ArrayLike, **parts: Any
) -> entities.LaneConnector:
    """A way from one lane to another, as wide as they are."""
    line, width_m = Polyline(points_m), parts.pop("width_m", 3.5)
    return entities.LaneConnector(
        id=name, from_lane=start, to_lane=end, centerline=line, width_m=width_m, **parts
    )


def lanes(
    *lefts_m: float,
    oncoming_m: Sequence[float] = (),
    ends_m: tuple[float, float] = (-50.0, 200.0),
    **parts: Any,
) -> tuple[entities.Lane, ...]:
    """Neighbours along the ego's way, so far left of it, its own first; then oncoming ones."""
    begin_m, end_m = ends_m
    names = [f"Lane{number}" for number in range(1, len(lefts_m) + 1)]
    beside = zip(names, lefts_m, [*names[1:], None], [None, *names[:-1]], strict=True)
    made = [
        lane(
            name, [(begin_m, y_m), (end_m, y_m)], left_neighbor=left, right_neighbor=right, **parts
        )
        for name, y_m, left, right in beside
    ]
    for y_m in oncoming_m:
        made.append(lane(f"Lane{len(made) + 1}", [(end_m, y_m), (begin_m, y_m)], **parts))
    return tuple(made)


def strip(name: str, kind: entities.AreaKind, low_m: float, high_m: float) -> entities.Area:
    """An area along the ego's way, from x = -50 to 100 m."""
    boundary_m = ((-50.0, low_m), (100.0, low_m), (100.0, high_m), (-50.0, high_m))
    return entities.Area(id=name, kind=kind, boundary_m=boundary_m)


def scene(**changes: object) -> entities.Scene:
    """A straight two-way street, right-hand traffic: Lane1 is the ego's, Lane2 comes towards it.

    Both lanes are 3.5 m wide and run from x = -50 m to x = 100 m; a walkway on either side.
    """
    made = entities.Scene(
        name="street",
        ego=EGO,
        traffic_side=entities.TrafficSide.RIGHT,
        origin=entities.Origin(frame="test", x_m=0.0, y_m=0.0, heading_rad=0.0),
        provenance="made for a test",
        lanes=lanes(0.0, oncoming_m=(3.5,), ends_m=(-50.0, 100.0), speed_limit_mps=13.9),
        areas=(
            strip("Area1", entities.AreaKind.DRIVABLE, -1.75, 5.25),
            strip("Area2", entities.AreaKind.WALKWAY, -4.25, -1.75),
            strip("Area3", entities.AreaKind.WALKWAY, 5.25, 7.75),
        ),
    )
    return replace(made, **changes)  # type: ignore[arg-type]


def curve(radius_m: float = 40.0) -> entities.Scene:
    """One lane that bends left on a circle of that radius around (0, radius), after 10 m straight.

    Where the bend has turned by an angle a, the lane is at x = 10 + r sin a, y = r (1 - cos a).
    """
    angles = np.linspace(0.0, math.pi / 2.0, 91)
    bend = np.column_stack([10.0 + radius_m * np.sin(angles), radius_m * (1.0 - np.cos(angles))])
    points = np.vstack([[[-50.0, 0.0], [0.0, 0.0]], bend])
    return scene(name="curve", lanes=(lane("Lane1", points, speed_limit_mps=8.3),), areas=())


def junction() -> entities.Scene:
    """Lane1 ends at x = 20 m; connectors lead straight on (Lane2) and to the left (Lane3)."""
    green, red = entities.TrafficLight.GREEN, entities.TrafficLight.RED
    turn = entities.TurnType.LEFT
    left = [
        (20.0 + 8.0 * math.sin(a), 8.0 - 8.0 * math.cos(a)) for a in np.linspace(0, 1.5708, 19)
    ]
    return scene(
        name="junction",
        lanes=(
            lane("Lane1", [(-50, 0), (20, 0)]),
            lane("Lane2", [(36, 0), (100, 0)]),
            lane("Lane3", [(28, 8), (28, 60)]),
        ),
        connectors=(
            connector("Connector1", "Lane1", "Lane2", [(20, 0), (36, 0)], traffic_light=green),
            connector("Connector2", "Lane1", "Lane3", left, traffic_light=red, turn_type=turn),
        ),
        areas=(),
    )


def pose_in_parent(frame: Pose, seen: Pose) -> Pose:
    """A pose seen from another, in the frame that one is given in."""
    x_m, y_m = frame.to_parent(np.array([[seen.x_m, seen.y_m]]))[0].tolist()
    return Pose(x_m=x_m, y_m=y_m, heading_rad=wrap(seen.heading_rad + frame.heading_rad))


def moved_scene(scene: entities.Scene, frame: Pose, flip: float = 1.0) -> entities.Scene:
    """The whole scene, ego included, mirrored at the x axis (flip -1) and carried to a frame."""

    def way(given: Any) -> Any:
        lines = {name: getattr(given, name) for name in _LINES}
        return replace(
            given,
            **{
                name: line and Polyline(frame.to_parent(line.points_m * (1.0, flip)))
                for name, line in lines.items()
            },
        )

    return replace(
        scene,
        ego=moved_agent(scene.ego, frame, flip),
        agents=tuple(moved_agent(agent, frame, flip) for agent in scene.agents),
        lanes=tuple(map(way, scene.lanes)),
        connectors=tuple(map(way, scene.connectors)),
        areas=tuple(
            replace(area, boundary_m=_moved_points(area.boundary_m, frame, flip))
            for area in scene.areas
        ),
    )


def moved_agent(
    agent: entities.TrafficAgent, frame: Pose, flip: float = 1.0
) -> entities.TrafficAgent:
    ((x_m, y_m),) = _moved_points([(agent.x_m, agent.y_m)], frame, flip)
    walk_to_m = agent.walk_to_m and _moved_points([agent.walk_to_m], frame, flip)[0]
    heading_rad = wrap(flip * agent.heading_rad + frame.heading_rad)
    return replace(agent, x_m=x_m, y_m=y_m, heading_rad=heading_rad, walk_to_m=walk_to_m)


def _moved_points(
    points: Sequence[entities.Point], frame: Pose, flip: float
) -> tuple[entities.Point, ...]:
    moved = frame.to_parent(np.array(points) * (1.0, flip))
    return tuple((float(x_m), float(y_m)) for x_m, y_m in moved)
