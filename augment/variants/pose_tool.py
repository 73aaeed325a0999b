"""The function that the FC variant offers to a language model: a pose on a lane.

In: a `Scene`, and the arguments of a call (`pose_call.py` reads them). Out: a `PoseOnLane`
(`pose_result.py`), which the model gets as JSON, or a `ToolError` whose sentence tells the model
what was wrong.

`pose_on_lane(lane, start, distance_m, lateral_m, object)` answers from the recorded centrelines,
under the same short ids as the prompt shows; only control points that are none of the prompt's
are a curve of their own. It follows the lanes across connectors, along the ego's route where they
belong to it, else straightest first, and says which lane lies under the place and who stands
there. Everything is computed from the scene before the change.

Frame: ego frame; s along the shown part of a lane, from where it begins.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property

import numpy as np

from augment.checks import Ground
from augment.errors import ToolError
from augment.geometry.bezier import CubicBezier, FitError
from augment.geometry.frames import Pose
from augment.prompts.calls import TOOL
from augment.prompts.vectors import (
    DEFAULT_RADIUS_M,
    LaneCurve,
    ShortNames,
    lane_curves,
    short_names,
    shown_agents,
)
from augment.scene.bezier_lanes import BezierLane, LanePiece
from augment.scene.entities import AgentType, Scene, TrafficAgent
from augment.variants.pose_call import LANE_START, AskedPlace, PoseCall, read_call
from augment.variants.pose_result import PoseOnLane, round_number
from augment.variants.pose_surroundings import Occupancy, side_of_road

COPIED_WITHIN_M = 0.05
"""Control points this near to those of a piece are that piece: the prompt rounds to 0.01 m."""

BESIDE_WITHIN_M = 1.0
"""How far an agent may be past an end of a lane and still count as beside it."""

_OF_A_PLACE = frozenset({"distance_m", "lateral_m", "x_m", "y_m", "heading_rad", "error"})
"""What stands at every place of an answer about several, be it the same everywhere."""

_ROUNDING_M = 0.005
_MOST_LISTED = 80


@dataclass(frozen=True, slots=True, kw_only=True)
class _Road:
    """What a call goes along: a shown lane from some s on, or a curve of the model's own."""

    line: LaneCurve | BezierLane
    begins_m: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class _Spot:
    """Where a distance leads.

    Attributes:
        line: The lane or curve that it ends on.
        s_m: Along its shown part.
        passed: The lanes on the way, the last one included; empty on a curve.
    """

    line: LaneCurve | BezierLane
    s_m: float
    passed: tuple[LaneCurve, ...] = ()


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
        """The pose `distance_m` from the start along the lane and `lateral_m` to its left.

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
        road = self._road(lane)
        start_m, start_lateral_m = self._start(road, start)

        def pose_at(along_m: float) -> Pose:
            there = self._spot(road, start_m, along_m)
            return there.line.pose_at(there.s_m, lateral_m)

        spot = self._spot(road, start_m, distance_m)
        here, pose = spot.line, spot.line.pose_at(spot.s_m, lateral_m)
        counted = here if isinstance(here, LaneCurve) else None
        taken_by = self._occupancy.taken_by(pose, object_type)
        free_m = None
        if taken_by:
            free_m = self._occupancy.nearest_free_m(pose_at, object_type, distance_m)
        left, right = (
            side_of_road(self._ground, here.pose_at(spot.s_m), turn_rad)
            for turn_rad in (math.pi / 2.0, -math.pi / 2.0)
        )
        return PoseOnLane(
            pose=pose,
            lane=self._under(pose, counted, lateral_m),
            along_m=spot.s_m,
            remaining_m=here.length_m - spot.s_m,
            width_m=None if counted is None else counted.width_m,
            left=left,
            right=right,
            next_lanes=() if counted is None else counted.after,
            route=tuple(curve.id for curve in spot.passed),
            taken_by=taken_by,
            nearest_free_m=free_m,
            start_lateral_m=start_lateral_m,
        )

    def answer(self, arguments: object) -> dict[str, object]:
        """What goes back to the model, ready for JSON.

        A pose; {"poses": one entry a place} where several distances were asked for, with what is
        the same at all of them beside it; or {"error": a sentence}, where nothing can be read,
        and at each place that can't be.
        """
        try:
            call: PoseCall = read_call(arguments)
        except ToolError as fault:
            return {"error": fault.problem}
        if not call.is_list:
            return self._answer_at(call, call.places[0])
        answers = [
            {"distance_m": place.distance_m, "lateral_m": place.lateral_m}
            | self._answer_at(call, place)
            for place in call.places
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
        return {
            self._names.agents[agent.id]: agent
            for agent in shown_agents(self.scene, self.radius_m)
        }

    @cached_property
    def _names(self) -> ShortNames:
        return short_names(self.scene)

    @cached_property
    def _pieces(self) -> dict[str, tuple[LaneCurve, LanePiece]]:
        return {
            name: (curve, piece)
            for curve in self.curves.values()
            for name, piece in zip(curve.pieces, curve.lane.pieces, strict=True)
        }

    @cached_property
    def _ground(self) -> Ground:
        return Ground.of(self.scene)

    @cached_property
    def _occupancy(self) -> Occupancy:
        return Occupancy(self.agents)

    def _answer_at(self, call: PoseCall, place: AskedPlace) -> dict[str, object]:
        try:
            result = self.pose_on_lane(call.lane, call.start, *place)
        except ToolError as fault:
            return {"error": fault.problem}
        return result.to_document()

    def _spot(self, road: _Road, start_m: float, distance_m: float) -> _Spot:
        """Where a distance from s of a road leads."""
        s_m = start_m + distance_m
        if isinstance(road.line, LaneCurve):
            passed, s_m = self._walk(road.line, s_m, distance_m)
            return _Spot(line=passed[-1], s_m=s_m, passed=tuple(passed))
        return _Spot(line=road.line, s_m=_on_foreign_curve(s_m, road.line.length_m, start_m))

    def _under(self, pose: Pose, counted: LaneCurve | None, lateral_m: float) -> str | None:
        """The shown lane or connector under a place: the one it was counted on, if that is."""
        if counted is not None and abs(lateral_m) <= counted.width_m / 2.0:
            return counted.id
        lane_id = self._ground.graph.under(pose.x_m, pose.y_m, pose.heading_rad)
        short = None if lane_id is None else self._names.lanes[lane_id]
        return short if short in self.curves else None

    def _road(self, lane: str | CubicBezier) -> _Road:
        if isinstance(lane, CubicBezier):
            return self._road_of(lane)
        if lane in self.curves:
            return _Road(line=self.curves[lane])
        if lane in self._pieces:
            curve, piece = self._pieces[lane]
            return _Road(line=curve, begins_m=piece.start_m)
        raise ToolError(TOOL, _unknown("lane", lane, self.curves))

    def _road_of(self, given: CubicBezier) -> _Road:
        for curve, piece in self._pieces.values():
            gap_m = np.abs(piece.curve.control_m - given.control_m).max()
            if gap_m <= COPIED_WITHIN_M:
                return _Road(line=curve, begins_m=piece.start_m)
        exact = FitError(position_m=0.0, heading_rad=0.0)
        piece = LanePiece(curve=given, start_m=0.0, end_m=given.length_m, error=exact)
        return _Road(line=BezierLane(pieces=(piece,)))

    def _start(self, road: _Road, start: str) -> tuple[float, float | None]:
        """Where the distance starts, and how far left of the lane the starting agent is."""
        if start == LANE_START:
            return road.begins_m, None
        if start not in self.agents:
            problem = _unknown("agent", start, self.agents)
            raise ToolError(TOOL, f'{problem} Or start at "{LANE_START}", its beginning.')
        agent = self.agents[start]
        place = road.line.project(agent.x_m, agent.y_m)
        at_end = place.s_m <= 1e-3 or place.s_m >= road.line.length_m - 1e-3
        if at_end:
            end = road.line.pose_at(place.s_m)
            past_m = float(abs(end.to_local(np.array([[agent.x_m, agent.y_m]]))[0, 0]))
            if past_m > BESIDE_WITHIN_M:
                raise ToolError(TOOL, self._not_beside(start, agent, past_m, place.s_m <= 1e-3))
        return place.s_m, place.d_m

    def _not_beside(self, name: str, agent: TrafficAgent, past_m: float, is_before: bool) -> str:
        where = "before the beginning" if is_before else "past the end"
        short = None if agent.lane_id is None else self._names.lanes.get(agent.lane_id)
        advice = f'call with lane "{short}"' if short in self.curves else "name a lane beside it"
        return (
            f"{name} is not beside this lane, it is {past_m:.1f} m {where} of it. To start from "
            f'{name}, {advice}; to start from the beginning of this lane, use "{LANE_START}".'
        )

    def _walk(
        self, curve: LaneCurve, s_m: float, distance_m: float
    ) -> tuple[list[LaneCurve], float]:
        """The lanes passed on the way to s, and s on the last of them."""
        passed = [curve]
        while s_m > passed[-1].length_m:
            over_m = s_m - passed[-1].length_m
            if passed[-1].after:
                passed.append(self.curves[self._onward(passed[-1])])
                s_m = over_m
            else:
                _refuse_past_end(over_m, distance_m - over_m, passed, forward=True)
                s_m = passed[-1].length_m
        while s_m < 0.0:
            if passed[-1].before:
                passed.append(self.curves[passed[-1].before[0]])
                s_m += passed[-1].length_m
            else:
                _refuse_past_end(-s_m, distance_m - s_m, passed, forward=False)
                s_m = 0.0
        return passed, s_m

    def _onward(self, curve: LaneCurve) -> str:
        """What is driven after a lane: the ego's route where it leads there, else straight on."""
        routed = self._ego_route if curve.id in self._ego_route else frozenset()
        return next((name for name in curve.after if name in routed), curve.after[0])

    @cached_property
    def _ego_route(self) -> frozenset[str]:
        """Short ids of the lanes that the ego's goal leads over."""
        route = self._ground.route
        return (
            frozenset(self._names.lanes[name] for name in route.lane_ids) if route else frozenset()
        )


