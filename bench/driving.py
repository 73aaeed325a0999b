"""What a drive costs: `python -m bench.driving [--write]`.

One process on one core, by its own processor time, so that a busy machine does not count. The
street is long and straight; the objects stand beside the road or drive on it.
"""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from augment.scene.entities import Modification, TrafficAgent
from augment.simulation.drive import run
from augment.simulation.pdm_closed import ORIGINAL_OFFSETS_M, PAPER_OFFSETS_M, PdmClosed
from augment.simulation.planning import Plan, Situation
from augment.simulation.road import Road
from augment.simulation.states import EgoBody
from augment.simulation.tracker import track
from augment.simulation.traffic import DriveSetting
from bench.report import load, table, write_section
from tests.scenes import vehicle
from tests.simulation.worlds import street

HEADING = "A closed-loop drive"
WIDE_M = tuple(float(n) for n in np.linspace(-4.0, 4.0, 18))
PDM_STAGE_MS = {45: "62"}
"""PDM's own LQR and bicycle stage, measured on a machine of this kind but not by this command."""


class Timed(PdmClosed):
    """Notes what each step costs."""

    def start(self, road: Road, body: EgoBody) -> None:
        super().start(road, body)
        self.steps_ms: list[float] = []

    def plan(self, situation: Situation) -> Plan:
        started = time.process_time()
        plan = super().plan(situation)
        self.steps_ms.append(1000.0 * (time.process_time() - started))
        return plan


def traffic(count: int) -> tuple[TrafficAgent, ...]:
    """Every fifth object drives in the ego's lane or towards it; the others stand beside."""
    made = []
    for number in range(count):
        x_m = 25.0 + 500.0 * number / count
        if number % 5:
            made.append(vehicle(f"A{number}", x_m, -4.2 if number % 2 else 7.6))
        else:
            heading, y_m = (0.0, 0.0) if number % 2 else (np.pi, 3.5)
            made.append(replace(vehicle(f"A{number}", x_m, y_m, heading), speed_mps=7.0))
    return tuple(made)


def stage_ms(count: int) -> float:
    """The median of tracker and bicycle alone, 40 steps of `count` proposals."""
    references = np.zeros((count, 41, 3))
    references[..., 0] = np.arange(41) * 0.8
    references[..., 1] = np.linspace(-4.0, 4.0, count)[:, None]
    start = np.array([0.0, 0.0, 0.0, 7.0, 0.0, 0.0])
    return _median_ms(lambda: track(references, start, EgoBody()), 100)


def driven(count: int, offsets: tuple[float, ...]) -> tuple[float, float, float]:
    """Median and 95th percentile of a planning step in ms, and the whole drive in s."""
    scene = street(700.0)
    setting = DriveSetting(scene=scene, modification=Modification(added=traffic(count)))
    planner = Timed(offsets)
    started = time.process_time()
    run(setting, planner)
    whole_s = time.process_time() - started
    median, high = np.percentile(planner.steps_ms, [50, 95])
    return float(median), float(high), whole_s


def main() -> None:
    """Measure and print; with --write into docs/benchmarks.md."""
    begun = load()
    driven(10, ORIGINAL_OFFSETS_M)  # what is loaded once is not what a drive costs
    stages = [
        [str(count), f"{stage_ms(count):.1f}", PDM_STAGE_MS.get(count, "-")]
        for count in (15, 45, 90)
    ]
    drives = []
    for count, offsets in [
        (10, PAPER_OFFSETS_M), (50, PAPER_OFFSETS_M), (100, PAPER_OFFSETS_M),
        (200, PAPER_OFFSETS_M), (10, ORIGINAL_OFFSETS_M), (10, WIDE_M),
    ]:  # fmt: skip
        median, high, whole_s = driven(count, offsets)
        drives.append(
            [
                str(count), str(5 * len(offsets)), f"{median:.1f}", f"{high:.1f}",
                f"{whole_s:.1f}", f"{15.0 / whole_s:.1f}",
            ]
        )  # fmt: skip
    memory_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    text = "\n\n".join(
        [
            "`python -m bench.driving --write`: one process, its own processor time; "
            f"{begun}. Tracker and bicycle alone, 4 s of every proposal (the last column: PDM's "
            "own stage, not run by this command):",
            table(["proposals", "ms (median)", "PDM's own (ms)"], stages),
            "A 15 s drive on a street with so many others, a fifth of them moving:",
            table(
                ["others", "proposals", "step, median (ms)", "step, p95 (ms)", "drive (s)",
                 "times faster than real time"],
                drives,
            ),
            "Targets: the stage at most 15 ms for 45 proposals, a step at most 25 ms, a drive at "
            "least 3 times faster than real time. "
            f"The process took {memory_mb:.0f} MB at most.",
        ]
    )  # fmt: skip
    print(text)
    if "--write" in sys.argv:
        write_section(HEADING, text)


def _median_ms(act: Callable[[], object], times: int) -> float:
    taken = []
    for _ in range(times):
        started = time.process_time()
        act()
        taken.append(1000.0 * (time.process_time() - started))
    return float(np.median(taken))


if __name__ == "__main__":
    main()
