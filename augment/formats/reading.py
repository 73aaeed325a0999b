"""What every reader gives, and what every reader is.

A reader knows one format of recorded data. It is pure: a path goes in, values come out, and what
is wrong with the file is raised as `InvalidDocument`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from augment.errors import InvalidDocument
from augment.scene.entities import Scene
from augment.scene.recording import Note, Recording


@dataclass(frozen=True, slots=True, kw_only=True)
class Moment:
    """A time that can become t0.

    Attributes:
        item: Which part of a file that holds several; None where there is one. A number of a
            record, a planning problem, a lidar_pc token.
        frame: The step of it, from 0.
        time_s: Since the first step of its part; None where there is one step alone.
    """

    item: str | None = None
    frame: int = 0
    time_s: float | None = field(default=None, compare=False)

    def __str__(self) -> str:
        return f"frame {self.frame}" if self.item is None else f"{self.item}, frame {self.frame}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """A scene, what was recorded from it on, and what the source did not say.

    Attributes:
        recording: None for a source that is no recording.
        notes: Every loss and assumption.
        moment: What was taken.
    """

    scene: Scene
    recording: Recording | None
    notes: tuple[Note, ...] = ()
    moment: Moment = Moment()


class Reader(Protocol):
    """One format."""

    name: str
    """How the format is called where one is asked for."""
    title: str
    """What it is, for people."""

    def recognises(self, path: Path) -> bool:
        """Whether the file or folder looks like this format; nothing is raised."""

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """What can be taken, in the source's order, `every_s` seconds apart.

        Raises:
            InvalidDocument: The input breaks its format.
        """

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """The scene at one moment.

        Args:
            path: The file or folder.
            item: See `Moment`; None for the first.
            frame: See `Moment`; None for the one that the format means, else 0.
            name: The scene's slug.

        Raises:
            InvalidDocument: The input breaks its format, or has no such moment.
        """


def frame_in(what: str, frame: int, steps: int) -> int:
    """The frame, where it is one of that many.

    Raises:
        InvalidDocument: It is not.
    """
    if not 0 <= frame < steps:
        allowed = f"this log has frames 0 to {steps - 1}" if steps else "this log has no frame"
        raise InvalidDocument(what, [("frame", f"{frame} is not there; {allowed}")])
    return frame


def frames_every(times_s: list[float], every_s: float) -> Iterator[int]:
    """The frames that lie at least `every_s` after the one before, the first among them."""
    last: float | None = None
    for frame, time_s in enumerate(times_s):
        if last is None or time_s - last >= every_s - 1e-6:
            last = time_s
            yield frame
