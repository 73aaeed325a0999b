"""How far a careless stand-in is from a good one: `python -m bench.separation`.

Both answer every scenario of the still sets (paper and hard) and of the moving set, without a
server: the good one as the rule placer does, the careless one with its mistakes, `SAMPLES` times.
Measured is the displacement, over time where something moves, and its spread: the standard
deviation of the good one's over the scenarios. Scenarios are clusters: the intervals are
percentiles of the bootstrap over them, the spread held. Writes into docs/catalogue.md.
"""

from collections.abc import Sequence
from multiprocessing import get_context

import numpy as np
from numpy.typing import NDArray

from augment.baselines.rule_placer import place
from augment.checks import Ground
from augment.errors import CannotPlace
from augment.fake_llm import careless
from augment.metrics.displacement import Displacement, displacement
from bench.moving_set import PROCESSES
from bench.report import ROOT, table, write_block
from tests.fixtures.shelf import HARD_SLUGS, MOVING_SLUGS, SLUGS, entry, shown_scene

SAMPLES, ROUNDS, SEED = 20, 10_000, 2026
PLACED_WITHIN_M = 2.0
"""At t0 whatever is this near to the reference's place stands where it should."""

Pairs = NDArray[np.float64]
"""(S, 2): mean displacements of the good and the careless one, by scenario."""


def measure(slug: str) -> tuple[float, list[tuple[float, bool]]] | None:
    """Return the good answer's error, and those of the careless ones with whether all is placed.

    None where a wish can't be met.
    """
    scene, asked = shown_scene(slug), entry(slug)
    assert asked.intent is not None
    ground = Ground.of(scene)
    try:
        right = place(scene, asked.intent).modification
    except CannotPlace:
        return None
    bent = []
    for sample in range(SAMPLES):
        rng = careless.dice(f"{slug} {sample}")
        answer = None if careless.is_unreadable(rng) else careless.bend(scene, right, rng)[0]
        found = displacement(answer, asked.reference, ground)
        bent.append((found.error_m, is_placed(found)))
    return displacement(right, asked.reference, ground).error_m, bent


def is_placed(found: Displacement) -> bool:
    """Whether at t0 all stands where it should, so that no still picture tells of a mistake."""
    far = any(distance_m > PLACED_WITHIN_M for distance_m in found.distances_m)
    return not (far or found.missing or found.surplus)


def pairs_of(slugs: Sequence[str]) -> tuple[Pairs, Pairs]:
    """Return the pairs of all answers, and of those whose objects are placed at t0."""
    with get_context("spawn").Pool(PROCESSES) as pool:
        measured = [one for one in pool.map(measure, slugs, chunksize=1) if one is not None]
    every, placed = [], []
    for good_m, bent in measured:
        every.append((good_m, float(np.mean([error_m for error_m, _ in bent]))))
        errors_m = [error_m for error_m, fits in bent if fits]
        if errors_m:
            placed.append((good_m, float(np.mean(errors_m))))
    return np.array(every), np.array(placed)


def drawn_differences(pairs: Pairs, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the mean difference (ROUNDS,) over scenarios drawn with replacement."""
    rows = rng.integers(len(pairs), size=(ROUNDS, len(pairs)))
    return np.asarray((pairs[:, 1] - pairs[:, 0])[rows].mean(axis=1))


def report() -> str:
    """A row for each set and kind of answer, and the ratios."""
    rng = np.random.default_rng(SEED)
    still, moving = pairs_of([*SLUGS, *HARD_SLUGS]), pairs_of(MOVING_SLUGS)
    rows = []
    for name, before, now in zip(("all", "placed at t0"), still, moving, strict=True):
        drawn = [drawn_differences(pairs, rng) for pairs in (before, now)]
        for title, pairs, found in zip(("still", "moving"), (before, now), drawn, strict=True):
            medians = [f"{median_m:.2f}" for median_m in np.median(pairs, axis=0)]
            spread = f"{np.std(pairs[:, 0], ddof=1):.2f}"
            apart = _within(_apart(pairs), found)
            rows.append([name, title, str(len(pairs)), *medians, spread, apart])
        if name == "all":
            spread_m = float(np.std(before[:, 0], ddof=1))
            by_spread = _within(_apart(now) / spread_m, drawn[1] / spread_m)
            rows.append([name, "moving : still spread", "", "", "", "", by_spread])
        ratio = _within(_apart(now) / _apart(before), drawn[1] / drawn[0])
        rows.append([name, "moving : still", "", "", "", "", ratio])
    head = ["answers", "set", "scenarios", "good, median (m)", "careless, median (m)"]
    return table([*head, "good, SD (m)", "mean difference (m)"], rows)


def _apart(pairs: Pairs) -> float:
    return float(np.mean(pairs[:, 1] - pairs[:, 0]))


def _within(value: float, drawn: NDArray[np.float64]) -> str:
    low, high = np.percentile(drawn, [2.5, 97.5])
    return f"{value:.2f} [{low:.2f}, {high:.2f}]"


if __name__ == "__main__":
    text = report()
    print(text)
    write_block("separation", text, page=ROOT / "docs" / "catalogue.md")
