"""What was recorded after t0: the tracks of the others and the ego's own motion.

Frame: the ego frame of t0 (the Scene's frame). T steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from augment.scene.entities import AgentType, TrafficAgent


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Track:
    """One agent over time; row t is NaN where it was not seen.

    Attributes:
        agent_id: The agent's id in the Scene, or a fresh one for who appears after t0.
        states: (T, 4): x_m, y_m, heading_rad, speed_mps of the box centre.
    """

    agent_id: str
    type: str
    length_m: float
    width_m: float
    states: NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording:
    """The log from t0 on.

    Attributes:
        times_s: (T,) seconds since t0, the first is 0.
        ego: (T, 4): x_m, y_m, heading_rad, speed_mps of the ego's geometric centre; NaN where
            nobody recorded it, but never at t0.
        tracks: One entry an agent.
    """

    times_s: NDArray[np.float64]
    ego: NDArray[np.float64]
    tracks: tuple[Track, ...]

    @property
    def ego_is_seen(self) -> NDArray[np.bool_]:
        """At which moments the ego was recorded, (T,)."""
        return np.asarray(~np.isnan(self.ego).any(axis=1))

    @property
    def shows_ego(self) -> bool:
        """Whether more of the ego was recorded than where it began."""
        return int(self.ego_is_seen.sum()) > 1


def agent_of(track: Track, state: NDArray[np.float64]) -> TrafficAgent:
    """Return the agent of a track as it is in one of its states (4,)."""
    x_m, y_m, heading_rad, speed_mps = (float(value) for value in state)
    return TrafficAgent(
        id=track.agent_id,
        type=AgentType(track.type),
        x_m=x_m,
        y_m=y_m,
        heading_rad=heading_rad,
        width_m=track.width_m,
        length_m=track.length_m,
        speed_mps=speed_mps,
    )
