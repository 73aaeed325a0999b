"""The function that the FC-plus variant offers to a language model: a pose on a lane.

In: a `Scene`, and the arguments of a call. Out: a `PoseOnLane`, which the model gets as JSON, or
a `ToolError` whose sentence tells the model what was wrong.

`pose_on_lane(lane, start, distance_m, lateral_m, object)` answers from the recorded centrelines,
under the same short ids as the prompt shows. It follows the lanes across connectors, along the
ego's route where they belong to it, else straightest first, and says which lane lies under the
place and who stands there, and where an object that sets out there is some seconds later.
Everything is computed from the scene before the change.

Frame: ego frame; s along the shown part of a lane, from where it begins.
"""

import math
from collections.abc import Callable
from dataclasses import MISSING, asdict, dataclass, fields
from functools import cached_property
from typing import Annotated, Any

import numpy as np
import pydantic
from pydantic import Field

from augment.checks import Ground
from augment.checks.bodies import TOUCH_M
from augment.errors import InvalidModification, ToolError
from augment.geometry.frames import Box, Pose, overlap
from augment.prompts import vectors
from augment.prompts.blocks import Strict
from augment.prompts.vectors import LaneCurve
from augment.scene.density import usual_size_m
from augment.scene.entities import AgentType, Modification, TrafficAgent
from augment.scene.motion import LENGTH_S, STEP_S, Motion, Movement
from augment.scene.planned_motion import PlannedMotion
from augment.scene.planned_mover import check_motions, run_beside
from augment.simulation.expected import expect_recording
from augment.variants.retrieval import OBJECT_TYPES, Along, LaneTool, list_known

LANE_START = "lane"
WIDEST_M = 30.0
MOST_PLACES = 16

# How far an agent may be past an end of a lane and still count as beside it.
BESIDE_WITHIN_M = 1.0
FURTHEST_EDGE_M = 30.0
# A place that is offered as free leaves this in front of the object and behind it.
FREE_GAP_M = 0.5

_OF_A_PLACE = frozenset({"distance_m", "lateral_m", "x_m", "y_m", "heading_rad", "error"})
"""What stands at every place of an answer about several, be it the same everywhere."""
_ROUNDING_M = 0.005
_SEARCHED_M, _STEP_M = 50.0, 0.5

_Several = (pydantic.BeforeValidator(lambda value: value if isinstance(value, list) else [value]),)
_Many = Field(min_length=1, max_length=MOST_PLACES)
_Aside = Annotated[float, Field(ge=-WIDEST_M, le=WIDEST_M)]
_Seconds = Annotated[float, Field(ge=0.0, le=LENGTH_S)]
_Kind = Annotated[
    str, Field(pattern=f"^({'|'.join(OBJECT_TYPES)})$"), pydantic.AfterValidator(AgentType)
]


class _Call(Strict):
    """The arguments of a call; one value counts as a list of it."""

    lane: Any
    start: str
    distance_m: Annotated[list[Along], *_Several, _Many]
    lateral_m: Annotated[list[_Aside | None], *_Several, _Many] = [None]
    object: Annotated[list[_Kind], *_Several, _Many] = [AgentType.VEHICLE]
    speed_mps: Annotated[float, Field(ge=0.0, le=60.0)] = 0.0
    motion: PlannedMotion | None = None
    after_s: Annotated[list[_Seconds], *_Several, Field(max_length=MOST_PLACES)] = []


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseOnLane:
    """One place, with what lies around it; `along_m` is counted on the last lane of the route.

    Attributes:
        lane: The short id of the shown lane or connector under the place, None where there is
            none. Of several the one that the place was counted on.
        lanes_beside: Short ids of the shown lanes that one can change to from there.
        taken_by: Short ids of those in whose place an object there would stand; None for nobody.
        edge_left_m, edge_right_m: From the centre of that lane to the edge of the road, which lies
            beyond all lanes, but before a carpark. None without one within 30 m.
        carpark_left_m, carpark_right_m, walkway_left_m, walkway_right_m: To where these begin.
        nearest_free_m: The distance of the nearest free place.
        start_lateral_m: How far left of the lane the starting agent is, None without one.
    """

    pose: Pose
    lane: str | None
    taken_by: list[str] | None
    along_m: float
    remaining_m: float
    lane_width_m: float
    edge_left_m: float | None
    edge_right_m: float | None
    next_lanes: list[str]
    route: list[str]
    lanes_beside: list[str] | None = None
    carpark_left_m: float | None = None
    carpark_right_m: float | None = None
    walkway_left_m: float | None = None
    walkway_right_m: float | None = None
    nearest_free_m: float | None = None
    start_lateral_m: float | None = None

    def to_document(self) -> dict[str, object]:
        """Return the answer under the names of the answer's block, rounded as the prompt is."""
        document: dict[str, object] = {
            "x_m": _round(self.pose.x_m),
            "y_m": _round(self.pose.y_m),
            "heading_rad": _round_angle(self.pose.heading_rad),
            "heading_deg": _round(math.degrees(_round_angle(self.pose.heading_rad)), 1),
        }
        for field in fields(self)[1:]:
            value = getattr(self, field.name)
            if value is not None or field.default is MISSING:
                document[field.name] = _round(value) if isinstance(value, float) else value
        return document


