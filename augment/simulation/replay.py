"""Recorded others, where they were as long as the recording lasts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from augment.scene.entities import TrafficAgent
from augment.scene.recording import Recording, Track, agent_of
from augment.simulation.objects import KIND_OF, NOBODY, Objects
from augment.simulation.states import STEP_S, FloatArray, IntArray

STANDS_BELOW_MPS = 0.5
"""Recorded speeds of what is parked are not quite 0."""


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
        self._kinds = np.array([KIND_OF[t.type] for t in tracks], dtype=np.int64)
        self._sizes = np.array([(t.length_m, t.width_m) for t in tracks]).reshape(-1, 2)
        self._step, self._last_step = 0, round(float(self._times[-1]) / STEP_S)

    def objects(self) -> Objects:
        """Those who are seen now."""
        if self._step > self._last_step or not self._tracks:
            return NOBODY
        states, rows = self._seen()
        return Objects(
            ids=tuple(self._tracks[row].agent_id for row in rows),
            kinds=self._kinds[rows],
            boxes=np.hstack([states[:, :3], self._sizes[rows]]),
            speeds_mps=states[:, 3],
        )

    @property
    def ends_now(self) -> bool:
        """Whether this is the last step that was recorded."""
        return self._step == self._last_step

    def agents(self) -> list[TrafficAgent]:
        """Those who are seen now, as agents who go on from here; who hardly moves stands."""
        states, rows = self._seen()
        tracks = [self._tracks[row] for row in rows]
        states[states[:, 3] < STANDS_BELOW_MPS, 3] = 0.0
        return [agent_of(track, state) for track, state in zip(tracks, states, strict=True)]

    def step(self) -> None:
        """One step on."""
        self._step += 1

    def _seen(self) -> tuple[FloatArray, IntArray]:
        """States (A, 4) and rows (A,) of those who are seen now."""
        at = int(np.abs(self._times - self._step * STEP_S).argmin())
        states = self._states[:, at]
        rows = np.flatnonzero(~np.isnan(states).any(axis=1))
        return states[rows], rows


def moves(track: Track) -> bool:
    """Whether a track goes anywhere: a metre or more from its first seen place."""
    seen = track.states[~np.isnan(track.states).any(axis=1), :2]
    return bool(len(seen) and np.hypot(*(seen - seen[0]).T).max() >= 1.0)
