"""The function that the FC variant offers to a language model: a pose on a lane.

In: a `Scene`, and the arguments of a call. Out: a `PoseOnLane`, which the model gets as JSON, or
a `ToolError` whose sentence tells the model what was wrong.

`pose_on_lane(lane, start, distance_m, lateral_m, object)` answers from the recorded centrelines,
under the same short ids as the prompt shows; only control points that are none of the prompt's
are a curve of their own. It follows the lanes across connectors, along the ego's route where they
belong to it, else straightest first, and says which lane lies under the place and who stands
there. Everything is computed from the scene before the change.

Frame: ego frame; s along the shown part of a lane, from where it begins.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from augment.checks import Ground
from augment.errors import ToolError
from augment.geometry.bezier import CubicBezier
from augment.geometry.frames import Box, Pose, overlap
from augment.prompts.calls import PARAMETERS, TOOL
from augment.prompts.vectors import (
    DEFAULT_RADIUS_M,
    LaneCurve,
    ShortNames,
    curve_from,
    lane_curves,
    short_names,
    shown_agents,
)
from augment.scene.bezier_lanes import LanePiece
from augment.scene.entities import LENGTH_WIDTH_M, AgentType, Scene, TrafficAgent

LANE_START = "lane"
FURTHEST_M, WIDEST_M = 1000.0, 30.0
MOST_PLACES = 16
OBJECT_TYPES = tuple(kind for kind in AgentType if kind is not AgentType.EGO_VEHICLE)

# Control points this near to those of a piece are that piece: the prompt rounds to 0.01 m.
COPIED_WITHIN_M = 0.05
# How far an agent may be past an end of a lane and still count as beside it.
BESIDE_WITHIN_M = 1.0
FURTHEST_EDGE_M = 30.0
# A place that is offered as free leaves this in front of the object and behind it.
FREE_GAP_M = 0.5

_OF_A_PLACE = frozenset({"distance_m", "lateral_m", "x_m", "y_m", "heading_rad", "error"})
"""What stands at every place of an answer about several, be it the same everywhere."""
_ROUNDING_M = 0.005
_TOUCH_M = 0.01
_SEARCHED_M, _STEP_M = 50.0, 0.5
_MOST_LISTED = 80

AnyLine = LaneCurve | CubicBezier
"""What a call goes along: a shown lane, or a curve of the model's own."""


class AskedPlace(NamedTuple):
    """One place of a call: metres from the start, to the left, and what is to stand there."""

    distance_m: float
    lateral_m: float
    object_type: AgentType


@dataclass(frozen=True, slots=True, kw_only=True)
class RoadSide:
    """From the centre of a lane to what lies beside it, None without one within 30 m.

    The edge of the road lies beyond all lanes, but before a carpark.
    """

    edge_m: float | None
    carpark_m: float | None
    walkway_m: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseOnLane:
    """One place, with what lies around it; `along_m` is counted on the last lane of the route.

    Attributes:
        lane: The short id of the shown lane or connector under the place, None where there is
            none. Of several the one that the place was counted on.
        width_m: None on a curve of the model's own.
        left, right: The sides of the road, from the centre of that lane there.
        taken_by: Short ids of those in whose place an object there would stand.
        nearest_free_m: The distance of the nearest free place, None where there is none near.
        start_lateral_m: How far left of the lane the starting agent is, None without one.
    """

    pose: Pose
    lane: str | None
    along_m: float
    remaining_m: float
    width_m: float | None
    left: RoadSide
    right: RoadSide
    next_lanes: tuple[str, ...]
    route: tuple[str, ...]
    taken_by: tuple[str, ...]
    nearest_free_m: float | None
    start_lateral_m: float | None

    def to_document(self) -> dict[str, object]:
        """Return the answer under the names of the answer's block, rounded as the prompt is."""
        document: dict[str, object] = {
            "x_m": _rounded(self.pose.x_m),
            "y_m": _rounded(self.pose.y_m),
            "heading_rad": _rounded(self.pose.heading_rad, 3),
            "heading_deg": _rounded(math.degrees(self.pose.heading_rad), 1),
            "lane": self.lane,
            "taken_by": list(self.taken_by) or None,
            "along_m": _rounded(self.along_m),
            "remaining_m": _rounded(self.remaining_m),
            "lane_width_m": _rounded(self.width_m),
            "edge_left_m": _rounded(self.left.edge_m),
            "edge_right_m": _rounded(self.right.edge_m),
            "next_lanes": list(self.next_lanes),
            "route": list(self.route),
        }
        optional = {
            "carpark_left_m": self.left.carpark_m,
            "carpark_right_m": self.right.carpark_m,
            "walkway_left_m": self.left.walkway_m,
            "walkway_right_m": self.right.walkway_m,
        }
        document |= {name: _rounded(m) for name, m in optional.items() if m is not None}
        if self.taken_by:
            document["nearest_free_m"] = _rounded(self.nearest_free_m)
        if self.start_lateral_m is not None:
            document["start_lateral_m"] = _rounded(self.start_lateral_m)
        return document


