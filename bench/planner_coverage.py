"""How often intervals of planners hold the truth: `python -m bench.planner_coverage [STUDIES]`.

Response matrices of three planners whose true means are known: a drive fails or has a score near
0.9. Failures go together by scene, by scenario and by scene and planner.
"""

import argparse
from collections.abc import Hashable
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from augment.metrics.paired import compare_planners, estimate_score
from bench.report import table

BETA = (8.0, 1.0)
"""Of the score of a drive that does not fail."""
EQUAL = (0.6, 0.6, 0.6)


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """Some scenes with as many scenarios each; shares of drives that do not fail.

    Attributes:
        common: The part of the variance that planners share.
    """

    scenes: int
    scenarios: int
    passes: tuple[float, ...]
    common: float

    @property
    def truth(self) -> list[float]:
        """The mean score of each planner."""
        return [share * BETA[0] / sum(BETA) for share in self.passes]

    def drives(self, rng: np.random.Generator) -> dict[str, dict[Hashable, tuple[int, float]]]:
        """Return the scores of one study, by planner."""
        scenes, scenarios, planners = self.scenes, self.scenarios, len(self.passes)
        common, own = np.sqrt(self.common / 2.0), np.sqrt((1.0 - self.common) / 2.0)
        # (scenes, scenarios, planners) latent difficulties of variance 1.
        difficulty = common * rng.normal(size=(scenes, 1, 1))
        difficulty = difficulty + common * rng.normal(size=(scenes, scenarios, 1))
        difficulty = difficulty + own * rng.normal(size=(scenes, 1, planners))
        difficulty = difficulty + own * rng.normal(size=(scenes, scenarios, planners))
        limits = [NormalDist().inv_cdf(share) for share in self.passes]
        scores = (difficulty < limits) * rng.beta(*BETA, size=difficulty.shape)
        places = [(scene, scenario) for scene in range(scenes) for scenario in range(scenarios)]
        return {
            str(n): {place: (place[0], float(scores[(*place, n)])) for place in places}
            for n in range(planners)
        }


WORLDS = [
    World(scenes=scenes, scenarios=scenarios, passes=passes, common=common)
    for scenes, scenarios in ((10, 6), (12, 4), (18, 2), (30, 1), (50, 1), (100, 2))
    for passes in ((0.8, 0.6, 0.5), (0.9, 0.8, 0.7), EQUAL)
    for common in (0.2, 0.7)
]


def cover(world: World, studies: int) -> tuple[float, float, float]:
    """Return coverage of means and of differences, and how often any two equals are told apart."""
    rng, truth = np.random.default_rng(0), world.truth
    means, pairs, false = [], [], []
    for _ in range(studies):
        drives = world.drives(rng)
        for planner, value in zip(drives, truth, strict=True):
            estimate = estimate_score(drives[planner])
            assert estimate.low is not None
            assert estimate.high is not None
            means.append(estimate.low <= value <= estimate.high)
        (differences,) = compare_planners([drives])
        for one in differences:
            low, high = one.estimate.low, one.estimate.high
            if low is not None and high is not None:
                pairs.append(low <= truth[int(one.first)] - truth[int(one.second)] <= high)
        false.append(world.passes == EQUAL and any(one.is_apart for one in differences))
    return float(np.mean(means)), float(np.mean(pairs)), float(np.mean(false))


def main() -> None:
    """Print a row a world."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("studies", nargs="?", type=int, default=1000)
    studies = parser.parse_args().studies
    rows = []
    for world in WORLDS:
        counts = f"{world.scenes} x {world.scenarios}"
        shares = [f"{share:.1%}" for share in cover(world, studies)]
        rows.append([counts, " ".join(map(str, world.passes)), str(world.common), *shares])
    head = ["scenes x scenarios", "pass", "shared", "means", "differences", "equals told apart"]
    print(table(head, rows))


if __name__ == "__main__":
    main()
