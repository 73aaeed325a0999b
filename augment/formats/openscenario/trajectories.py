"""Trajectories of OpenSCENARIO as the middles of who follows them. V points."""

import math
from collections.abc import Callable
from itertools import pairwise
from xml.etree.ElementTree import Element

import numpy as np

from augment import foreign
from augment.foreign import FloatArray, fault_at
from augment.formats.opendrive.geometry import LONGEST_M, SHARPEST_PM, LinePiece, read_float
from augment.formats.openscenario.positions import PositionReader
from augment.geometry.frames import Pose

_ENDS = ("curvatureStart", "curvatureEnd")
_TIMING = {"scale": 1.0, "offset": 0.0}
_HIGHEST_ORDER = 10
_PER_POINT, _MOST_PLACES = 50, 5_000
"""Places on a NURBS for each of its control points, and in all."""
Traced = tuple[FloatArray, FloatArray | None]


def trace(
    action: Element, centre_m: tuple[float, float], placer: PositionReader, place: str
) -> Traced:
    """Return x, y, heading of middles (V, 3) along a trajectory, and times unless none count.

    Args:
        action: Follows it.
        centre_m: From the point of reference to the middle, ahead and to the left.
        placer: Knows where everybody is, and who follows it.
        place: Where it stands.

    Raises:
        InvalidDocument: It has no shape that is read, or leads off the map.
    """
    shape = next(action.iterfind(".//Shape/*"), Element("no Shape"))
    timing = action.find("TimeReference/Timing")
    if read_float(action, "initialDistanceOffset", place, default=0.0) > 0.0:
        raise fault_at(place, "begins inside its trajectory, by initialDistanceOffset")
    shapes: dict[str, Callable[[Element, Element, PositionReader, str], Traced]] = {
        "Polyline": _follow_vertices,
        "Clothoid": _follow_spirals,
        "ClothoidSpline": _follow_spirals,
        "Nurbs": _follow_nurbs,
    }
    follow = foreign.look_up(shapes, shape.tag, place)
    rows, times_s = follow(shape, action, placer, f"{place}.{shape.tag}")
    if timing is None:
        times_s = None
    elif times_s is not None:
        domain = timing.get("domainAbsoluteRelative")
        foreign.look_up(dict.fromkeys(("absolute", "relative")), domain, f"{place}.Timing")
        scale, offset_s = (read_float(timing, n, place, default=d) for n, d in _TIMING.items())
        times_s = times_s * scale + offset_s
        if (np.diff(times_s) < 0.0).any() or times_s[0] == times_s[-1]:
            raise fault_at(place, "needs times that ascend")
    return np.column_stack([place_beside(rows, *centre_m), rows[:, 2]]), times_s


def place_beside(states: FloatArray, ahead_m: float, left_m: float) -> FloatArray:
    """Return places (V, 2) so far ahead and to the left of states (V, 3 or more)."""
    cos, sin = np.cos(states[:, 2]), np.sin(states[:, 2])
    away = np.column_stack([ahead_m * cos - left_m * sin, ahead_m * sin + left_m * cos])
    return np.asarray(states[:, :2] + away)


# Private


def _list_poses(placer: PositionReader, positions: list[Element], place: str) -> FloatArray:
    """Poses (V, 3)."""
    poses = [placer.find_pose(position, place) for position in positions]
    return np.array([(pose.x_m, pose.y_m, pose.heading_rad) for pose in poses]).reshape(-1, 3)


def _follow_vertices(
    shape: Element, action: Element, placer: PositionReader, place: str
) -> Traced:
    """Rows at vertices; without a heading, that of the way on."""
    vertices = shape.findall("Vertex")
    has_times = action.find("TimeReference/Timing") is not None and all(
        "time" in vertex.attrib for vertex in vertices
    )
    is_closed = {t.get("closed", "").lower() for t in action.iter("Trajectory")} & {"true", "1"}
    if is_closed and not has_times:  # nobody says when it would be back at its first
        vertices += vertices[:1]
    positions = [position for vertex in vertices for position in vertex.findall("Position")]
    if len(vertices) < 2 or len(positions) != len(vertices):
        raise fault_at(place, "needs two vertices at least, each with a Position")
    rows = _list_poses(placer, positions, place)
    worlds = [position.find("WorldPosition") for position in positions]
    bare = np.array([world is not None and "h" not in world.attrib for world in worlds])
    ways = np.diff(rows[:, :2], axis=0)
    turned = bare[:-1] & (np.hypot(*ways.T) > 1e-6)
    rows[:-1][turned, 2] = np.arctan2(*ways[turned, ::-1].T)
    if bare[-1]:
        rows[-1, 2] = rows[-2, 2]
    if not has_times:
        return rows, None
    times = [vertex.get("time") for vertex in vertices]
    return rows, foreign.read_finite(times, place, 1)[:, 0]