@dataclass(frozen=True, eq=False)
class PoseTool:
    """The tool for one scene: make it once, call it often. Pure: no call changes it."""

    scene: Scene
    radius_m: float = DEFAULT_RADIUS_M

    def pose_on_lane(
        self,
        lane: str | CubicBezier,
        start: str,
        distance_m: float,
        lateral_m: float = 0.0,
        object_type: AgentType = AgentType.VEHICLE,
    ) -> PoseOnLane:
        """Return the pose `distance_m` from the start along the lane, `lateral_m` to its left.

        Args:
            lane: The short id of a lane, connector or piece, or a curve.
            start: "lane" for its beginning, or an agent's id for the place beside that agent.
            distance_m: Along the direction of travel, on over connectors; negative goes back.
            lateral_m: To the left of the direction of travel, negative to the right.
            object_type: Of what is to stand there.

        Raises:
            ToolError: Nobody knows the lane or the agent, the agent is not beside the lane, or
                the lanes end before the distance does.
        """
        line, begins_m = self._line(lane)
        start_m, start_lateral_m = self._start(line, begins_m, start)

        def pose_at(along_m: float) -> Pose:
            passed, s_m = self._walk(line, start_m, along_m)
            return passed[-1].pose_at(s_m, lateral_m)

        passed, s_m = self._walk(line, start_m, distance_m)
        last = passed[-1]
        pose, centre = last.pose_at(s_m, lateral_m), last.pose_at(s_m)
        counted = last if isinstance(last, LaneCurve) else None
        taken_by = self._taken_by(pose, object_type)
        return PoseOnLane(
            pose=pose,
            lane=self._under(pose, counted, lateral_m),
            along_m=s_m,
            remaining_m=last.length_m - s_m,
            width_m=None if counted is None else counted.width_m,
            left=self._side(centre, math.pi / 2.0),
            right=self._side(centre, -math.pi / 2.0),
            next_lanes=() if counted is None else counted.after,
            route=tuple(one.id for one in passed if isinstance(one, LaneCurve)),
            taken_by=taken_by,
            nearest_free_m=(
                self._nearest_free_m(pose_at, object_type, distance_m) if taken_by else None
            ),
            start_lateral_m=start_lateral_m,
        )

    def answer(self, arguments: object) -> dict[str, object]:
        """Return what goes back to the model, ready for JSON.

        A pose; {"poses": one entry a place} where several distances were asked for, with what is
        the same at all of them beside it; or {"error": a sentence}, where nothing can be read,
        and at each place that can't be.
        """
        try:
            lane, start, places, is_list = _read_call(arguments)
        except ToolError as fault:
            return {"error": fault.problem}
        answers: list[dict[str, object]] = []
        for place in places:
            try:
                answers.append(self.pose_on_lane(lane, start, *place).to_document())
            except ToolError as fault:
                answers.append({"error": fault.problem})
        if not is_list:
            return answers[0]
        answers = [
            {"distance_m": place.distance_m, "lateral_m": place.lateral_m} | answer
            for place, answer in zip(places, answers, strict=True)
        ]
        shared = {
            name: value
            for name, value in answers[0].items()
            if name not in _OF_A_PLACE
            and all(name in one and one[name] == value for one in answers)
        }
        own = [{name: one[name] for name in one if name not in shared} for one in answers]
        return {"poses": own, **shared}

    @cached_property
    def curves(self) -> dict[str, LaneCurve]:
        """The shown lanes and connectors by short id."""
        return lane_curves(self.scene, self._names, self.radius_m)

    @cached_property
    def agents(self) -> dict[str, TrafficAgent]:
        """The shown agents by short id."""
        shown = shown_agents(self.scene, self.radius_m)
        return {self._names.agents[agent.id]: agent for agent in shown}

    @cached_property
    def _names(self) -> ShortNames:
        return short_names(self.scene)

    @cached_property
    def _pieces(self) -> dict[str, tuple[LaneCurve, LanePiece]]:
        return {
            name: (curve, piece)
            for curve in self.curves.values()
            for name, piece in zip(curve.pieces, curve.lane, strict=True)
        }

    @cached_property
    def _ground(self) -> Ground:
        return Ground.of(self.scene)

    @cached_property
    def _ego_route(self) -> frozenset[str]:
        """Short ids of the lanes that the ego's goal leads over."""
        route = self._ground.route
        return frozenset(self._names.lanes[name] for name in (route.lane_ids if route else ()))

    def _line(self, lane: str | CubicBezier) -> tuple[AnyLine, float]:
        """Return what a call goes along, and from where on it."""
        if isinstance(lane, CubicBezier):
            for curve, piece in self._pieces.values():
                if np.abs(piece.curve.control_m - lane.control_m).max() <= COPIED_WITHIN_M:
                    return curve, piece.start_m
            return lane, 0.0
        if lane in self.curves:
            return self.curves[lane], 0.0
        if lane in self._pieces:
            curve, piece = self._pieces[lane]
            return curve, piece.start_m
        raise ToolError(TOOL, _unknown("lane", lane, self.curves))

    def _start(self, line: AnyLine, begins_m: float, start: str) -> tuple[float, float | None]:
        """Return where the distance starts, and how far left of the lane the agent there is."""
        if start == LANE_START:
            return begins_m, None
        if start not in self.agents:
            problem = _unknown("agent", start, self.agents)
            raise ToolError(TOOL, f'{problem} Or start at "{LANE_START}", its beginning.')
        agent = self.agents[start]
        place = line.project(agent.x_m, agent.y_m)
        is_before = place.s_m <= 1e-3
        if not is_before and place.s_m < line.length_m - 1e-3:
            return place.s_m, place.d_m
        end = line.pose_at(place.s_m)
        past_m = float(abs(end.to_local(np.array([[agent.x_m, agent.y_m]]))[0, 0]))
        if past_m <= BESIDE_WITHIN_M:
            return place.s_m, place.d_m
        where = "before the beginning" if is_before else "past the end"
        short = None if agent.lane_id is None else self._names.lanes.get(agent.lane_id)
        advice = f'call with lane "{short}"' if short in self.curves else "name a lane beside it"
        raise ToolError(
            TOOL,
            f"{start} is not beside this lane, it is {past_m:.1f} m {where} of it. To start from "
            f'{start}, {advice}; to start from the beginning of this lane, use "{LANE_START}".',
        )

    def _walk(
        self, line: AnyLine, start_m: float, distance_m: float
    ) -> tuple[list[AnyLine], float]:
        """Return what is passed on the way, and s on the last of it."""
        s_m = start_m + distance_m
        if not isinstance(line, LaneCurve):
            kept_m = min(max(s_m, 0.0), line.length_m)
            if abs(s_m - kept_m) > _ROUNDING_M:
                low, high = round(-start_m, 2) + 0.0, round(line.length_m - start_m, 2) + 0.0
                raise ToolError(
                    TOOL,
                    f"this curve is {line.length_m:.2f} m long and no lane of the scene follows "
                    f"it: from this start distance_m must be between {low:.2f} and {high:.2f}",
                )
            return [line], kept_m
        passed = [line]
        while s_m > passed[-1].length_m:
            here, over_m = passed[-1], s_m - passed[-1].length_m
            if not here.after:
                _refuse_past_end(over_m, distance_m - over_m, passed, "end", "most")
                return [*passed], here.length_m
            # The ego's route where it leads there, else straight on.
            routed = self._ego_route if here.id in self._ego_route else frozenset()
            following = next((name for name in here.after if name in routed), here.after[0])
            passed.append(self.curves[following])
            s_m = over_m
        while s_m < 0.0:
            if not passed[-1].before:
                _refuse_past_end(-s_m, distance_m - s_m, passed, "begin", "least")
                return [*passed], 0.0
            passed.append(self.curves[passed[-1].before[0]])
            s_m += passed[-1].length_m
        return [*passed], s_m

    def _under(self, pose: Pose, counted: LaneCurve | None, lateral_m: float) -> str | None:
        """Return the shown lane under a place: the one it was counted on, if that is."""
        if counted is not None and abs(lateral_m) <= counted.width_m / 2.0:
            return counted.id
        lane_id = self._ground.graph.under(pose.x_m, pose.y_m, pose.heading_rad)
        short = None if lane_id is None else self._names.lanes[lane_id]
        return short if short in self.curves else None

    def _side(self, centre: Pose, turn_rad: float) -> RoadSide:
        """Return the side of the road in the direction turned so far from a lane's own."""
        ground, ray = self._ground, (centre.x_m, centre.y_m, centre.heading_rad + turn_rad)
        carpark_m = ground.carparks.begins_m(*ray, FURTHEST_EDGE_M)
        edge_m = ground.road.reach_m(*ray, FURTHEST_EDGE_M)
        if carpark_m is not None and 0.0 < carpark_m < (math.inf if edge_m is None else edge_m):
            edge_m = carpark_m
        walkway_m = ground.walkways.begins_m(*ray, FURTHEST_EDGE_M)
        return RoadSide(edge_m=edge_m, carpark_m=carpark_m, walkway_m=walkway_m)

    def _taken_by(self, pose: Pose, object_type: AgentType, gap_m: float = 0.0) -> tuple[str, ...]:
        """Return the ids of those whose boxes an object would overlap, with a gap at its ends."""
        length_m, width_m = LENGTH_WIDTH_M[object_type]
        box = Box(pose=pose, length_m=length_m + 2.0 * gap_m, width_m=width_m)
        reach_m = math.hypot(box.length_m, box.width_m) / 2.0
        return tuple(
            name
            for name, agent in self.agents.items()
            if math.dist((pose.x_m, pose.y_m), (agent.x_m, agent.y_m))
            <= reach_m + math.hypot(agent.length_m, agent.width_m) / 2.0
            and overlap(box, agent.box).depth_m > _TOUCH_M
        )

    def _nearest_free_m(
        self, pose_at: Callable[[float], Pose], object_type: AgentType, distance_m: float
    ) -> float | None:
        """Return the distance nearest to a taken one where the object overlaps nobody."""
        for step in range(1, int(_SEARCHED_M / _STEP_M) + 1):
            for there_m in (distance_m + step * _STEP_M, distance_m - step * _STEP_M):
                try:
                    pose = pose_at(there_m)
                except ToolError:
                    continue
                if not self._taken_by(pose, object_type, FREE_GAP_M):
                    return there_m
        return None


