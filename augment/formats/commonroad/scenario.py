"""The reader of CommonRoad scenarios, 2018b and 2020a.

The ego is a planning problem, which has a start and no motion, or a recorded vehicle: `item` is
the id of either. `frame` is a time step, for a planning problem the one it starts at.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from augment.formats.commonroad.network import WHAT, fault, network_of, real, whole
from augment.formats.commonroad.scenario import Obstacles, obstacles_of, rows_of, state_of
from augment.formats.documents import Element, read_xml
from augment.formats.reading import (
    LONGEST_GAP_S,
    Log,
    Moment,
    Reading,
    frame_in,
    frames_every,
    reading_at,
)
from augment.formats.road_map import FloatArray
from augment.scene.entities import EGO_LENGTH_M, EGO_WIDTH_M, AgentType
from augment.scene.recording import Note, SceneNoteKind

VERSIONS = ("2018b", "2020a")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Ego:
    item: int
    first: int
    states: FloatArray
    length_m: float
    width_m: float
    is_recorded: bool


class CommonRoad:
    """The reader of CommonRoad XML."""

    name = "commonroad"
    title = "CommonRoad scenario, 2018b or 2020a (XML file)"

    def recognises(self, path: Path) -> bool:
        """An XML file that begins as the format does."""
        if path.suffix.lower() != ".xml" or not path.is_file():
            return False
        with path.open("rb") as file:
            return b"<commonRoad" in file.read(4_000)

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """Each planning problem at its start, and where there is none each vehicle over time."""
        root = _root(path)
        problems = list(root.all("planningProblem"))
        for problem in problems:
            number = whole(problem.attributes.get("id"), "planningProblem")
            ego = _ego(root, obstacles_of(root), str(number))
            yield Moment(item=str(number), frame=ego.first)
        if problems:
            return
        step_s = _step_s(root)
        for one in obstacles_of(root).all:
            if one.type is AgentType.VEHICLE and not one.stands:
                times_s = [state.step * step_s for state in one.states]
                for index in frames_every(times_s, every_s):
                    step, time_s = one.states[index].step, times_s[index] - times_s[0]
                    yield Moment(item=str(one.id), frame=step, time_s=time_s)

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """The scene of one ego at one time step."""
        root = _root(path)
        obstacles = obstacles_of(root)
        ego = _ego(root, obstacles, item)
        frame = frame_in(WHAT, ego.first if frame is None else frame, len(ego.states))
        log = Log(
            what=WHAT,
            times_s=np.arange(len(ego.states), dtype=np.float64) * _step_s(root),
            ego=ego.states,
            ego_length_m=ego.length_m,
            ego_width_m=ego.width_m,
            tracks=obstacles.tracks(without=ego.item),
        )
        benchmark = root.attributes.get("benchmarkID", path.stem)[:80]
        source = root.attributes.get("source", "").strip()[:200] or "no source named"
        return reading_at(
            log,
            frame,
            network_of(root, frame),
            name=name,
            world=f"CommonRoad scenario frame of {benchmark}",
            provenance=(
                f"CommonRoad scenario {benchmark}, ego {ego.item}, time step {frame}; {source}"
            ),
            licence=None,
            notes=(*obstacles.notes, *_notes(ego, _step_s(root))),
            item=str(ego.item),
        )


# Private


def _root(path: Path) -> Element:
    root = read_xml(path, what=WHAT)
    if root.name != "commonRoad":
        raise fault(path.name, f"begins with {root.name[:40]!r}, not with 'commonRoad'")
    version = root.attributes.get("commonRoadVersion", "")
    if version not in VERSIONS:
        text = f"version {version[:20]!r} is not known; known: {', '.join(VERSIONS)}"
        raise fault("commonRoadVersion", text)
    return root


def _step_s(root: Element) -> float:
    step_s = real(root.attributes.get("timeStepSize", ""), "timeStepSize")
    if not 0.001 <= step_s <= 10.0:
        raise fault("timeStepSize", f"{step_s:g} s is no step from 0.001 to 10 s")
    return step_s


def _ego(root: Element, obstacles: Obstacles, item: str | None) -> _Ego:
    """The planning problem or vehicle of that id; the first planning problem when None."""
    problems = {
        whole(one.attributes.get("id"), "planningProblem"): one
        for one in root.all("planningProblem")
    }
    vehicles = {one.id: one for one in obstacles.all if not one.stands}
    if item is None and not problems:
        text = "there is no planning problem; name a vehicle as the ego by its id"
        raise fault("planningProblem", f"{text}: {_listed(vehicles)}")
    number = next(iter(problems)) if item is None else whole(item, "item")
    if number in problems:
        initial = problems[number].first("initialState")
        if initial is None:
            raise fault(f"planningProblem {number}", "needs an initialState")
        start = state_of(initial, f"planningProblem {number}")
        states = np.full((max(obstacles.steps, start.step + 1), 4), np.nan)
        states[start.step] = (start.x_m, start.y_m, start.heading_rad, start.speed_mps)
        if len(states) != obstacles.steps:
            raise fault(f"planningProblem {number}", "starts after the last recorded step")
        return _Ego(
            item=number,
            first=start.step,
            states=states,
            length_m=EGO_LENGTH_M,
            width_m=EGO_WIDTH_M,
            is_recorded=False,
        )
    if number not in vehicles:
        known = f"planning problems {_listed(problems)}; vehicles {_listed(vehicles)}"
        raise fault("item", f"{number} is not there; there are {known}")
    vehicle = vehicles[number]
    return _Ego(
        item=number,
        first=vehicle.states[0].step,
        states=rows_of(vehicle, obstacles.steps),
        length_m=vehicle.length_m,
        width_m=vehicle.width_m,
        is_recorded=True,
    )


def _listed(names: Mapping[int, object]) -> str:
    shown = ", ".join(str(name) for name in list(names)[:12]) or "none"
    return shown + (f" and {len(names) - 12} more" if len(names) > 12 else "")


def _notes(ego: _Ego, step_s: float) -> Iterator[Note]:
    if not ego.is_recorded:
        yield Note(kind=SceneNoteKind.EGO_SIZE_ASSUMED, value=EGO_LENGTH_M)
        yield Note(kind=SceneNoteKind.NO_EGO_MOTION)
    if step_s > LONGEST_GAP_S:
        yield Note(kind=SceneNoteKind.LONG_TIME_STEP, value=step_s)
    yield Note(kind=SceneNoteKind.NO_DRIVABLE_AREAS)
