"""Recording after t0: the tracks of the others and the ego's own motion.

Frame: the ego frame of t0 (the Scene's frame). T steps.
"""

from collections.abc import Set
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from augment.geometry.frames import Pose
from augment.scene.entities import AgentType, TrafficAgent
from augment.scene.schema import CLOSED, Id, Listed, Real, Size

# Of one recording, so that a file of strangers does not fill the memory.
MOST_TRACKS = 50_000

_Number = Annotated[Real, Field(ge=-1e6, le=1e6)]
_State = tuple[_Number, _Number, _Number, _Number]
_UNSEEN = (np.nan,) * 4


def _array(rows: list[Any]) -> NDArray[np.float64]:
    array = np.array([_UNSEEN if row is None else row for row in rows], dtype=np.float64)
    array.flags.writeable = False
    return array


def _rows(array: NDArray[np.float64]) -> list[Any]:
    # JSON has no NaN: an unseen state is null.
    return [None if np.isnan(row).all() else row.tolist() for row in array]


_Moments = Annotated[list[_Number], Field(fail_fast=True, min_length=1)]
_Times = Annotated[NDArray[np.float64], Listed(_Moments, _array, _rows)]
_Columns = tuple[Literal["x_m"], Literal["y_m"], Literal["heading_rad"], Literal["speed_mps"]]
_Rows = Annotated[list[_State | None], Field(fail_fast=True)]
_States = Annotated[NDArray[np.float64], Listed(_Rows, _array, _rows)]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Track:
    """One agent over time; row t is NaN where it was not seen.

    Attributes:
        agent_id: The agent's id in the Scene, or a fresh one for who appears after t0.
        states: (T, 4): x_m, y_m, heading_rad, speed_mps of the box centre.
    """

    agent_id: Id
    type: AgentType
    length_m: Size
    width_m: Size
    states: _States


@dataclass(frozen=True, kw_only=True, eq=False)
class Recording:
    """The log from t0 on.

    Attributes:
        columns: What the four numbers of a state are.
        times_s: (T,) seconds since t0, the first is 0.
        ego: (T, 4): x_m, y_m, heading_rad, speed_mps of the ego's geometric centre; NaN where
            nobody recorded it, but never at t0.
        tracks: One entry an agent.
    """

    __pydantic_config__ = CLOSED

    columns: _Columns = ("x_m", "y_m", "heading_rad", "speed_mps")
    times_s: _Times
    ego: _States
    tracks: Annotated[tuple[Track, ...], Field(fail_fast=True, max_length=MOST_TRACKS)] = ()

    @cached_property
    def ego_alone(self) -> "Recording":
        """The same without tracks; one value, so that what depends on it is kept."""
        return replace(self, tracks=())

    def without(self, ids: Set[str]) -> "Recording":
        """Return the same without the tracks of those agents."""
        left = tuple(track for track in self.tracks if track.agent_id not in ids)
        return self if len(left) == len(self.tracks) else replace(self, tracks=left)

    @property
    def ego_is_seen(self) -> NDArray[np.bool_]:
        """At which moments the ego was recorded, (T,)."""
        return np.asarray(~np.isnan(self.ego).any(axis=1))

    @property
    def shows_ego(self) -> bool:
        """True if more of the ego was recorded than its start."""
        return int(self.ego_is_seen.sum()) > 1


def to_track(agent: TrafficAgent, states: NDArray[np.float64]) -> Track:
    """Return the track of an agent with these states (T, 4)."""
    return Track(
        agent_id=agent.id,
        type=agent.type,
        length_m=agent.length_m,
        width_m=agent.width_m,
        states=states,
    )


def track_agent(track: Track, state: NDArray[np.float64]) -> TrafficAgent:
    """Return the agent of a track as it is in one of its states (4,)."""
    x_m, y_m, heading_rad, speed_mps = (float(value) for value in state)
    pose, size_m = Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad), (track.length_m, track.width_m)
    return TrafficAgent.at(track.type, pose, size_m, id=track.agent_id, speed_mps=speed_mps)
