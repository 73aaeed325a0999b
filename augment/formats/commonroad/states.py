"""States and shapes of CommonRoad XML, as its schemas of 2018b and 2020a allow them.

A position may be a point, or shapes or lanelets that it lies in, whose centre is taken; a value
may be an interval, whose middle is. A heading that is not given is that of the two parts of the
velocity (a point mass), else of the motion.
"""

from dataclasses import dataclass
from functools import partial
from xml.etree.ElementTree import Element

import numpy as np
import shapely
from shapely.affinity import rotate, translate

from augment.foreign import Doubts, FloatArray, fault_at, read_number, read_whole
from augment.formats.commonroad.network import read_points
from augment.formats.reading import speeds

MOST_STEPS = 10_000
MOVED_M = 0.05
"""A shorter way tells no heading."""
State = tuple[float, float, float, float]
"""x, y, heading, speed; NaN for what is not given."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StateReader:
    """Reads the states of one file.

    Attributes:
        root: The file, for lanelets that a position names.
        step_s: Between its steps.
        doubts: Takes what is assumed.
    """

    root: Element
    step_s: float
    doubts: Doubts

    def read(
        self, owner: Element, place: str, *, stands: bool = False
    ) -> tuple[list[int], FloatArray]:
        """Return the steps of somebody's states, ascending, and the states (K, 4).

        Args:
            owner: With an initialState, and maybe a trajectory, of which states that can't be
                read are left out.
            place: Where it stands.
            stands: Whether the initial state holds all the time.

        Raises:
            InvalidDocument: There is no initial state, or it breaks the format.
        """
        first = owner.find("initialState")
        if first is None:
            raise fault_at(place, "needs an initialState")
        later = owner.findall("trajectory/*")
        self.doubts.assume("The motion of what is static was left out", stands and bool(later))
        later = [] if stands else later
        rows = ((element, place) for element in later)
        read = self.doubts.read_all("states", self._state, rows)
        by_step = self.doubts.index_last("states", [self._state(first, place), *read])
        steps = sorted(by_step)
        states = np.array([by_step[step] for step in steps])
        states[:, 3] = 0.0 if stands else states[:, 3]
        slow = np.isnan(states[:, 3])
        motion = "A {} that is not given is that of the motion, 0 without one".format
        self.doubts.assume(motion("speed"), slow.sum())
        states[slow, 3] = speeds(np.array(steps) * self.step_s, states[:, :2])[slow]
        self.doubts.assume(motion("heading"), np.isnan(states[:, 2]).sum())
        _fill_headings(states)
        return steps, states

    def _state(self, element: Element, place: str) -> tuple[int, State]:
        step = self._value(element, "time", place)
        if np.isnan(step) and element.tag == "initialState":
            self.doubts.assume("An initial state without a time is one of step 0")
            step = 0.0
        if step % 1.0 or not 0.0 <= step <= MOST_STEPS:
            raise fault_at(place, f"a time step lies from 0 to {MOST_STEPS}, not at {step:g}")
        x_m, y_m = self._center(element.find("position"), f"{place}.position")
        names = ("orientation", "velocity", "velocityY")
        heading_rad, speed_mps, aside_mps = (self._value(element, field, place) for field in names)
        if np.isnan(heading_rad) and np.isfinite(aside_mps):
            # Of a point mass these are the parts along x and y of the file's frame.
            if speed_mps or aside_mps:
                heading_rad = float(np.arctan2(aside_mps, speed_mps))
            speed_mps = float(np.hypot(speed_mps, aside_mps))
        self.doubts.assume("Who drives backwards counts as driving forward", speed_mps < 0.0)
        return round(step), (x_m, y_m, heading_rad, abs(speed_mps))

    def _value(self, element: Element, name: str, place: str) -> float:
        """A number, the middle of an interval (of a time, its start); NaN where it is absent."""
        child, place = element.find(name), f"{place}.{name}"
        if child is None:
            return np.nan
        numbers = [read_number(part.text, place) for part in (list(child) or [child])]
        tags = [part.tag for part in child]
        if tags == ["intervalStart", "intervalEnd"]:
            self.doubts.assume("An interval counts as its middle, of times as its start")
        elif tags not in ([], ["exact"]):
            raise fault_at(place, "needs an exact value, or an interval's start and end")
        if name == "orientation" and numbers[-1] < numbers[0]:
            numbers[-1] += 2.0 * np.pi  # over the end of the circle
        return numbers[0] if name == "time" else sum(numbers) / len(numbers)

    def _center(self, position: Element | None, place: str) -> tuple[float, float]:
        if position is None or not len(position):
            raise fault_at(place, "needs a point, shapes or lanelets")
        if position[0].tag == "point":
            x_m, y_m = read_points(position, place)[0].tolist()
            return x_m, y_m
        self.doubts.assume("A position that is a shape counts as its centre")
        shapes = [self._cover(shape, place) for shape in position]
        center = shapely.centroid(shapely.GeometryCollection(shapes))
        return center.x, center.y

    def _cover(self, shape: Element, place: str) -> shapely.Geometry:
        """Return the area of a shape or lanelet in the file's frame."""
        if shape.tag != "lanelet":
            return cover(shape, place)
        number = read_whole(shape.get("ref"), place)
        bounds = [
            read_points(bound, place).tolist()
            for side in ("leftBound", "rightBound")
            for bound in self.root.iterfind(f"lanelet[@id='{number}']/{side}")
        ]
        if len(bounds) != 2 or not all(len(points) > 1 for points in bounds):
            raise fault_at(place, "names a lanelet that is not there, or has no inside")
        return shapely.Polygon(bounds[0] + bounds[1][::-1])


