"""The function that the FC variant offers to a language model: a pose on a lane.

In: a `Scene`, and the arguments of a call (`pose_call.py` reads them). Out: a `PoseOnLane`
(`pose_result.py`), which the model gets as JSON, or a `ToolError` whose sentence tells the model
what was wrong.

`pose_on_lane(lane, start, distance_m, lateral_m)` answers from the recorded centrelines, under
the same short ids as the prompt shows; only control points that are none of the prompt's are a
curve of their own. It follows the lanes across connectors, straightest first, and says on which
one it ended. Everything is computed from the scene before the change.

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
from augment.prompts.lane_curves import LaneCurve, lane_curves
from augment.prompts.names import ShortNames, short_names
from augment.prompts.vectors import DEFAULT_RADIUS_M, shown_agents
from augment.scene.bezier_lanes import BezierLane, LanePiece
from augment.scene.entities import Scene, TrafficAgent
from augment.variants.pose_call import LANE_START, PoseCall, read_call
from augment.variants.pose_result import PoseOnLane, round_number

COPIED_WITHIN_M = 0.05
"""Control points this near to those of a piece are that piece: the prompt rounds to 0.01 m."""

FURTHEST_EDGE_M = 30.0
"""The edge of the road is looked for as far beside a lane."""

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
    ) -> PoseOnLane:
        """The pose `distance_m` from the start along the lane and `lateral_m` to its left.

        Args:
            lane: The short id of a lane, connector or piece, or a curve.
            start: "lane" for its beginning, or an agent's id for the place beside that agent.
            distance_m: Along the direction of travel, on over connectors; negative goes back.
            lateral_m: To the left of the direction of travel, negative to the right.

        Raises:
            ToolError: Nobody knows the lane or the agent, the agent is not beside the lane, or
                the lanes end before the distance does.
        """
        road = self._road(lane)
        start_m, start_lateral_m = self._start(road, start)
        s_m = start_m + distance_m
        if isinstance(road.line, LaneCurve):
            passed, s_m = self._walk(road.line, s_m, distance_m)
            return self._on_lane(passed, s_m, lateral_m, start_lateral_m)
        s_m = _on_foreign_curve(s_m, road.line.length_m, start_m)
        left_m, right_m = self._edges(road.line.pose_at(s_m))
        return PoseOnLane(
            pose=road.line.pose_at(s_m, lateral_m),
            lane=None,
            along_m=s_m,
            remaining_m=road.line.length_m - s_m,
            width_m=None,
            edge_left_m=left_m,
            edge_right_m=right_m,
            next_lanes=(),
            route=(),
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
            return self._answer_at(call, *call.places[0])
        found = [
            {"distance_m": distance_m, "lateral_m": lateral_m}
            | self._answer_at(call, distance_m, lateral_m)
            for distance_m, lateral_m in call.places
        ]
        shared = {
            name: value
            for name, value in found[0].items()
            if name not in _OF_A_PLACE and all(name in one and one[name] == value for one in found)
        }
        own = [{name: one[name] for name in one if name not in shared} for one in found]
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

    def _answer_at(self, call: PoseCall, distance_m: float, lateral_m: float) -> dict[str, object]:
        try:
            found = self.pose_on_lane(call.lane, call.start, distance_m, lateral_m)
        except ToolError as fault:
            return {"error": fault.problem}
        return found.to_document()

    def _on_lane(
        self,
        passed: list[LaneCurve],
        s_m: float,
        lateral_m: float,
        start_lateral_m: float | None,
    ) -> PoseOnLane:
        """The place beside s of the last of the lanes that were passed."""
        here = passed[-1]
        pose = here.pose_at(s_m, lateral_m)
        is_beside = abs(lateral_m) > here.width_m / 2.0
        left_m, right_m = self._edges(here.pose_at(s_m))
        return PoseOnLane(
            pose=pose,
            lane=None if is_beside else here.id,
            along_m=s_m,
            remaining_m=here.length_m - s_m,
            width_m=here.width_m,
            edge_left_m=left_m,
            edge_right_m=right_m,
            next_lanes=here.after,
            route=tuple(curve.id for curve in passed),
            is_beside=is_beside,
            other_lane=self._under(pose) if is_beside else None,
            start_lateral_m=start_lateral_m,
        )

    def _edges(self, centre: Pose) -> tuple[float | None, float | None]:
        """From a lane's centre to the edge of the road on its left and on its right."""
        road, quarter = self._ground.road, math.pi / 2.0
        left_m, right_m = (
            road.reach_m(centre.x_m, centre.y_m, centre.heading_rad + turn, FURTHEST_EDGE_M)
            for turn in (quarter, -quarter)
        )
        return left_m, right_m

    def _under(self, pose: Pose) -> str | None:
        """The shown lane or connector under a place."""
        lane_id = self._ground.graph.under(pose.x_m, pose.y_m)
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
                passed.append(self.curves[passed[-1].after[0]])
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
