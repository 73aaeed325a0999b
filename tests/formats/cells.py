"""Cells for the writers' tests: a small cast that has one of everything."""

from dataclasses import replace
from typing import Any

import numpy as np

from augment.formats.writing import Cell
from augment.scene.entities import (
    AgentType,
    Area,
    AreaKind,
    InterplanRules,
    Modification,
    Origin,
    ScenarioType,
    Scene,
    SceneOptions,
    TrafficSide,
)
from augment.scene.planned_motion import (
    AtPlace,
    AtTime,
    LanePath,
    NearEgo,
    PlannedMotion,
    PointPath,
)
from augment.scene.recording import Recording
from augment.simulation.expected import expect_recording
from tests.scene.test_planned_motion import two_lanes
from tests.scenes import cone, junction, pedestrian, scene, vehicle
from tests.simulation.worlds import track

OF_EACH_TYPE = tuple(
    vehicle(f"Agent{number}", 10.0 * number, 3.5, 3.0, type=kind, speed_mps=0.0)
    for number, kind in enumerate(
        (kind for kind in AgentType if kind is not AgentType.EGO_VEHICLE), start=20
    )
)


def cell(before: Scene | None = None, **changes: Any) -> Cell:
    """A street with a parked car, two cones and somebody who crosses."""
    cones = cone("Agent3", 20.0, -1.0), cone("Agent4", 22.5, -1.2)
    walker = pedestrian("Agent5", 70.0, -4.0, (70.0, 8.0))
    added = changes.pop("added", (vehicle("Agent2", 30.25, 0.5, 0.1), *cones, walker))
    made: dict[str, Any] = {
        "name": "street by rule", "stem": "street--rule", "type": ScenarioType.NUDGE,
        "scene": before or scene(), "modification": Modification(added=added),
    }  # fmt: skip
    return Cell(**made | changes)


def moving() -> Cell:
    """A cut-in, a late walker, a door that slides, a car that waits in vain, one that leaves."""
    motions = {
        vehicle("Agent2", 30.0, 3.5): (
            *(4.0, LanePath(lane_ids=("Lane2", "Lane1")), ()),
            NearEgo(within_m=15.0),
        ),
        pedestrian("Agent3", 60.0, -5.0): (
            *(0.0, PointPath(points_m=((60.0, 1.0), (64.0, 5.0))), ((0.0, 1.0), (1.0, 3.0))),
            AtPlace(agent_id="Agent2", x_m=44.0, y_m=3.5, within_m=1.0),
        ),
        vehicle("Agent4", 10.0, -2.0, type=AgentType.GENERIC_OBJECT): (
            *(0.0, PointPath(points_m=((10.0, -1.0),), keeps_heading=True), ((0.0, 1.0),)),
            AtTime(after_s=1.05),
        ),
        vehicle("Agent5", 80.0, -3.0): (0.0, None, ((1.0, 5.0),), AtPlace(x_m=0.0, y_m=90.0)),
        vehicle("Agent6", -20.0, 0.0): (30.0, LanePath(lane_ids=("Lane1",)), (), AtTime()),
    }
    lanes = {3.5: "Lane2", 0.0: "Lane1"}
    added = tuple(
        replace(
            agent,
            speed_mps=speed_mps,
            lane_id=lanes.get(agent.y_m),
            motion=PlannedMotion(path=path, speeds=speeds, start=start),  # type: ignore[arg-type]
        )
        for agent, (speed_mps, path, speeds, start) in motions.items()
    )
    return cell(two_lanes(), added=added, stem="moving", name="moving")


def ruled() -> Cell:
    """By interPlan's rules: a car that speeds up, one inside the ego, a walk at t0, a late one."""
    before = replace(scene(), options=SceneOptions(interplan=InterplanRules()))
    added = (
        vehicle("Agent2", 30.0, 0.3, speed_mps=5.0, lane_id="Lane1"),
        vehicle("Agent3", 2.0, 0.0, speed_mps=5.0, lane_id="Lane1"),
        pedestrian("Agent4", 40.0, -4.0, (40.0, 8.0)),
        pedestrian("Agent5", 80.0, -4.0, (80.0, 8.0)),
    )
    expected = expect_recording(before, Modification(added=added))
    return cell(before, added=added, expected=expected, stem="ruled")


AREAS = {
    AreaKind.CROSSWALK: ((16.0, -4.0), (18.0, -4.0), (18.0, 4.0), (16.0, 4.0)),
    AreaKind.CARPARK: ((40.0, 3.0), (60.0, 3.0), (60.0, 9.0)),
    AreaKind.WALKWAY: ((0.0, 3.0), (20.0, 3.0), (20.0, 5.0), (8.0, 5.5), (0.0, 5.0)),
}


def crossing() -> Scene:
    """A junction, driven on the left, with lights, a crosswalk and a car park, far from 0, 0."""
    return replace(
        junction(),
        traffic_side=TrafficSide.LEFT,
        origin=Origin(frame="UTM 48N", x_m=365000.5, y_m=143000.25, heading_rad=1.2),
        areas=tuple(
            Area(id=f"Area{number}", kind=kind, boundary_m=boundary_m)
            for number, (kind, boundary_m) in enumerate(AREAS.items(), start=1)
        ),
    )


def recorded_street() -> tuple[Scene, Recording]:
    """The ego drives on at 8 m/s; one car drives ahead and is lost, another comes after 1 s."""
    ahead = vehicle("Agent2", 20.0, 0.0, speed_mps=10.0, lane_id="Lane1")
    times = np.asarray(np.arange(31) * 0.1, dtype=np.float64)
    flat = np.zeros(31)

    def drives(x_m: float, y_m: float, heading_rad: float, speed_mps: float) -> Any:
        way = speed_mps * times * np.cos(heading_rad)
        return np.column_stack([x_m + way, flat + y_m, flat + heading_rad, flat + speed_mps])

    gone, late = drives(20.0, 0.0, 0.0, 10.0), drives(80.0, 3.5, np.pi, 6.0)
    gone[20:] = np.nan
    late[:10] = np.nan
    tracks = (track(ahead, gone), track(vehicle("Agent3", 80.0, 3.5), late))
    ego = drives(0.0, 0.0, 0.0, 8.0)
    return scene(agents=(ahead,)), Recording(times_s=times, ego=ego, tracks=tracks)
