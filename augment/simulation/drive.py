"""The drive itself: plan, track, let traffic answer, 150 times; and who it is measured by."""

import math
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from augment.errors import CannotDrive
from augment.scene.entities import Modification
from augment.scene.recording import Recording
from augment.simulation.planning import IdmPlanner, Plan, Planner, Situation, is_of_signal
from augment.simulation.road import Road
from augment.simulation.shapes import move_ahead
from augment.simulation.states import STEP_S, EgoBody, FloatArray, Objects, start_state
from augment.simulation.tracker import drive_steps
from augment.simulation.traffic import DriveSetting, Traffic

STEPS = {False: 150, True: 300}
"""How long a drive lasts, by whether it goes by interPlan's rules."""
NEAR_GOAL_M = 0.1
"""interPlan's goal is the rear axle of the recorded ego at the end; this near, it is reached."""
# The pace at the end of a recording is that of so much time.
_PACE_S = 1.0


@dataclass(slots=True, kw_only=True, eq=False)
class Drive:
    """Result of a closed-loop drive. T moments, one more than steps were driven.

    Attributes:
        states: (T, 6) of the ego's rear axle.
        boxes: (T, 5) of the ego.
        objects: T rows of who was there.
        plans: T - 1 plans, one a step.
        at_map_end: Whether the drive ended early because the road did.
        recorded_s: How long a recording of its scene lasts, None without one.
    """

    road: Road
    body: EgoBody
    states: FloatArray
    objects: list[Objects]
    plans: list[Plan] = field(default_factory=list)
    at_map_end: bool = False
    recorded_s: float | None = None
    boxes: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        self.boxes = self.body.boxes(self.states)

    @property
    def duration_s(self) -> float:
        """Driven time in s."""
        return (len(self.states) - 1) * STEP_S

    @property
    def outlasts_recording(self) -> bool:
        """True if part of it was driven after the end of the recording."""
        return self.recorded_s is not None and self.duration_s > self.recorded_s + STEP_S / 2.0


def run(
    setting: DriveSetting,
    planner: Planner,
    *,
    road: Road | None = None,
    steps: int | None = None,
    after_step: Callable[[int], None] | None = None,
) -> Drive:
    """Drive a setting with a planner.

    Args:
        setting: The scene and its change.
        planner: Replanned every 0.1 s.
        road: The scene's map where it is laid out already.
        steps: How many at most, None for as many as the scene's rules say; fewer where the map
            or interPlan's goal is.
        after_step: Told the number of steps done, for heartbeats; it may raise to stop.

    Raises:
        CannotDrive: The ego is on no lane, the planner's answer has another shape, or it exits.
    """
    road = road or Road(setting.scene, setting.recording)
    body = EgoBody.of(setting.scene.ego)
    states = [start_state(setting.scene.ego, body)]
    traffic = Traffic(setting, road, body, states[0])
    objects, plans, at_end = [traffic.objects()], list[Plan](), False
    goal_m = _goal_m(setting, road, body)
    try:
        planner.start(road, body)
        for step in range(steps or STEPS[setting.scene.options.interplan is not None]):
            if road.end_m < road.centreline.length_m:
                at_end = road.centreline.station_of(states[-1]) + body.front_m >= road.end_m
            if at_end or road.centreline.station_of(body.boxes(states[-1])) > goal_m:
                break
            situation = Situation(step=step, ego=states[-1], objects=objects[-1])
            # Copies, for whoever computes in place: a drive is not to change by it.
            plans.append(deepcopy(planner.plan(deepcopy(situation))))
            # (1, T, 3) in, (1, 2, 6) out: one reference, the state now and after one step.
            following = drive_steps(_poses(plans[-1])[None], states[-1], body, 1)[0, 1]
            # With the ego of the same moment: neither side knows the other's next step.
            traffic.step(states[-1], objects[-1])
            states.append(following)
            objects.append(traffic.objects())
            if after_step is not None:
                after_step(step + 1)
    except SystemExit as error:  # it would end worker after worker
        if is_of_signal(error):
            raise
        raise CannotDrive(f"The planner ended the process: exit {error.code!r}.") from error
    return Drive(
        road=road,
        body=body,
        states=np.array(states),
        objects=objects,
        plans=plans,
        at_map_end=at_end,
        recorded_s=None if setting.recording is None else float(setting.recording.times_s[-1]),
    )


