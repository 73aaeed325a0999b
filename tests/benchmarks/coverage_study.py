"""How often 95 % intervals contain the truth, over simulated studies of the paper's size.

    python -m tests.benchmarks.coverage_study [STUDIES]

Every study has the paper's nine ratings, nine experts, 50 scenarios and 5,760 votes with a tie
share of about 0.4. Experts and scenarios may differ in what they make of each contestant: normal
effects with a standard deviation in Elo points. The truth is then what infinitely many votes of
new experts on new scenarios would be rated. All of it is simulated; 1,000 studies take minutes.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from arena.rating import bradley_terry
from arena.rating.bootstrap import Unit
from arena.rating.bradley_terry import ELO_PER_LOGIT
from arena.rating.comparisons import LOSS, TIE, WIN, Comparisons, FloatArray
from arena.rating.leaderboard import Leaderboard, rate

PAPER = Path(__file__).parents[1] / "rating" / "paper_table.json"
VOTES, EXPERTS, SCENARIOS, TIES = 5760, 9, 50, 0.4
SETTINGS = ((0.0, 0.0), (100.0, 0.0), (0.0, 40.0), (100.0, 40.0))
METHODS = (
    ("votes, paper mode", Unit.VOTE),
    ("scenarios", Unit.SCENARIO),
    ("experts", Unit.EXPERT),
    ("two-way, default", Unit.TWO_WAY),
)
CROSS_CHECK = "two-way sandwich"


def paper_ratings() -> FloatArray:
    return np.array([row[2] for row in json.loads(PAPER.read_text())["rows"]], dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """What is true: ratings, and how much scenarios and experts differ, in Elo points."""

    ratings: FloatArray
    scenario_sd: float = 0.0
    expert_sd: float = 0.0
    experts: int = EXPERTS
    scenarios: int = SCENARIOS
    ties: float = TIES

    def truth(self) -> FloatArray:
        """(C,) what infinitely many votes of this world would be rated."""
        strengths = self.ratings / ELO_PER_LOGIT
        low, high = np.triu_indices(len(strengths), 1)
        spread = np.sqrt(2.0 * (self.scenario_sd**2 + self.expert_sd**2)) / ELO_PER_LOGIT
        nodes, weights = np.polynomial.hermite_e.hermegauss(60)
        gaps = (strengths[low] - strengths[high])[:, None] + spread * nodes
        scores = (1.0 / (1.0 + np.exp(-gaps))) @ (weights / weights.sum())
        fitted = bradley_terry.fit(
            contestants=len(strengths),
            low=low,
            high=high,
            games=np.ones((1, len(low))),
            scores=scores[None],
        )
        return bradley_terry.to_elo(fitted[0])

    def votes(self, number: int, rng: np.random.Generator) -> Comparisons:
        """A study: experts and scenarios are new ones each time."""
        contestants = len(self.ratings)
        of_scenarios = rng.normal(0.0, self.scenario_sd, (self.scenarios, contestants))
        of_experts = rng.normal(0.0, self.expert_sd, (self.experts, contestants))
        first = rng.integers(0, contestants, number)
        second = (first + rng.integers(1, contestants, number)) % contestants
        expert = rng.integers(0, self.experts, number)
        scenario = rng.integers(0, self.scenarios, number)
        seen = self.ratings + of_scenarios[scenario] + of_experts[expert]
        rows = np.arange(number)
        gap = (seen[rows, first] - seen[rows, second]) / ELO_PER_LOGIT
        expected = 1.0 / (1.0 + np.exp(-gap))
        tie = self.ties * 2.0 * np.minimum(expected, 1.0 - expected)
        drawn = rng.random(number)
        return Comparisons(
            names=tuple(f"c{index}" for index in range(contestants)),
            first=first,
            second=second,
            score=np.where(
                drawn < expected - tie / 2, WIN, np.where(drawn < expected + tie / 2, TIE, LOSS)
            ),
            expert=expert,
            scenario=scenario,
        )


@dataclass(slots=True)
class Tally:
    """How often intervals held the truth, and how wide they were."""

    held: int = 0
    seen: int = 0
    half_widths: float = 0.0

    def add(self, truth: FloatArray, lower: FloatArray, upper: FloatArray) -> None:
        self.held += int(((lower <= truth) & (truth <= upper)).sum())
        self.seen += len(truth)
        self.half_widths += float((upper - lower).sum() / 2.0)

    @property
    def coverage(self) -> float:
        return self.held / self.seen

    @property
    def half_width(self) -> float:
        return self.half_widths / self.seen


def bounds(board: Leaderboard, *, check: bool = False) -> tuple[FloatArray, FloatArray]:
    """(C,), (C,) of a table in which everybody has an interval."""
    kinds = ("check_lower", "check_upper") if check else ("lower", "upper")
    lower, upper = (
        np.array([getattr(line, kind) for line in board.lines], dtype=np.float64) for kind in kinds
    )
    return lower, upper


def study(
    world: World, *, studies: int, rounds: int, votes: int = VOTES, units: tuple[Unit, ...]
) -> dict[str, Tally]:
    """Coverage by method's name over studies with seeds 0, 1, 2 and so on."""
    tallies = {name: Tally() for name, unit in METHODS if unit in units}
    if Unit.TWO_WAY in units:
        tallies[CROSS_CHECK] = Tally()
    truth = world.truth()
    for seed in range(studies):
        drawn = world.votes(votes, np.random.default_rng(seed))
        for name, unit in METHODS:
            if unit not in units:
                continue
            checked = unit is Unit.TWO_WAY
            board = rate(drawn, unit=unit, rounds=rounds, seed=seed, details=checked)
            tallies[name].add(truth, *bounds(board))
            if checked:
                tallies[CROSS_CHECK].add(truth, *bounds(board, check=True))
    return tallies


def lines(studies: int, rounds: int) -> Iterator[str]:
    names = [*(name for name, _ in METHODS), CROSS_CHECK]
    yield f"| scenario / expert effects | {' | '.join(names)} |"
    yield "|---" * (1 + len(names)) + "|"
    for scenario_sd, expert_sd in SETTINGS:
        world = World(ratings=paper_ratings(), scenario_sd=scenario_sd, expert_sd=expert_sd)
        found = study(world, studies=studies, rounds=rounds, units=tuple(Unit))
        cells = [f"{found[name].coverage:.1%} (±{found[name].half_width:.0f})" for name in names]
        yield f"| {scenario_sd:.0f} / {expert_sd:.0f} | {' | '.join(cells)} |"


def main() -> None:
    studies = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    began = time.perf_counter()
    print(f"{studies} simulated studies of {VOTES} votes, 1000 rounds each; coverage (half-width)")
    for line in lines(studies, rounds=1000):
        print(line, flush=True)
    print(f"{time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()
