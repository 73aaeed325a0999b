"""The three sets of votes that rating packages are timed on; all simulated.

S is the paper's size, M a small public arena, L a large one.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from arena.rating.bradley_terry import ELO_PER_LOGIT
from arena.rating.comparisons import Comparisons, IntArray
from bench.worlds import paper_ratings

WINNERS = ("model_a", "tie", "model_b")
EXPERTS, SCENARIOS, TIES = 9, 50, 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class Size:
    """How many votes on how many contestants."""

    name: str
    votes: int
    contestants: int


SIZES = (
    Size(name="S", votes=5760, contestants=9),
    Size(name="M", votes=100_000, contestants=50),
    Size(name="L", votes=2_000_000, contestants=150),
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Votes:
    """(V,) arrays; `outcome` 0 where the first won, 1 for a tie, 2 where the second did."""

    contestants: int
    first: IntArray
    second: IntArray
    outcome: IntArray
    expert: IntArray
    scenario: IntArray

    def counted(self, *, clusters: bool) -> Comparisons:
        """What a GROUP BY of pair, side and outcome gives, and of expert and scenario."""
        nobody = np.zeros_like(self.first)
        cells = (self.expert, self.scenario) if clusters else (nobody, nobody)
        columns = (*cells, self.first, self.second, self.outcome)
        sizes = (EXPERTS, SCENARIOS, self.contestants, self.contestants, 3)
        kinds, counts = np.unique(np.ravel_multi_index(columns, sizes), return_counts=True)
        expert, scenario, first, second, outcome = np.unravel_index(kinds, sizes)
        return Comparisons(
            names=tuple(f"c{index:03d}" for index in range(self.contestants)),
            first=first,
            second=second,
            score=np.asarray(1.0 - 0.5 * outcome, dtype=np.float64),
            expert=expert,
            scenario=scenario,
            count=counts,
        )

    def save(self, path: Path) -> None:
        """For rivals' processes."""
        np.savez(
            path,
            contestants=self.contestants,
            first=self.first,
            second=self.second,
            outcome=self.outcome,
        )

    def save_csv(self, path: Path, *, clusters: bool) -> None:
        """For rate_csv, with or without the columns judge and item."""
        names = [f"contestant-{index:03d}" for index in range(self.contestants)]
        with path.open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["model_a", "model_b", "winner", *(["judge", "item"] * clusters)])
            columns = zip(
                self.first.tolist(),
                self.second.tolist(),
                self.outcome.tolist(),
                self.expert.tolist(),
                self.scenario.tolist(),
                strict=True,
            )
            writer.writerows(
                [names[a], names[b], WINNERS[won], *([f"judge {e}", f"item {s}"] * clusters)]
                for a, b, won, e, s in columns
            )


def drawn(size: Size, seed: int = 1) -> Votes:
    """Votes whose expected score is exactly logistic, in random order."""
    rng = np.random.default_rng(seed)
    elo = rng.normal(1000.0, 100.0, size.contestants)
    if size.contestants == len(paper_ratings()):
        elo = paper_ratings()
    first = rng.integers(0, size.contestants, size.votes)
    second = (first + rng.integers(1, size.contestants, size.votes)) % size.contestants
    expected = 1.0 / (1.0 + np.exp((elo[second] - elo[first]) / ELO_PER_LOGIT))
    tie = TIES * 2.0 * np.minimum(expected, 1.0 - expected)
    chance = rng.random(size.votes)
    return Votes(
        contestants=size.contestants,
        first=first,
        second=second,
        outcome=np.where(
            chance < expected - tie / 2, 0, np.where(chance < expected + tie / 2, 1, 2)
        ),
        expert=rng.integers(0, EXPERTS, size.votes),
        scenario=rng.integers(0, SCENARIOS, size.votes),
    )
