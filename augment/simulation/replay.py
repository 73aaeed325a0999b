"""Recorded others, where they were."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from augment.scene.entities import AgentType
from augment.scene.recording import Recording, Track
from augment.simulation.objects import KIND_OF, Objects
from augment.simulation.states import STEP_S, FloatArray


class Replay:
    """Tracks, read every 0.1 s; who was not seen at a moment is not there.

    Args:
        recording: Its times need not be even; each step takes the nearest moment.
        tracks: Those of the recording that are replayed.
    """

    def __init__(self, recording: Recording, tracks: Sequence[Track]) -> None:
        self._tracks = tuple(tracks)
        self._times = recording.times_s
        states = [track.states for track in self._tracks]
        self._states = np.array(states).reshape(len(states), len(self._times), 4)
        self._kinds = np.array([KIND_OF[AgentType(t.type)] for t in tracks], dtype=np.int64)
        self._sizes = np.array([(t.length_m, t.width_m) for t in tracks]).reshape(-1, 2)
        self._step = 0

    def objects(self) -> Objects:
        """Those who are seen now."""
        now_s = self._step * STEP_S
        if now_s > self._times[-1] + STEP_S or not self._tracks:
            return self._made(np.zeros((0, 4)), np.zeros(0, dtype=np.int64))
        at = int(np.abs(self._times - now_s).argmin())
        states = self._states[:, at]
        seen = np.flatnonzero(~np.isnan(states).any(axis=1))
        return self._made(states[seen], seen)

    def step(self) -> None:
        """One step on."""
        self._step += 1

    def _made(self, states: FloatArray, rows: np.typing.NDArray[np.int64]) -> Objects:
        return Objects(
            ids=tuple(self._tracks[row].agent_id for row in rows),
            kinds=self._kinds[rows],
            boxes=np.hstack([states[:, :3], self._sizes[rows]]),
            speeds_mps=states[:, 3],
        )


def moves(track: Track) -> bool:
    """Whether a track goes anywhere: a metre or more from its first seen place."""
    seen = track.states[~np.isnan(track.states).any(axis=1), :2]
    return bool(len(seen) and np.hypot(*(seen - seen[0]).T).max() >= 1.0)
