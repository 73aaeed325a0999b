"""How many of the demo's pairs settle by tolerance, and what that does to ratings.

`python -m bench.tolerance [VOTERS [SEED]]`: the demo's four contestants on the paper's
50 scenarios (the stand-in over HTTP in this process, no database), every pair of pictures judged
once by each simulated voter. Voters hold each change against the reference by its mean distance,
see no difference up to 0.15 m, err beyond it, and press anything in one of twenty pairs.
Everything here is simulated.
"""

from __future__ import annotations

import hashlib
import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from arena.rating.comparisons import TIE, Comparison, as_arrays
from arena.rating.leaderboard import Leaderboard, rate
from augment.baselines.rule_placer import place
from augment.errors import CannotPlace
from augment.fake_llm.server import running
from augment.metrics.displacement import Likeness, are_alike, displacement
from augment.scene.entities import Modification
from tests.fake_llm.asking import outcome
from tests.fixtures.shelf import SLUGS, entry, shown_scene
from tests.intents import intents

SEEN_M = Likeness().distance_m
MISS_M = 5.0
"""What is missing or too much weighs as much as standing so far off."""
NOISE_M, LAPSES = 0.5, 0.05

Changes = dict[str, dict[str, Modification]]
"""By scenario and contestant."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Unit:
    """Two changes of one scenario.

    Attributes:
        better_m: How much nearer to the reference the first is than the second.
        is_identical, is_alike: Settled without anybody; what is identical is alike.
    """

    scenario: str
    first: str
    second: str
    better_m: float
    is_identical: bool
    is_alike: bool


def units_of(changes: Changes, references: Mapping[str, Modification]) -> list[Unit]:
    """Every pair of contestants on every scenario."""
    return [
        Unit(
            scenario=scenario,
            first=first,
            second=second,
            better_m=_error_m(by_name[second], references[scenario])
            - _error_m(by_name[first], references[scenario]),
            is_identical=by_name[first] == by_name[second],
            is_alike=are_alike(by_name[first], by_name[second]),
        )
        for scenario, by_name in sorted(changes.items())
        for first, second in combinations(sorted(by_name), 2)
    ]


def judge(units: list[Unit], *, voters: int, seed: int) -> list[list[Comparison]]:
    """What each voter says of each unit, in the order of the units."""
    rng = np.random.default_rng(seed)
    said: list[list[Comparison]] = []
    for one in units:
        votes = []
        for voter in range(voters):
            seen_m = one.better_m + rng.normal(0.0, NOISE_M)
            score = 0.5 + 0.5 * math.copysign(1.0, seen_m)
            if abs(one.better_m) <= SEEN_M:
                score = TIE
            if rng.random() < LAPSES:
                score = float(rng.choice([0.0, TIE, 1.0]))
            votes.append(_vote(one, score, f"voter-{voter}"))
        said.append(votes)
    return said


def rate_each_way(units: list[Unit], said: list[list[Comparison]]) -> dict[str, Leaderboard]:
    """Ratings of all votes, of those on pairs that differ, and of these with settled ties.

    The product counts as many ties as voters would have given.
    """
    names = sorted({name for one in units for name in (one.first, one.second)})
    every = [vote for votes in said for vote in votes]
    apart = [
        vote for one, votes in zip(units, said, strict=True) for vote in votes if not one.is_alike
    ]
    alike = [(one, votes) for one, votes in zip(units, said, strict=True) if one.is_alike]
    each = [replace(vote, score=TIE) for _, votes in alike for vote in votes]
    return {
        "all pairs voted on": rate(as_arrays(names, every)),
        "settled and left out": rate(as_arrays(names, apart)),
        "settled, a tie for each voter": rate(as_arrays(names, [*apart, *each])),
    }


def disagreements(boards: Mapping[str, Leaderboard]) -> list[str]:
    """Contestants whose rating lies outside the interval that another way gives."""
    found = []
    for (one, first), (other, second) in combinations(boards.items(), 2):
        for line, same in zip(_lines(first), _lines(second), strict=True):
            if not (line[2] <= same[1] <= line[3] and same[2] <= line[1] <= same[3]):
                found.append(f"{line[0]}: {one} against {other}")
    return found


def demo_changes() -> tuple[Changes, dict[str, Modification]]:
    """What the demo's contestants make of the paper's scenarios, and the references."""
    changes: Changes = {}
    references = {slug: entry(slug).reference or Modification() for slug in SLUGS}
    with running(intents=intents) as server:
        for slug in SLUGS:
            scene = shown_scene(slug)
            try:
                ruled = place(scene, entry(slug).intent, seed=_seed_of(slug)).modification
            except CannotPlace:
                ruled = Modification()
            asked = {
                name: outcome(server, model, scene, entry(slug).instruction).modification
                for name, model in (("good-otm", "fake-good"), ("careless-otm", "fake-careless"))
            }
            changes[slug] = {
                "reference": references[slug],
                "rule-placer": ruled,
                **{name: made or Modification() for name, made in asked.items()},
            }
    return changes, references


def main(voters: int, seed: int) -> None:
    """Print both tables."""
    units = units_of(*demo_changes())
    boards = rate_each_way(units, judge(units, voters=voters, seed=seed))
    print(f"{len(units)} pairs of pictures; voters {voters}, seed {seed}; simulated.\n")
    print("| pair | pairs of pictures | identical | alike besides | share settled |")
    print("|---|---|---|---|---|")
    pairs = sorted({(one.first, one.second) for one in units})
    for first, second in pairs:
        own = [one for one in units if (one.first, one.second) == (first, second)]
        print(f"| {first}, {second} {_settled(own)}")
    print(f"| all {_settled(units)}\n")
    print("| contestant | " + " | ".join(boards) + " |")
    print("|---" * (1 + len(boards)) + "|")
    for lines in zip(*map(_lines, boards.values()), strict=True):
        told = (f"{value:.0f} ({low:.0f} to {high:.0f})" for _, value, low, high in lines)
        print(f"| {lines[0][0]} | " + " | ".join(told) + " |")
    outside = disagreements(boards)
    print("\n" + ("; ".join(outside) or "Every rating lies within the intervals of the others."))


# --- Private -----------------------------------------------------------------------------------


def _seed_of(slug: str) -> int:
    """As in every job."""
    return int.from_bytes(hashlib.sha256(slug.encode()).digest()[:4], "big")


def _vote(one: Unit, score: float, voter: str) -> Comparison:
    return Comparison(
        first=one.first, second=one.second, score=score, expert=voter, scenario=one.scenario
    )


def _error_m(change: Modification, reference: Modification) -> float:
    found = displacement(change, reference)
    misses = len(found.missing) + len(found.surplus)
    number = max(len(found.matches) + misses, 1)
    return (sum(found.distances_m) + MISS_M * misses) / number


def _settled(units: list[Unit]) -> str:
    identical = sum(one.is_identical for one in units)
    alike = sum(one.is_alike for one in units)
    share = 100.0 * alike / len(units)
    return f"| {len(units)} | {identical} | {alike - identical} | {share:.0f} % |"


def _lines(board: Leaderboard) -> list[tuple[str, float, float, float]]:
    """Name, rating and interval of everybody, by name; infinite where it is open."""
    return sorted(
        (
            line.name,
            math.nan if line.rating is None else line.rating,
            -math.inf if line.lower is None else line.lower,
            math.inf if line.upper is None else line.upper,
        )
        for line in board.lines
    )


if __name__ == "__main__":
    numbers = [int(text) for text in sys.argv[1:]]
    main(*(numbers + [8, 1][len(numbers) :]))
