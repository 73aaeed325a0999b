"""Argoverse 2 Sensor logs: one folder a log, with boxes, ego poses and a vector map.

    <log>/annotations.feather, <log>/city_SE3_egovehicle.feather, <log>/map/log_map_archive_*.json

A frame is an annotated sweep, counted from 0. The scene's frame is that of t0's ego, with its
origin at the ego's geometric centre (see `log`); it keeps what lies within `RADIUS_M` of it.
Metres are rounded to millimetres, so that documents can be read by people.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from augment.errors import InvalidDocument
from augment.formats.argoverse2.log import (
    EGO_LENGTH_M,
    EGO_WIDTH_M,
    WHAT,
    Log,
    LoggedTrack,
    read_log,
)
from augment.formats.argoverse2.road import RADIUS_M, read_road
from augment.geometry.angles import wrap
from augment.geometry.frames import Pose
from augment.scene.entities import AgentType, Origin, Scene, TrafficAgent
from augment.scene.lane_graph import LaneGraph
from augment.scene.recording import Recording, Track

FloatArray = NDArray[np.float64]

_STANDING = (
    AgentType.TRAFFIC_CONE,
    AgentType.BARRIER,
    AgentType.CONSTRUCTION_SIGN,
)
_HEADED = (AgentType.VEHICLE, AgentType.BUS, AgentType.BICYCLE)


def read(folder: Path, *, frame: int, name: str) -> tuple[Scene, Recording]:
    """The scene at one annotated sweep, and what was recorded from there to the end of the log.

    Args:
        folder: The log's folder.
        frame: The sweep that becomes t0, from 0.
        name: The scene's slug.

    Raises:
        InvalidDocument: The folder, a file or the frame is not there, or a file is broken.
    """
    if not folder.is_dir():
        raise InvalidDocument(WHAT, [(str(folder), "is not a folder")])
    map_file = _map_file(folder)
    log = read_log(folder)
    if not 0 <= frame < len(log.times_s):
        allowed = f"this log has frames 0 to {len(log.times_s) - 1}"
        raise InvalidDocument(WHAT, [("frame", f"{frame} is not there; {allowed}")])
    x_m, y_m, heading_rad, speed_mps = log.ego[frame].tolist()
    origin = Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad)
    road = read_road(map_file, origin)
    named = _named(log, frame)
    ego = TrafficAgent(
        id="Agent1",
        type=AgentType.EGO_VEHICLE,
        x_m=0.0,
        y_m=0.0,
        heading_rad=0.0,
        width_m=EGO_WIDTH_M,
        length_m=EGO_LENGTH_M,
        speed_mps=round(speed_mps, 3),
    )
    scene = Scene(
        name=name,
        ego=ego,
        traffic_side=road.traffic_side,
        origin=Origin(frame=_city(map_file), pose=origin),
        provenance=(
            f"Argoverse 2 Sensor data set, log {folder.resolve().name}, frame {frame} of "
            f"{len(log.times_s)}; CC BY-NC-SA 4.0"
        ),
        agents=_agents(named, frame, origin),
        lanes=road.lanes,
        connectors=road.connectors,
        areas=road.areas,
    )
    return _on_lanes(scene), _recording(log, named, frame, origin)


# Private


def _map_file(folder: Path) -> Path:
    found = sorted((folder / "map").glob("log_map_archive_*.json"))
    if len(found) != 1:
        text = "no such file" if not found else f"{len(found)} such files; there must be one"
        raise InvalidDocument(WHAT, [("map/log_map_archive_*.json", f"{text} in {folder}")])
    return found[0]


def _city(map_file: Path) -> str:
    city = re.search(r"____([A-Z]+)_city", map_file.name)
    return f"Argoverse 2 city frame {city[1]}" if city else "Argoverse 2 city frame"


def _named(log: Log, frame: int) -> dict[str, LoggedTrack]:
    """The tracks near the ego from t0 on, by agent id: who is there at t0 first, then by time.

    Within one sweep the nearest comes first.
    """
    met = []
    for track in log.tracks:
        later = track.sweeps >= frame
        sweeps, states = track.sweeps[later], track.states[later]
        distances = np.hypot(*(states[:, :2] - log.ego[sweeps, :2]).T)
        near = np.flatnonzero(distances <= RADIUS_M)
        if len(near):
            first = near[0]
            met.append((int(sweeps[first]), round(float(distances[first]), 3), track.uuid, track))
    met.sort(key=lambda item: item[:3])
    return {f"Agent{number}": track for number, (*_, track) in enumerate(met, start=2)}


def _agents(named: dict[str, LoggedTrack], frame: int, origin: Pose) -> tuple[TrafficAgent, ...]:
    agents = []
    for agent_id, track in named.items():
        states = _local(track.states[track.sweeps == frame], origin)
        if not len(states) or np.hypot(*states[0, :2]) > RADIUS_M:
            continue
        x_m, y_m, heading_rad, speed_mps = states[0].tolist()
        agents.append(
            TrafficAgent(
                id=agent_id,
                type=track.type,
                x_m=x_m,
                y_m=y_m,
                heading_rad=heading_rad,
                width_m=round(track.width_m, 3),
                length_m=round(track.length_m, 3),
                speed_mps=0.0 if track.type in _STANDING else speed_mps,
            )
        )
    return tuple(agents)


def _on_lanes(scene: Scene) -> Scene:
    """Everyone with the lane under them; only of what drives does the heading count."""
    graph = LaneGraph(scene)

    def placed(agent: TrafficAgent) -> TrafficAgent:
        heading_rad = agent.heading_rad if agent.type in _HEADED else None
        return replace(agent, lane_id=graph.under(agent.x_m, agent.y_m, heading_rad))

    ego = replace(scene.ego, lane_id=graph.under(0.0, 0.0, 0.0))
    return replace(scene, ego=ego, agents=tuple(placed(agent) for agent in scene.agents))


def _recording(log: Log, named: dict[str, LoggedTrack], frame: int, origin: Pose) -> Recording:
    steps = len(log.times_s) - frame
    tracks = []
    for agent_id, track in named.items():
        states = np.full((steps, 4), np.nan)
        later = track.sweeps >= frame
        states[track.sweeps[later] - frame] = _local(track.states[later], origin)
        tracks.append(
            Track(
                agent_id=agent_id,
                type=track.type.value,
                length_m=round(track.length_m, 3),
                width_m=round(track.width_m, 3),
                states=states,
            )
        )
    return Recording(
        times_s=np.round(log.times_s[frame:] - log.times_s[frame], 6),
        ego=_local(log.ego[frame:], origin),
        tracks=tuple(tracks),
    )


def _local(states: FloatArray, origin: Pose) -> FloatArray:
    """States (K, 4) of the city frame in the frame of t0's ego, rounded."""
    xy = np.round(origin.to_local(states[:, :2]), 3)
    headings = [round(wrap(heading - origin.heading_rad), 4) for heading in states[:, 2].tolist()]
    return np.column_stack([xy, headings, np.round(states[:, 3], 3)])