class PoseTool(LaneTool):
    """Our function for one scene."""

    def pose_on_lane(
        self,
        lane: object,
        start: str,
        distance_m: float,
        lateral_m: float | None = None,
        object_type: AgentType = AgentType.VEHICLE,
    ) -> PoseOnLane:
        """Return the pose `distance_m` from the start along the lane, `lateral_m` to its left.

        Args:
            lane: The short id of a lane, connector or piece, or the control points of a piece.
            start: "lane" for its beginning, or an agent's id for the place beside that agent.
            distance_m: Along the direction of travel, on over connectors; negative goes back.
            lateral_m: To the left of the direction of travel, negative to the right. Without one
                it is 0, but where an agent stands (`distance_m` 0 from it) its own.
            object_type: Of what is to stand there.

        Raises:
            ToolError: Nobody knows the lane or the agent, the agent is not beside the lane, or
                the lanes end before the distance does.
        """
        curve, begins_m = self.find_line(lane)
        start_m, start_lateral_m = self._start(curve, begins_m, start)
        is_own = distance_m == 0.0 and lateral_m is None
        lateral_m = (start_lateral_m or 0.0) if is_own else lateral_m or 0.0

        def pose_at(along_m: float) -> Pose:
            passed, s_m = self._walk(curve, start_m, along_m)
            return passed[-1].pose_at(s_m, lateral_m)

        passed, s_m = self._walk(curve, start_m, distance_m)
        last = passed[-1]
        pose, centre = last.pose_at(s_m, lateral_m), last.pose_at(s_m)
        # Who starts from its own place does not stand in its own way.
        taken_by = [
            occupant
            for occupant in self._taken_by(pose, object_type)
            if not (is_own and occupant == start)
        ]
        free_m = self._nearest_free_m(pose_at, object_type, distance_m) if taken_by else None
        return PoseOnLane(
            pose=pose,
            lane=self._under(pose, last, lateral_m),
            taken_by=taken_by or None,
            along_m=s_m,
            remaining_m=last.length_m - s_m,
            lane_width_m=last.width_m,
            next_lanes=list(last.after),
            lanes_beside=self._beside(last, centre) or None,
            route=[lane.id for lane in passed],
            nearest_free_m=free_m,
            start_lateral_m=start_lateral_m,
            **self._side(centre, "left", math.pi / 2.0),
            **self._side(centre, "right", -math.pi / 2.0),
        )

    def answer_call(self, arguments: object) -> dict[str, object]:
        """Return a pose, or {"poses": one entry a place} where several distances were asked for.

        What is the same at all of them stands beside it; at each place that has no answer stands
        {"error": a sentence}.
        """
        call = _Call.model_validate(arguments)
        lists: list[list[Any]] = [call.distance_m, call.lateral_m, call.object]
        count = max(map(len, lists))
        if any(len(values) not in (1, count) for values in lists):
            text = "make the lists equally long, or give one value for all places"
            raise ToolError(text)
        # What is no list goes with each of the others.
        places = list(zip(*(values * (count // len(values)) for values in lists), strict=True))
        answers = [self._answer_at(call, *place) for place in places]
        assert isinstance(arguments, dict)
        if not any(isinstance(arguments.get(name), list) for name in _PLACES):
            return answers[0]
        answers = [
            {"distance_m": along_m, "lateral_m": aside_m or 0.0} | answer
            for (along_m, aside_m, _), answer in zip(places, answers, strict=True)
        ]
        shared = {
            name: value
            for name, value in answers[0].items()
            if name not in _OF_A_PLACE
            and all(name in answer and answer[name] == value for answer in answers)
        }
        own = [{name: answer[name] for name in answer if name not in shared} for answer in answers]
        return {"poses": own, **shared}

    @cached_property
    def _ground(self) -> Ground:
        return Ground.of(self._shown, expect_recording)

    @cached_property
    def _ego_route(self) -> frozenset[str]:
        """Short ids of the lanes that the ego's goal leads over."""
        route = self._ground.route
        return frozenset(route.lane_ids if route else ())

    def _answer_at(
        self, call: _Call, distance_m: float, lateral_m: float | None, object_type: AgentType
    ) -> dict[str, object]:
        try:
            place = self.pose_on_lane(call.lane, call.start, distance_m, lateral_m, object_type)
            later = self._later(call, place, object_type) if call.motion or call.after_s else {}
        except ToolError as fault:
            return {"error": str(fault)}
        return place.to_document() | later

    def _later(self, call: _Call, place: PoseOnLane, object_type: AgentType) -> dict[str, object]:
        """Return where an object is that many seconds after it stood at a place.

        Raises:
            ToolError: Its motion can't be carried out.
        """
        length_m, width_m = usual_size_m(self._shown, object_type)
        agent = TrafficAgent(
            id=vectors.short_names(self._shown).next_agent,
            type=object_type,
            **asdict(place.pose),
            width_m=width_m,
            length_m=length_m,
            speed_mps=call.speed_mps,
            lane_id=place.lane,
            motion=call.motion,
        )
        change = Modification(added=(agent,))
        try:
            check_motions(self._shown, change)
        except InvalidModification as fault:
            raise ToolError(str(fault)) from None
        motion = self._ground.motion_after(change, of_all=False)
        moved = motion.others[-1]
        later: dict[str, object] = {"later": [self._at(s, moved, motion) for s in call.after_s]}
        return later | ({"started_s": _round(moved.started_s)} if call.motion else {})

    def _at(self, after_s: float, moved: Movement, motion: Motion) -> dict[str, object]:
        """Return where one is at the step nearest to a moment, and how far from the ego."""
        step = round(after_s / STEP_S)
        x_m, y_m, heading_rad, speed_mps = moved.states[step].tolist()
        if math.isnan(x_m):
            return {"after_s": after_s, "error": "it has left the lanes of the map"}
        ego_x_m, ego_y_m = motion.ego.states[step, :2].tolist()
        ego_m = math.dist((x_m, y_m), (ego_x_m, ego_y_m))
        route, ahead_m = self._ground.route, None
        if route is not None:
            ahead_m = route.locate(x_m, y_m).ahead_m - route.locate(ego_x_m, ego_y_m).ahead_m
        lane_id = self._ground.graph.under(x_m, y_m, heading_rad)
        return {
            "after_s": after_s,
            "x_m": _round(x_m),
            "y_m": _round(y_m),
            "heading_rad": _round_angle(heading_rad),
            "speed_mps": _round(speed_mps),
            "lane": lane_id,
            "ego_distance_m": _round(ego_m),
            "ahead_m": _round(ahead_m),
        }

    def _start(self, curve: LaneCurve, begins_m: float, start: str) -> tuple[float, float | None]:
        """Return where the distance starts, and how far left of the lane the agent there is."""
        if start == LANE_START:
            return begins_m, None
        if start not in self.agents:
            problem = list_known("agent", start, self.agents)
            raise ToolError(f'{problem} Or start at "{LANE_START}", its beginning.')
        agent = self.agents[start]
        place = curve.project(agent.x_m, agent.y_m)
        is_before = place.s_m <= 1e-3
        end = curve.pose_at(place.s_m)
        past_m = float(abs(end.to_local(np.array([[agent.x_m, agent.y_m]]))[0, 0]))
        is_beside = not is_before and place.s_m < curve.length_m - 1e-3
        if is_beside or past_m <= BESIDE_WITHIN_M:
            return place.s_m, place.d_m
        where = "before the beginning" if is_before else "past the end"
        is_shown = agent.lane_id in self.curves
        advice = f'call with lane "{agent.lane_id}"' if is_shown else "name a lane beside it"
        raise ToolError(
            f"{start} is not beside this lane, it is {past_m:.1f} m {where} of it. To start from "
            f'{start}, {advice}; to start from the beginning of this lane, use "{LANE_START}".'
        )

    def _walk(
        self, curve: LaneCurve, start_m: float, distance_m: float
    ) -> tuple[list[LaneCurve], float]:
        """Return the lanes passed on the way, and s on the last of them."""
        s_m, passed = start_m + distance_m, [curve]
        while s_m > passed[-1].length_m:
            here, over_m = passed[-1], s_m - passed[-1].length_m
            if not here.after:
                _refuse_past_end(over_m, distance_m - over_m, passed, "end", "most")
                return passed, here.length_m
            # The ego's route where it leads there, else straight on.
            routed = self._ego_route if here.id in self._ego_route else frozenset()
            following = next((name for name in here.after if name in routed), here.after[0])
            passed.append(self.curves[following])
            s_m = over_m
        while s_m < 0.0:
            if not passed[-1].before:
                _refuse_past_end(-s_m, distance_m - s_m, passed, "begin", "least")
                return passed, 0.0
            passed.append(self.curves[passed[-1].before[0]])
            s_m += passed[-1].length_m
        return passed, s_m

    def _under(self, pose: Pose, counted: LaneCurve, lateral_m: float) -> str | None:
        """Return the shown lane under a place: the one it was counted on, if that is."""
        if abs(lateral_m) <= counted.width_m / 2.0:
            return counted.id
        lane_id = self._ground.graph.under(pose.x_m, pose.y_m, pose.heading_rad)
        return lane_id if lane_id in self.curves else None

    def _beside(self, curve: LaneCurve, centre: Pose) -> list[str]:
        """Return the shown lanes beside a place on a lane that a path may change to."""
        graph = self._ground.graph
        return [
            lane.lane_id
            for lane in graph.beside(centre.x_m, centre.y_m)
            if lane.beyond_m == 0.0
            and lane.lane_id in self.curves
            and run_beside(graph, curve.whole.id, lane.lane_id)
        ]

    def _side(self, centre: Pose, side: str, turn_rad: float) -> dict[str, Any]:
        """Return the side of the road in the direction turned so far from a lane's own."""
        ground, ray = self._ground, (centre.x_m, centre.y_m, centre.heading_rad + turn_rad)
        carpark_m = ground.carparks.begins_m(*ray, FURTHEST_EDGE_M)
        edge_m = ground.road.reach_m(*ray, FURTHEST_EDGE_M)
        if carpark_m is not None and 0.0 < carpark_m < (math.inf if edge_m is None else edge_m):
            edge_m = carpark_m
        return {
            f"edge_{side}_m": edge_m,
            f"carpark_{side}_m": carpark_m,
            f"walkway_{side}_m": ground.walkways.begins_m(*ray, FURTHEST_EDGE_M),
        }

    def _taken_by(self, pose: Pose, object_type: AgentType, gap_m: float = 0.0) -> list[str]:
        """Return the ids of those whose boxes an object would overlap, with a gap at its ends."""
        length_m, width_m = usual_size_m(self._shown, object_type)
        box = Box(pose=pose, length_m=length_m + 2.0 * gap_m, width_m=width_m)
        reach_m = math.hypot(box.length_m, box.width_m) / 2.0
        return [
            name
            for name, agent in self.agents.items()
            if math.dist((pose.x_m, pose.y_m), (agent.x_m, agent.y_m))
            <= reach_m + math.hypot(agent.length_m, agent.width_m) / 2.0
            and overlap(box, agent.box).depth_m > TOUCH_M
        ]

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

_PLACES = ("distance_m", "lateral_m", "object")


def _refuse_past_end(
    over_m: float, possible_m: float, passed: list[LaneCurve], side: str, bound: str
) -> None:
    """Raise where the lanes end by more than rounding before the distance does."""
    if over_m <= _ROUNDING_M:
        return
    path = " -> ".join(curve.id for curve in passed)
    raise ToolError(
        f"the lanes that are shown {side} {over_m:.2f} m short of that ({path}): from this start "
        f"distance_m can be {_round(possible_m):.2f} at {bound}"
    )


def _round_angle(angle_rad: float) -> float:
    """Round an angle; half a turn is pi to either side."""
    rounded = round(angle_rad, 3) + 0.0
    return -rounded if rounded == -round(math.pi, 3) else rounded


def _round(value: float | None, digits: int = 2) -> float | None:
    """Round, and never to minus zero; unknown stays unknown."""
    return None if value is None else round(float(value), digits) + 0.0
