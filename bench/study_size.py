"""Whether a planned study tells what the planning page said: `docs/rating.md`.

    python -m bench.study_size [STUDIES]

For each design the votes that `arena.rating.sample_size` asks for are simulated, and what comes
out is held against what was wanted: a widest half-width, and neighbours told apart with a power.
All of it is simulated; 100 studies a row take three minutes of one processor.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from arena.rating.comparisons import FloatArray
from arena.rating.leaderboard import rate
from arena.rating.sample_size import StudyDesign, expect, votes_per_expert_for
from bench.worlds import SCENARIOS, World

CONTESTANTS = 9
HALF_WIDTH, GAP, POWER = 25.0, 40.0, 0.8
ROUNDS = 1000
EXPERTS = (5, 9, 12, 20)
EFFECTS = ((0.0, 0.0), (40.0, 15.0), (100.0, 40.0))
"""Standard deviations of scenarios and experts, before votes are averaged over them."""
WORLDS = (
    *((40.0, 40.0, *effects) for effects in EFFECTS),
    *((15.0, 60.0, *effects) for effects in EFFECTS),
)
"""Points between neighbours, points that are to be found, effects."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What simulated studies of one size said, on average.

    Attributes:
        widest: Of the intervals, in points.
        reached: The share of the studies whose widest interval is at most the wanted one.
        power: The share of the pairs a gap apart that were told apart.
    """

    widest: float
    reached: float
    power: float


def world_of(scenario_sd: float, expert_sd: float, *, gap: float, experts: int) -> World:
    """Contestants whose true ratings are `gap` points apart."""
    blank = World(
        ratings=np.linspace(0.0, 1.0, CONTESTANTS, dtype=np.float64),
        scenario_sd=scenario_sd,
        expert_sd=expert_sd,
        experts=experts,
    )
    ratings: FloatArray = np.arange(CONTESTANTS, dtype=np.float64) * gap
    for _ in range(3):  # votes of many experts pull ratings together; the more, the further apart
        found = replace(blank, ratings=ratings).truth()
        ratings = ratings * (gap * (CONTESTANTS - 1) / float(np.ptp(found)))
    return replace(blank, ratings=ratings)


def design_of(world: World) -> StudyDesign:
    """The design of a world, in points of its rated table."""
    truth = world.truth()
    pulled = float(np.ptp(truth) / np.ptp(world.ratings))
    return StudyDesign(
        contestants=CONTESTANTS,
        experts=world.experts,
        scenarios=SCENARIOS,
        spread=float(np.ptp(truth)),
        tie_share=world.tie_share(),
        expert_sd=world.shown_expert_sd(),
        scenario_sd=pulled * world.scenario_sd,
    )


def simulate(world: World, *, studies: int, apart: int) -> Outcome:
    """Studies with seeds 0, 1, 2 and so on; pairs are `apart` places from each other."""
    widths, told_apart = [], []
    for seed in range(studies):
        board = rate(world.votes(np.random.default_rng(seed)), rounds=ROUNDS, seed=seed)
        bounds = np.array([(line.lower, line.upper) for line in board.lines], dtype=np.float64)
        widths.append(float((bounds[:, 1] - bounds[:, 0]).max() / 2.0))
        assert board.separation is not None
        told_apart.append(board.separation.above.diagonal(-apart).mean())
    return Outcome(
        widest=float(np.mean(widths)),
        reached=float(np.mean(np.array(widths) <= HALF_WIDTH)),
        power=float(np.mean(told_apart)),
    )


def lines(studies: int) -> Iterator[str]:
    """The table, row by row."""
    heads = (
        "experts",
        "points between neighbours",
        "scenario / expert",
        f"votes per expert for an expected widest interval ±{HALF_WIDTH:.0f}",
        "widest, simulated; studies that reach it",
        f"votes per expert to find a gap, power {POWER:.0%}",
        "power, simulated",
    )
    yield "| " + " | ".join(heads) + " |"
    yield "|---" * len(heads) + "|"
    for experts in EXPERTS:
        for step, gap, *effects in WORLDS:
            world = world_of(*effects, gap=step, experts=experts)
            yield "| " + " | ".join(_row(world, step, gap, studies)) + " |"


def _row(world: World, step: float, gap: float, studies: int) -> list[str]:
    design = design_of(world)
    most = expect(design, design.units * world.experts)
    cells = [
        f"{world.experts}",
        f"{step:.0f}",
        f"{design.scenario_sd:.0f} / {design.expert_sd:.0f}",
    ]
    votes = votes_per_expert_for(design, lambda found: found.widest <= HALF_WIDTH)
    if votes is None:
        cells += [f"none: ±{most.widest:.0f} with all units", ""]
    else:
        found = simulate(replace(world, votes_per_expert=votes), studies=studies, apart=1)
        cells += [f"{votes:,}", f"±{found.widest:.1f}; {found.reached:.0%}"]
    votes = votes_per_expert_for(design, lambda found: found.tells_apart(gap, power=POWER))
    if votes is None:
        return [*cells, f"{gap:.0f} points: none, {most.gap_found(power=POWER):.0f} at least", ""]
    larger = replace(world, votes_per_expert=votes)
    found = simulate(larger, studies=studies, apart=round(gap / step))
    return [*cells, f"{gap:.0f} points: {votes:,}", f"{found.power:.0%}"]


if __name__ == "__main__":
    for line in lines(int(sys.argv[1]) if len(sys.argv) > 1 else 100):
        print(line, flush=True)
