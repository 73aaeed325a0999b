"""What stands before and after a model's answer: `python -m bench.checking [ROUNDS]`.

Eight agents are checked on every scene of the catalogue: its reference and cones beside it. With
REALDATA_DIR a recorded Argoverse 2 log is read as well. Milliseconds on the clock.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

from augment.checks import findings
from augment.formats.argoverse2.sensor import ArgoverseSensor
from augment.scene.modification import Modification
from tests.checks.worlds import Reference, references
from tests.scenes import cone

ROUNDS = 5
AGENTS = 8


def main(rounds: int) -> None:
    shortest, typical = zip(*(_times_ms(_check(one), rounds) for one in references()), strict=True)
    print(f"| {AGENTS} agents checked | ms |")
    print("|---|---|")
    print(f"| median of the scenes | {median(typical):.1f} |")
    print(f"| slowest scene, shortest | {max(shortest):.1f} |")
    print(f"| slowest scene, median | {max(typical):.1f} |")
    if folder := os.environ.get("REALDATA_DIR"):
        (log,) = (Path(folder) / "av2_sensor").iterdir()
        reader = ArgoverseSensor()
        took_ms = _times_ms(lambda: reader.read(log, item=None, frame=30, name="recorded"), rounds)
        print(f"| a recorded log, read: shortest, median | {took_ms[0]:.0f}, {took_ms[1]:.0f} |")


def _check(reference: Reference) -> Callable[[], object]:
    added = reference.modification.added
    cones = (cone(f"Agent{90 + number}", 20.0 + number, 0.3) for number in range(AGENTS))
    eight = Modification(added=(*added, *cones)[:AGENTS])
    return lambda: findings(reference.scene, eight)


def _times_ms(work: Callable[[], object], rounds: int) -> tuple[float, float]:
    """The shortest and the median time, after one that isn't counted."""
    work()
    times_ms = []
    for _ in range(rounds):
        began = time.perf_counter()
        work()
        times_ms.append(1000.0 * (time.perf_counter() - began))
    return min(times_ms), median(times_ms)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else ROUNDS)