def _goal_m(setting: DriveSetting, road: Road, body: EgoBody) -> float:
    """Return interPlan's end of a drive on the centreline in m; a goal it names ends none here."""
    recording, options = setting.recording, setting.scene.options
    if options.interplan is None or options.goal or not (recording and recording.shows_ego):
        return math.inf
    # Recordings are of the centre, the goal is of the rear axle.
    axle = move_ahead(recording.ego[recording.ego_is_seen][-1, :3], -body.centre_m)
    return road.centreline.station_of(axle) - NEAR_GOAL_M


def _poses(plan: Plan) -> FloatArray:
    poses = np.asarray(plan.poses, dtype=np.float64)
    if poses.ndim != 2 or poses.shape[1] != 3 or len(poses) < 2 or not np.isfinite(poses).all():
        raise CannotDrive(
            f"The planner's poses have the shape {poses.shape}; they must be (T, 3), T "
            "at least 2, and finite."
        )
    return poses


class ExpertKind(StrEnum):
    """Source of the expert's progress."""

    RECORDED = "recorded"
    IDM = "idm"


@dataclass(frozen=True, slots=True, kw_only=True)
class Expert:
    """The expert's way along the centreline, in metres of the ego's centre."""

    kind: ExpertKind
    start_m: float
    end_m: float

    @property
    def progress_m(self) -> float:
        """Progress along the route in m."""
        return self.end_m - self.start_m


def find_expert(setting: DriveSetting, road: Road, *, steps: int | None = None) -> Expert:
    """Return the recorded ego, or an IDM drive at the speed limit without the change.

    Either goes as long as the drive lasts and as far as the map goes. Where the recording ends
    before, the recorded one holds the pace of its last second.
    """
    steps = steps or STEPS[setting.scene.options.interplan is not None]
    # A recorded ego is no expert on the way to a goal, which may be another.
    has_goal = setting.scene.options.goal is not None
    if setting.recording is not None and setting.recording.shows_ego and not has_goal:
        end_m = road.end_m - setting.scene.ego.length_m / 2.0
        return _read_recorded(setting.recording, road, end_m, steps * STEP_S)
    plain = replace(setting, modification=Modification())
    drive = run(plain, IdmPlanner(target_mps=None), road=road, steps=steps)
    ends, _ = road.centreline.beside(drive.boxes[[0, -1], :2])
    return Expert(kind=ExpertKind.IDM, start_m=float(ends[0]), end_m=float(ends[1]))


def _read_recorded(
    recording: Recording, road: Road, furthest_m: float, duration_s: float
) -> Expert:
    seen = recording.ego_is_seen & (recording.times_s <= duration_s + STEP_S / 2.0)
    times_s = recording.times_s[seen]
    stations_m, _ = road.centreline.beside(recording.ego[seen, :2])
    end_m, missing_s = float(stations_m[-1]), duration_s - float(times_s[-1])
    before_s = max(float(times_s[-1]) - _PACE_S, float(times_s[0]))
    if missing_s > STEP_S / 2.0 and before_s < times_s[-1]:
        before_m = float(np.interp(before_s, times_s, stations_m))
        # Metres over seconds of the last second, for as long as is missing.
        end_m += max(0.0, end_m - before_m) / (float(times_s[-1]) - before_s) * missing_s
    return Expert(
        kind=ExpertKind.RECORDED, start_m=float(stations_m[0]), end_m=min(end_m, furthest_m)
    )
