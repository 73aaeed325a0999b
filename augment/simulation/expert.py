"""How far somebody who knows the way would have come: what progress is measured by."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from augment.scene.modification import Modification
from augment.scene.recording import Recording
from augment.simulation.drive import DURATION_STEPS, run
from augment.simulation.idm_planner import IdmPlanner
from augment.simulation.road import Road
from augment.simulation.setting import DriveSetting
from augment.simulation.states import STEP_S, EgoBody

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
