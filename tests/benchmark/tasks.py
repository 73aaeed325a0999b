"""Small benchmark tasks and a set of them, made by hand."""

from dataclasses import replace
from datetime import date
from typing import Any

from augment.benchmark.values import BenchmarkSet, BenchmarkTask, Split, Stratum
from augment.scene.entities import AgentType, Modification, Scene
from tests.scenes import cone, scene, vehicle

KINDS = tuple(kind for kind in AgentType if kind is not AgentType.EGO_VEHICLE)


def street() -> Scene:
    """Two cars of one size and one of each type besides, on and beside the street."""
    cars = (vehicle("Agent2", 20.0, 0.0), vehicle("Agent3", 40.0, 3.5, 3.14))
    others = tuple(
        replace(vehicle(f"Agent{number}", -40.0 + 12.0 * number, -6.0, 0.3), type=kind)
        for number, kind in enumerate(KINDS, start=4)
    )
    return scene(agents=(replace(cars[0], speed_mps=7.0), cars[1], *others))


def task(name: str = "near", **changes: Any) -> BenchmarkTask:
    reference = Modification(added=(vehicle("Agent12", 30.0, 0.0), cone("Agent13", 12.0, 1.0)))
    given: dict[str, Any] = {
        "name": name,
        "type": "nudge",
        "instruction": "Park a car ahead.",
        "language": "en",
        "split": Split.PRACTICE,
        "stratum": Stratum.EASY,
        "scene": street(),
        "reference": reference,
    }
    return BenchmarkTask(**(given | changes))


def benchmark(*tasks: BenchmarkTask) -> BenchmarkSet:
    """Of the tasks given, else one for practice and two for the test, one without an answer."""
    far = {"split": Split.TEST, "reference": None}
    given = tasks or (task(), task("far", **far), task("closed", **far))
    return BenchmarkSet(
        name="streets", title="Streets", version=1, made_on=date(2026, 11, 1), tasks=given
    )
