"""The function that the FC variant offers to a language model: a pose on a lane.

In: a `Scene`, and the arguments of a call (`pose_call.py` reads them). Out: a `PoseOnLane`, which
the model gets as JSON, or a `ToolError` whose sentence tells the model what was wrong.

`pose_on_lane(lane, start, distance_m, lateral_m)` answers from the same Bezier pieces and under
the same short ids as the prompt shows. It follows the lanes across connectors, straightest
first, and says on which one it ended. Everything is computed from the scene before the change.

Frame: ego frame; s along the shown part of a lane, from where it begins.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property

import numpy as np

from augment.errors import ToolError
from augment.geometry.bezier import CubicBezier, FitError
from augment.geometry.frames import Pose
from augment.prompts.calls import TOOL
from augment.prompts.lane_curves import LaneCurve, lane_curves
from augment.prompts.names import ShortNames, short_names
from augment.prompts.vectors import DEFAULT_RADIUS_M
from augment.scene.bezier_lanes import BezierLane, LanePiece
from augment.scene.entities import Scene, TrafficAgent
from augment.variants.pose_call import LANE_START, PoseCall, read_call

COPIED_WITHIN_M = 0.05
"""Control points this near to those of a piece are that piece: the prompt rounds to 0.01 m."""

BESIDE_WITHIN_M = 1.0
"""How far an agent may be past an end of a lane and still count as beside it."""

_ROUNDING_M = 0.005
_MOST_LISTED = 80


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseOnLane:
    """The answer to a call.

    Attributes:
        lane: The short id of the lane or connector under the place, None on a foreign curve.
        along_m: From where the shown part of that lane begins.
        remaining_m: From the place to the end of that lane.
        width_m: Of that lane, None on a foreign curve.
        next_lanes: What follows at its end, straightest first.
        route: The lanes from the start to the place, in the order they were passed.
        start_lateral_m: How far left of the lane the starting agent is, None without one.
    """

    pose: Pose
    lane: str | None
    along_m: float
    remaining_m: float
    width_m: float | None
    next_lanes: tuple[str, ...]
    route: tuple[str, ...]
    start_lateral_m: float | None = None

    def to_document(self) -> dict[str, object]:
        """The answer under the names of the answer's block, rounded as the prompt is."""
        document: dict[str, object] = {
            "x_m": _rounded(self.pose.x_m, 2),
            "y_m": _rounded(self.pose.y_m, 2),
            "heading_rad": _rounded(self.pose.heading_rad, 3),
            "heading_deg": _rounded(math.degrees(self.pose.heading_rad), 1),
            "lane": self.lane,
            "along_m": _rounded(self.along_m, 2),
            "remaining_m": _rounded(self.remaining_m, 2),
            "lane_width_m": None if self.width_m is None else _rounded(self.width_m, 2),
            "next_lanes": list(self.next_lanes),
            "route": list(self.route),
        }
        if self.start_lateral_m is not None:
            document["start_lateral_m"] = _rounded(self.start_lateral_m, 2)
        return document


