"""Trajectories of OpenSCENARIO as the middles of who follows them. V points."""

import math
from dataclasses import replace
from itertools import pairwise
from xml.etree.ElementTree import Element

import numpy as np

from augment import foreign
from augment.foreign import FloatArray, fault_at
from augment.formats.opendrive.geometry import LONGEST_M, SHARPEST_PM, LinePiece, read_float
from augment.formats.openscenario.positions import PositionReader
from augment.geometry.frames import Pose, wrap

_TIMING = {"scale": 1.0, "offset": 0.0}


def trace(
    action: Element, centre_m: tuple[float, float], placer: PositionReader, place: str
) -> tuple[FloatArray, FloatArray | None]:
    """Return x, y, heading of middles (V, 3) along a trajectory, and times unless none count.

    Args:
        action: Follows it.
        centre_m: From the point of reference to the middle, ahead and to the left.
        placer: Knows where others are.
        place: Where it stands.

    Raises:
        InvalidDocument: It is neither of vertices nor a clothoid, or leads off the map.
    """
    spiral = next(action.iter("Clothoid"), None)
    poses, times_s = (
        _follow_vertices(action, placer, place)
        if spiral is None
        else _follow_clothoid(spiral, placer, f"{place}.Clothoid")
    )
    timing = action.find("TimeReference/Timing")
    if timing is None:
        times_s = None
    elif times_s is not None:
        domain = timing.get("domainAbsoluteRelative")
        foreign.look_up(dict.fromkeys(("absolute", "relative")), domain, f"{place}.Timing")
        scale, offset_s = (read_float(timing, n, place, default=d) for n, d in _TIMING.items())
        times_s = times_s * scale + offset_s
        if (np.diff(times_s) < 0.0).any() or times_s[0] == times_s[-1]:
            raise fault_at(place, "needs times that ascend")
    return np.array([find_middle(pose, centre_m) for pose in poses]), times_s


def find_middle(pose: Pose, centre_m: tuple[float, float]) -> FloatArray:
    """Return x, y, heading (3,) of the middle of a box whose point of reference is there."""
    x_m, y_m = pose.to_parent(np.array([centre_m]))[0].tolist()
    return np.array([x_m, y_m, pose.heading_rad])


# Private


def _follow_vertices(
    action: Element, placer: PositionReader, place: str
) -> tuple[list[Pose], FloatArray | None]:
    """Poses at vertices; without a heading, that of the way on."""
    vertices = list(action.iter("Vertex"))
    has_times = action.find("TimeReference/Timing") is not None and all(
        "time" in vertex.attrib for vertex in vertices
    )
    is_closed = any(t.get("closed", "").lower() == "true" for t in action.iter("Trajectory"))
    if is_closed and not has_times:  # nobody says when it would be back at its first
        vertices += vertices[:1]
    positions = [position for vertex in vertices for position in vertex.findall("Position")]
    if len(vertices) < 2 or len(positions) != len(vertices):
        raise fault_at(place, "a trajectory needs a Clothoid, or a Polyline of two vertices")
    poses = [placer.find_pose(position, place) for position in positions]
    worlds = [position.find("WorldPosition") for position in positions]
    bare = [world is not None and "h" not in world.attrib for world in worlds]
    for row, (here, following) in enumerate(pairwise(poses)):
        way = following.x_m - here.x_m, following.y_m - here.y_m
        if bare[row] and math.hypot(*way) > 1e-6:
            poses[row] = replace(here, heading_rad=math.atan2(way[1], way[0]))
    if bare[-1]:
        poses[-1] = replace(poses[-1], heading_rad=poses[-2].heading_rad)
    if not has_times:
        return poses, None
    times = [vertex.get("time") for vertex in vertices]
    return poses, foreign.read_finite(times, f"{place}.Vertex", 1)[:, 0]


def _follow_clothoid(
    spiral: Element, placer: PositionReader, place: str
) -> tuple[list[Pose], FloatArray | None]:
    position = spiral.find("Position")
    if position is None:
        raise fault_at(place, "needs a Position")
    length_m = read_float(spiral, "length", place, 0.01, LONGEST_M)
    first_pm = read_float(spiral, "curvature", place, -SHARPEST_PM, SHARPEST_PM)
    rate = "curvatureDot" if "curvatureDot" in spiral.attrib else "curvaturePrime"
    last_pm = foreign.read_number(
        first_pm + length_m * read_float(spiral, rate, place, default=0.0),
        f"{place}: curvature at its end",
        -SHARPEST_PM,
        SHARPEST_PM,
    )
    start = placer.find_pose(position, place)
    piece = LinePiece(start=start, length_m=length_m, curvatures_pm=(first_pm, last_pm))
    rows = piece.poses_at(np.linspace(0.0, length_m, math.ceil(length_m) + 1)).tolist()
    poses = [Pose(x_m=x_m, y_m=y_m, heading_rad=wrap(rad)) for x_m, y_m, rad in rows]
    if not {"startTime", "stopTime"} <= spiral.attrib.keys():
        return poses, None
    start_s, stop_s = (read_float(spiral, n, place, 0.0) for n in ("startTime", "stopTime"))
    return poses, np.linspace(start_s, stop_s, len(poses))