def _fill_headings(states: FloatArray) -> None:
    """Give each state (K, 4) a heading: of its motion, else of the state before or after."""
    import pandas as pd

    rows = np.arange(len(states))
    moved = states[np.minimum(rows + 1, rows[-1]), :2] - states[np.maximum(rows - 1, 0), :2]
    moving = np.isnan(states[:, 2]) & (np.hypot(*moved.T) > MOVED_M)
    states[moving, 2] = np.arctan2(moved[moving, 1], moved[moving, 0])
    states[:, 2] = pd.Series(states[:, 2]).ffill().bfill().fillna(0.0)


def read_box(shape: Element, place: str, doubts: Doubts) -> tuple[float, float, float, float]:
    """Return the box around an obstacle's shapes in its own frame.

    Returns:
        How far its centre lies ahead of the obstacle's place and to its left, length and width.

    Raises:
        InvalidDocument: There is no shape, or it breaks the format.
    """
    shapes = [*shape]
    while any(shape.tag in ("shapeGroup", "shape") for shape in shapes):
        shapes = [
            part for shape in shapes for part in (shape if "shape" in shape.tag else [shape])
        ]
    covered = shapely.GeometryCollection([cover(shape, place) for shape in shapes])
    if not shapes or covered.is_empty:
        raise fault_at(place, "needs a shape")
    if len(shapes) > 1 or shapes[0].tag not in ("rectangle", "circle"):
        doubts.assume("Of a polygon, or of several shapes, the box around them is taken")
    x_m, y_m, to_x_m, to_y_m = covered.bounds
    return (x_m + to_x_m) / 2.0, (y_m + to_y_m) / 2.0, to_x_m - x_m, to_y_m - y_m


def cover(shape: Element, place: str) -> shapely.Geometry:
    """Return the area of a shape around the origin of its frame.

    Raises:
        InvalidDocument: It is none of the format's shapes, or breaks it.
    """

    def find(name: str, default: str | None = "0", **bounds: float) -> float:
        return read_number(shape.findtext(name, default), f"{place}.{name}", **bounds)

    find_size = partial(find, default=None, least=0.001, most=1_000.0)
    x_m, y_m = find("center/x"), find("center/y")
    match shape.tag:
        case "polygon":
            points = read_points(shape, place)
            if len(points) < 3:
                raise fault_at(place, "a polygon needs three points")
            return shapely.Polygon(points)
        case "circle":
            return shapely.Point(x_m, y_m).buffer(find_size("radius"))
        case "rectangle":
            half_m, wide_m = find_size("length") / 2.0, find_size("width") / 2.0
            shift_m = find("originXShift")
            box = shapely.box(-half_m - shift_m, -wide_m, half_m - shift_m, wide_m)
            turned = rotate(box, find("orientation"), origin=(0.0, 0.0), use_radians=True)
            return translate(turned, x_m, y_m)
    raise fault_at(place, f"{shape.tag[:40]!r} is no shape of the format")