@dataclass(frozen=True, slots=True, kw_only=True)
class _Road:
    """What a call goes along: a shown lane from some s on, or a curve of the model's own."""

    lane: BezierLane
    begins_m: float = 0.0
    curve: LaneCurve | None = None


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
        if road.curve is None:
            s_m = _on_foreign_curve(s_m, road.lane.length_m, start_m)
            passed: list[LaneCurve] = []
        else:
            passed, s_m = self._walk(road.curve, s_m, distance_m)
        here = passed[-1] if passed else None
        under = road.lane if here is None else here.lane
        return PoseOnLane(
            pose=under.pose_at(s_m, lateral_m),
            lane=None if here is None else here.id,
            along_m=s_m,
            remaining_m=under.length_m - s_m,
            width_m=None if here is None else here.width_m,
            next_lanes=() if here is None else here.after,
            route=tuple(curve.id for curve in passed),
            start_lateral_m=start_lateral_m,
        )

    def call(self, arguments: object) -> PoseOnLane:
        """The answer to the arguments as a model wrote them, read from JSON.

        Raises:
            ToolError: They can't be read or have no answer.
        """
        call: PoseCall = read_call(arguments)
        return self.pose_on_lane(call.lane, call.start, call.distance_m, call.lateral_m)

    def answer(self, arguments: object) -> dict[str, object]:
        """What goes back to the model, ready for JSON: the pose, or {"error": a sentence}."""
        try:
            return self.call(arguments).to_document()
        except ToolError as fault:
            return {"error": fault.problem}

    @cached_property
    def curves(self) -> dict[str, LaneCurve]:
        """The shown lanes and connectors by short id."""
        return lane_curves(self.scene, self._names, self.radius_m)

    @cached_property
    def agents(self) -> dict[str, TrafficAgent]:
        """The shown agents by short id."""
        return {
            self._names.agents[agent.id]: agent
            for agent in self.scene.everyone
            if math.hypot(agent.x_m, agent.y_m) <= self.radius_m
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

    def _road(self, lane: str | CubicBezier) -> _Road:
        if isinstance(lane, CubicBezier):
            return self._road_of(lane)
        if lane in self.curves:
            return _Road(lane=self.curves[lane].lane, curve=self.curves[lane])
        if lane in self._pieces:
            curve, piece = self._pieces[lane]
            return _Road(lane=curve.lane, begins_m=piece.start_m, curve=curve)
        raise ToolError(TOOL, _unknown("lane", lane, self.curves))

    def _road_of(self, given: CubicBezier) -> _Road:
        for curve, piece in self._pieces.values():
            gap_m = np.abs(piece.curve.control_m - given.control_m).max()
            if gap_m <= COPIED_WITHIN_M:
                return _Road(lane=curve.lane, begins_m=piece.start_m, curve=curve)
        exact = FitError(position_m=0.0, heading_rad=0.0)
        piece = LanePiece(curve=given, start_m=0.0, end_m=given.length_m, error=exact)
        return _Road(lane=BezierLane(pieces=(piece,)))

    def _start(self, road: _Road, start: str) -> tuple[float, float | None]:
        """Where the distance starts, and how far left of the lane the starting agent is."""
        if start == LANE_START:
            return road.begins_m, None
        if start not in self.agents:
            problem = _unknown("agent", start, self.agents)
            raise ToolError(TOOL, f'{problem} Or start at "{LANE_START}", its beginning.')
        agent = self.agents[start]
        place = road.lane.project(agent.x_m, agent.y_m)
        at_end = place.s_m <= 1e-3 or place.s_m >= road.lane.length_m - 1e-3
        if at_end:
            end = road.lane.pose_at(place.s_m)
            past_m = float(abs(end.to_local(np.array([[agent.x_m, agent.y_m]]))[0, 0]))
            if past_m > BESIDE_WITHIN_M:
                raise ToolError(TOOL, self._not_beside(start, agent, past_m, place.s_m <= 1e-3))
        return place.s_m, place.d_m

    def _not_beside(self, name: str, agent: TrafficAgent, past_m: float, is_before: bool) -> str:
        where = "before the beginning" if is_before else "behind the end"
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
        while s_m > passed[-1].lane.length_m:
            over_m = s_m - passed[-1].lane.length_m
            if passed[-1].after:
                passed.append(self.curves[passed[-1].after[0]])
                s_m = over_m
            else:
                _refuse_past_end(over_m, distance_m - over_m, passed, forward=True)
                s_m = passed[-1].lane.length_m
        while s_m < 0.0:
            if passed[-1].before:
                passed.append(self.curves[passed[-1].before[0]])
                s_m += passed[-1].lane.length_m
            else:
                _refuse_past_end(-s_m, distance_m - s_m, passed, forward=False)
                s_m = 0.0
        return passed, s_m


# Private


def _on_foreign_curve(s_m: float, length_m: float, start_m: float) -> float:
    kept_m = min(max(s_m, 0.0), length_m)
    if abs(s_m - kept_m) > _ROUNDING_M:
        low, high = _rounded(-start_m, 2), _rounded(length_m - start_m, 2)
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
        f"distance_m can be {_rounded(possible_m, 2):.2f} at {bound}",
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


def _rounded(value: float, digits: int) -> float:
    return round(float(value), digits) + 0.0