def _follow_spirals(shape: Element, action: Element, placer: PositionReader, place: str) -> Traced:
    """Rows a metre apart along a clothoid, or several that go on from each other."""
    parts, pose, bounds = list[FloatArray](), None, (-SHARPEST_PM, SHARPEST_PM)
    is_spline = shape.tag == "ClothoidSpline"
    names = ("timeStart", "timeEnd") if is_spline else ("startTime", "stopTime")
    # Some call a segment by its type.
    segments = shape.findall("Segment") + shape.findall("ClothoidSplineSegment") or [shape]
    for segment in segments:
        length_m = read_float(segment, "length", place, 0.01, LONGEST_M)
        if is_spline:
            first_pm, last_pm = (read_float(segment, n, place, *bounds) for n in _ENDS)
        else:
            first_pm = read_float(segment, "curvature", place, *bounds)
            rate = "curvatureDot" if "curvatureDot" in segment.attrib else "curvaturePrime"
            last_pm = first_pm + length_m * read_float(segment, rate, place, default=0.0)
            last_pm = foreign.read_number(last_pm, f"{place}: curvature at its end", *bounds)
        for position in (*segment.findall("Position"), *segment.findall("PositionStart")):
            pose = placer.find_pose(position, place)
        pose = pose or placer.entity_pose(placer.actor)
        pose = pose.turn(read_float(segment, "hOffset", place, default=0.0))
        piece = LinePiece(start=pose, length_m=length_m, curvatures_pm=(first_pm, last_pm))
        parts.append(piece.poses_at(np.linspace(0.0, length_m, math.ceil(length_m) + 1)))
        x_m, y_m, heading_rad = parts[-1][-1].tolist()
        pose = Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad)
    moments = [*(segment.get(names[0]) for segment in segments), shape.get(names[1])]
    if all(moment is None for moment in moments):
        return np.vstack(parts), None
    times_s = [foreign.read_number(moment, f"{place}: times", 0.0) for moment in moments]
    spans = zip(pairwise(times_s), parts, strict=True)
    return np.vstack(parts), np.concatenate([np.linspace(*s, len(part)) for s, part in spans])


def _follow_nurbs(shape: Element, action: Element, placer: PositionReader, place: str) -> Traced:
    """Rows along the curve, with its headings."""
    from scipy.interpolate import BSpline

    order = foreign.read_whole(shape.get("order"), f"{place}.order", 2, _HIGHEST_ORDER)
    points, knots = (shape.findall(name) for name in ("ControlPoint", "Knot"))
    knot_values = [read_float(knot, "value", f"{place}.Knot") for knot in knots]
    positions = [position for point in points for position in point.findall("Position")]
    if not len(points) == len(positions) == len(knots) - order >= order:
        raise fault_at(place, f"needs {order} control points at least, and {order} knots more")
    if sorted(knot_values) != knot_values or knot_values[order - 1] >= knot_values[-order]:
        raise fault_at(place, "needs knots that ascend")
    weights = [read_float(point, "weight", place, 1e-3, 1e3, default=1.0) for point in points]
    values = _list_poses(placer, positions, place)[:, :2]
    has_times = all("time" in point.attrib for point in points)
    if has_times:
        values = np.column_stack([values, [read_float(p, "time", place) for p in points]])
    weighted = np.column_stack([values, np.ones(len(points))]) * np.array(weights)[:, None]
    places = min(_PER_POINT * len(points), _MOST_PLACES)
    at = np.linspace(knot_values[order - 1], knot_values[-order], places)
    made = BSpline(np.array(knot_values), weighted, order - 1)(at)
    made = made[:, :-1] / made[:, -1:]
    turn_rad = np.arctan2(*np.gradient(made[:, 1::-1], axis=0).T)
    return np.column_stack([made[:, :2], turn_rad]), made[:, 2] if has_times else None