# Private


def _read_call(arguments: object) -> tuple[str | CubicBezier, str, tuple[AskedPlace, ...], bool]:
    """Return lane, start and places of a call, and whether a list of places was asked for.

    Raises:
        ToolError: It can't be read; the sentence names the argument and what is allowed.
    """
    allowed = ", ".join(PARAMETERS)
    if not isinstance(arguments, Mapping):
        raise ToolError(TOOL, f"the arguments must be one JSON object with {allowed}")
    unknown = [str(name)[:40] for name in arguments if name not in PARAMETERS]
    if unknown:
        raise ToolError(TOOL, f"there is no argument {unknown[0]!r}; there are {allowed}")
    missing = [name for name in PARAMETERS[:3] if name not in arguments]
    if missing:
        raise ToolError(TOOL, f"{', '.join(missing)} must be given")
    start = arguments["start"]
    if not isinstance(start, str):
        raise ToolError(TOOL, f'start must be "{LANE_START}" or the id of an agent')
    given: dict[str, Any] = {"lateral_m": 0.0, "object": AgentType.VEHICLE.value} | dict(arguments)
    lists: dict[str, list[Any]] = {
        "distance_m": _numbers("distance_m", given["distance_m"], FURTHEST_M),
        "lateral_m": _numbers("lateral_m", given["lateral_m"], WIDEST_M),
        "object": _object_types(given["object"]),
    }
    count = max(len(values) for values in lists.values())
    for name, values in lists.items():
        if len(values) != count and isinstance(given[name], list):
            longest = next(other for other in lists if len(lists[other]) == count)
            raise ToolError(
                TOOL,
                f"{name} is a list of {len(values)} and {longest} one of {count}: make them "
                "equally long, or give one value for all places",
            )
    # What is no list goes with each of the others.
    along, aside, kinds = (values * (count // len(values)) for values in lists.values())
    places = tuple(map(AskedPlace, along, aside, kinds))
    is_list = any(isinstance(given[name], list) for name in lists)
    return _lane(arguments["lane"]), start, places, is_list


def _numbers(name: str, value: Any, limit: float) -> list[float]:
    values = value if isinstance(value, list) else [value]
    if not 1 <= len(values) <= MOST_PLACES:
        raise ToolError(TOOL, f"{name} must be a number or a list of 1 to {MOST_PLACES} numbers")
    for one in values:
        # True is a number to Python, and an integer may be too large for a float.
        if isinstance(one, bool) or not isinstance(one, int | float):
            raise ToolError(TOOL, f"{name} must be a number, without quotes and without a unit")
        if not (abs(one) <= limit and math.isfinite(one)):
            raise ToolError(TOOL, f"{name} must be between {-limit:g} and {limit:g}")
    return [float(one) for one in values]


def _object_types(value: Any) -> list[AgentType]:
    values = value if isinstance(value, list) else [value]
    names = [kind.value for kind in OBJECT_TYPES]
    if not 1 <= len(values) <= MOST_PLACES or any(one not in names for one in values):
        raise ToolError(
            TOOL,
            f"object must be one of {', '.join(names)}, or a list of 1 to {MOST_PLACES} of them",
        )
    return [AgentType(one) for one in values]


def _lane(value: Any) -> str | CubicBezier:
    if isinstance(value, str):
        return value
    is_curve = isinstance(value, list) and len(value) in (2, 4)
    if not is_curve or not all(isinstance(one, list) and len(one) == 2 for one in value):
        raise ToolError(
            TOOL,
            "lane must be an id or four control points [[x, y], [x, y], [x, y], [x, y]], "
            "or the two ends of a straight piece",
        )
    try:
        return curve_from([_numbers("lane", point, FURTHEST_M) for point in value])
    except ValueError as fault:
        raise ToolError(TOOL, f"lane: {fault}") from None


def _refuse_past_end(
    over_m: float, possible_m: float, passed: list[LaneCurve], side: str, bound: str
) -> None:
    """Raise where the lanes end by more than rounding before the distance does."""
    if over_m <= _ROUNDING_M:
        return
    path = " -> ".join(curve.id for curve in passed)
    raise ToolError(
        TOOL,
        f"the lanes that are shown {side} {over_m:.2f} m short of that ({path}): from this start "
        f"distance_m can be {round(possible_m, 2) + 0.0:.2f} at {bound}",
    )


def _unknown(kind: str, name: str, known: Iterable[str]) -> str:
    """Say that there is no such one, what may have been meant, and which there are."""
    names = list(known)
    close = get_close_matches(name[:40], names, n=1)
    meant = f" Is {close[0]} meant?" if close else ""
    more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    return (
        f"there is no {kind} {name[:40]!r}.{meant} Known: {', '.join(names[:_MOST_LISTED])}{more}."
    )


def _rounded(value: float | None, digits: int = 2) -> float | None:
    """Round, and never to minus zero; unknown stays unknown."""
    return None if value is None else round(float(value), digits) + 0.0
