"""A small benchmark with one of everything, and its folder on disk."""

from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from augment.benchmark.folder import write_folder
from augment.benchmark.values import BenchmarkSet, BenchmarkTask, Split, Stratum
from augment.scene.entities import AgentType, Modification, Scene
from augment.scene.recording import Recording
from tests.scenes import cone, scene, vehicle
from tests.simulation.worlds import track

SECRET_M = 43.2187654
"""A number that stands in references of the test alone."""

CAR = vehicle("Agent2", 20.0, 0.0)
RECORDING = Recording(
    times_s=np.array([0.0, 0.5, 1.0]),
    ego=np.array([[0.0, 0.0, 0.0, 8.0], [4.0, 0.0, 0.0, 8.0], [8.0, 0.0, 0.0, 8.0]]),
    tracks=(track(CAR, np.array([[20.0, 0.0, 0.0, 0.0]] * 2 + [[np.nan] * 4])),),
)


def task(name: str, **changes: Any) -> BenchmarkTask:
    given: dict[str, Any] = {
        "name": name,
        "type": "nudge_around_parked_vehicle",
        "instruction": "Park a car ahead – „weit“ vorn.",
        "language": "en",
        "split": Split.TEST,
        "stratum": Stratum.HARD,
        "keeps_traffic": True,
        "scene": scene(name=f"{name}-scene", agents=(CAR,)),
        "reference": Modification(added=(vehicle("Agent3", SECRET_M, 0.25, 0.1),)),
    }
    return BenchmarkTask(**(given | changes))


KINDS = tuple(kind for kind in AgentType if kind is not AgentType.EGO_VEHICLE)


def street() -> Scene:
    """Two cars of one size, the first driving, and one of each type beside the street."""
    others = tuple(
        replace(vehicle(f"Agent{number}", -40.0 + 12.0 * number, -6.0, 0.3), type=kind)
        for number, kind in enumerate(KINDS, start=4)
    )
    parked = vehicle("Agent3", 40.0, 3.5, 3.14)
    return scene(agents=(replace(CAR, speed_mps=7.0), parked, *others))


def street_set(*names: str) -> BenchmarkSet:
    """The street as tasks of those names, the first for practice."""
    reference = Modification(added=(vehicle("Agent12", 30.0, 0.0), cone("Agent13", 12.0, 1.0)))
    split = {name: Split.PRACTICE if name == names[0] else Split.TEST for name in names}
    tasks = (task(name, scene=street(), reference=reference, split=split[name]) for name in names)
    made_on = date(2026, 11, 26)
    return BenchmarkSet(
        name="streets", title="Streets", version=1, made_on=made_on, tasks=tuple(tasks)
    )


def small_set() -> BenchmarkSet:
    """A practice task, one of the test with a recording, its other wording, a wish unmet."""
    shown = Modification(added=(vehicle("Agent3", 31.5, -1.0),), removed=("Agent2",))
    tasks = (
        task("near", split=Split.PRACTICE, stratum=Stratum.EASY, reference=shown),
        task("far", recording=RECORDING),
        task("far-p1", language="de", recording=RECORDING, paraphrase_of="far"),
        task("no-way", type="cut_in", reference=Modification(), keeps_traffic=False),
    )
    made_on = date(2026, 11, 26)
    return BenchmarkSet(name="small", title="Small", version=2, made_on=made_on, tasks=tasks)


def handed_out(benchmark: BenchmarkSet) -> BenchmarkSet:
    """The same without the references of the test."""
    tasks = [
        one if one.split is Split.PRACTICE else replace(one, reference=None)
        for one in benchmark.tasks
    ]
    return replace(benchmark, tasks=tuple(tasks))


def on_disk(folder: Path, benchmark: BenchmarkSet) -> Path:
    for name, content in write_folder(benchmark).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder
