"""The drive itself: plan, track, let traffic answer, 150 times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from augment.errors import CannotDrive
from augment.scene.entities import Modification
from augment.scene.recording import Recording
from augment.simulation.planners import IdmPlanner
from augment.simulation.road import Road
from augment.simulation.states import (
    STEP_S,
    EgoBody,
    FloatArray,
    Objects,
    Plan,
    Planner,
    Situation,
    X,
    Y,
    start_state,
)
from augment.simulation.tracker import drive_steps
from augment.simulation.traffic import DriveSetting, Traffic

DURATION_STEPS = 150


@dataclass(slots=True, kw_only=True, eq=False)
class Drive:
    """What happened. T moments, one more than steps were driven.

    Attributes:
        states: (T, 6) of the ego's rear axle.
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

    @property
    def duration_s(self) -> float:
        """How long was driven."""
        return (len(self.states) - 1) * STEP_S

    @property
    def outlasts_recording(self) -> bool:
        """Whether part of it was driven after the end of the recording."""
        return self.recorded_s is not None and self.duration_s > self.recorded_s + STEP_S / 2.0

    @property
    def boxes(self) -> FloatArray:
        """The ego's boxes (T, 5)."""
        return self.body.boxes(self.states)


def run(
    setting: DriveSetting,
    planner: Planner,
    *,
    road: Road | None = None,
    steps: int = DURATION_STEPS,
    after_step: Callable[[int], None] | None = None,
) -> Drive:
    """Drive a setting with a planner.

    Args:
        setting: The scene and its change.
        planner: Replanned every 0.1 s.
        road: The scene's map where it is laid out already.
        steps: How many at most; fewer where the map ends.
        after_step: Told the number of steps done, for heartbeats; it may raise to stop.

    Raises:
        CannotDrive: The ego is on no lane, or the planner's answer has another shape.
    """
    road = road or Road(setting.scene, setting.recording)
    body = EgoBody.of(setting.scene.ego)
    state = start_state(setting.scene.ego, body)
    traffic = Traffic(setting, road, body, state)
    planner.start(road, body)
    drive = Drive(
        road=road,
        body=body,
        states=np.empty(0),
        objects=[traffic.objects()],
        recorded_s=None if setting.recording is None else float(setting.recording.times_s[-1]),
    )
    states = [state]
    for step in range(steps):
        if _at_end(road, body, state):
            drive.at_map_end = True
            break
        objects = drive.objects[-1]
        plan = planner.plan(Situation(step=step, ego=state, objects=objects))
        following = drive_steps(_poses(plan)[None], state, body, 1)[0, 1]
        traffic.step(state, objects)
        state = following
        states.append(state)
        drive.objects.append(traffic.objects())
        drive.plans.append(plan)
        if after_step is not None:
            after_step(step + 1)
    drive.states = np.array(states)
    return drive


def _at_end(road: Road, body: EgoBody, state: FloatArray) -> bool:
    """Whether the front bumper has come to the end of the map."""
    if road.end_m >= road.centreline.length_m:
        return False
    rear_axle_m = float(road.centreline.beside(state[None, [X, Y]])[0][0])
    return rear_axle_m + body.front_m >= road.end_m


def _poses(plan: Plan) -> FloatArray:
    poses = np.asarray(plan.poses, dtype=np.float64)
    if poses.ndim != 2 or poses.shape[1] != 3 or len(poses) < 2 or not np.isfinite(poses).all():
        raise CannotDrive(
            f"The planner's poses have the shape {poses.shape}; they must be (T, 3), T "
            "at least 2, and finite."
        )
    return poses


_PACE_S = 1.0


class ExpertKind(StrEnum):
    """Where the expert's progress comes from."""

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
        """How far."""
        return self.end_m - self.start_m


def expert_of(setting: DriveSetting, road: Road, *, steps: int = DURATION_STEPS) -> Expert:
    """The recorded ego, or an IDM drive at the speed limit without the change.

    Either goes as long as the drive lasts and as far as the map goes. Where the recording ends
    before, the recorded one holds the pace of its last second.
    """
    # A recorded ego is no expert on the way to a goal, which may be another.
    has_goal = setting.scene.options.goal is not None
    if setting.recording is not None and setting.recording.shows_ego and not has_goal:
        return _recorded(setting.recording, road, EgoBody.of(setting.scene.ego), steps * STEP_S)
    plain = replace(setting, modification=Modification())
    drive = run(plain, IdmPlanner(target_mps=None), road=road, steps=steps)
    ends, _ = road.centreline.beside(drive.boxes[[0, -1], :2])
    return Expert(kind=ExpertKind.IDM, start_m=float(ends[0]), end_m=float(ends[1]))


def _recorded(recording: Recording, road: Road, body: EgoBody, duration_s: float) -> Expert:
    seen = recording.ego_is_seen & (recording.times_s <= duration_s + STEP_S / 2.0)
    times_s = recording.times_s[seen]
    stations_m, _ = road.centreline.beside(recording.ego[seen, :2])
    end_m, missing_s = float(stations_m[-1]), duration_s - float(times_s[-1])
    before_s = max(float(times_s[-1]) - _PACE_S, float(times_s[0]))
    if missing_s > STEP_S / 2.0 and before_s < times_s[-1]:
        before_m = float(np.interp(before_s, times_s, stations_m))
        end_m += max(0.0, end_m - before_m) / (float(times_s[-1]) - before_s) * missing_s
    return Expert(
        kind=ExpertKind.RECORDED,
        start_m=float(stations_m[0]),
        end_m=min(end_m, furthest_m(road, body)),
    )


def furthest_m(road: Road, body: EgoBody) -> float:
    """Where the ego's centre is when its front is at the end of the map."""
    return road.end_m - body.length_m / 2.0
