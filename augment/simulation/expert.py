"""How far somebody who knows the way would have come: what progress is measured by."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

from augment.scene.modification import Modification
from augment.simulation.drive import DURATION_STEPS, run
from augment.simulation.idm_planner import IdmPlanner
from augment.simulation.road import Road
from augment.simulation.setting import DriveSetting
from augment.simulation.states import STEP_S, EgoBody


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

    The recorded one goes as far as the drive lasts and the map goes.
    """
    if setting.recording is not None and setting.recording.shows_ego:
        times = setting.recording.times_s
        seen = setting.recording.ego_is_seen
        ego = setting.recording.ego[seen & (times <= steps * STEP_S + STEP_S / 2.0)]
        ends, _ = road.centreline.beside(ego[[0, -1], :2])
        return Expert(
            kind=ExpertKind.RECORDED,
            start_m=float(ends[0]),
            end_m=min(float(ends[1]), furthest_m(road, EgoBody.of(setting.scene.ego))),
        )
    plain = replace(setting, modification=Modification())
    drive = run(plain, IdmPlanner(target_mps=None), road=road, steps=steps)
    ends, _ = road.centreline.beside(drive.boxes[[0, -1], :2])
    return Expert(kind=ExpertKind.IDM, start_m=float(ends[0]), end_m=float(ends[1]))


def furthest_m(road: Road, body: EgoBody) -> float:
    """Where the ego's centre is when its front is at the end of the map."""
    return road.end_m - body.length_m / 2.0