# Private


def _on_foreign_curve(s_m: float, length_m: float, start_m: float) -> float:
    kept_m = min(max(s_m, 0.0), length_m)
    if abs(s_m - kept_m) > _ROUNDING_M:
        low, high = round_number(-start_m, 2), round_number(length_m - start_m, 2)
        raise ToolError(
            TOOL,
            f"this curve is {length_m:.2f} m long and no lane of the scene follows it: from this "
            f"start distance_m must be between {low:.2f} and {high:.2f}",
        )
    return kept_m


def _refuse_past_end(
    over_m: float, possible_m: float, passed: list[LaneCurve], *, forward: bool
) -> None:
    """Raise where the lanes end by more than rounding before the distance does."""
    if over_m <= _ROUNDING_M:
        return
    path = " -> ".join(curve.id for curve in passed)
    side, bound = ("end", "most") if forward else ("begin", "least")
    raise ToolError(
        TOOL,
        f"the lanes that are shown {side} {over_m:.2f} m short of that ({path}): from this start "
        f"distance_m can be {round_number(possible_m, 2):.2f} at {bound}",
    )


def _unknown(kind: str, name: str, known: Iterable[str]) -> str:
    """There is no such one, what may have been meant, and which there are."""
    names = list(known)
    close = get_close_matches(name[:40], names, n=1)
    meant = f" Is {close[0]} meant?" if close else ""
    more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    return (
        f"there is no {kind} {name[:40]!r}.{meant} Known: {', '.join(names[:_MOST_LISTED])}{more}."
    )
