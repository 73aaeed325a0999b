"""How often 95 % intervals contain the truth, over simulated studies: `docs/rating.md`.

    python -m bench.coverage_study [STUDIES] [--write]

Each world is simulated with the paper's nine ratings, for coverage, and with nine equals, of whom
no pair should be told apart. 400 studies a row take about half an hour of one processor.
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path

import numpy as np

from arena.rating import models
from arena.rating.comparisons import BoolArray, Comparisons, FloatArray, count_pairs
from arena.rating.models import DidNotConverge, Meetings, to_elo
from arena.rating.ranking import FEWEST_TO_JUDGE, judge_pairs
from arena.rating.rules import Unit
from arena.rating.sandwich import pulls_of_model, spread_of
from bench.worlds import World, paper_ratings

EFFECTS = ((0.0, 0.0), (100.0, 40.0), (0.0, 80.0))
"""Points by which scenarios, and experts, differ about a contestant."""
ROUNDS = 500
PAGE = Path(__file__).resolve().parents[1] / "docs" / "rating.md"
DEFAULT, SINGLE = METHODS = "closed form, default", "single votes"


def worlds() -> Iterator[tuple[str, World]]:
    """What is simulated, by what the rows have in common."""
    blank = World(ratings=paper_ratings(), scenario_sd=100.0, expert_sd=40.0, votes_per_expert=200)
    for experts, votes, effects in product((3, 5, 9, 20), (40, 480), EFFECTS):
        even = replace(blank, experts=experts, votes_per_expert=votes)
        yield "even", differing(even, effects)
    strong = replace(blank, experts=3, votes_per_expert=480)
    yield "even", differing(strong, (0.0, 300.0))
    for scenarios, experts, effects in product((3, 5, 8), (5, 9, 20), EFFECTS[:2]):
        few = replace(blank, scenarios=scenarios, experts=experts, votes_per_expert=100)
        yield "3, 5 or 8 scenarios", differing(few, effects)
    for uneven, experts, effects in product((1.0, 1.5), (5, 9, 20), EFFECTS):
        some = replace(blank, uneven=uneven, experts=experts)
        yield "uneven experts", differing(some, effects)
    for experts in (5, 9, 20):
        yield "a fifth spammers", replace(blank, experts=experts, spammers=0.2)
    for experts in (5, 9):
        yield "handed over", replace(blank, experts=experts, handed_over=True)


def differing(world: World, effects: tuple[float, float]) -> World:
    return replace(world, scenario_sd=effects[0], expert_sd=effects[1])


@dataclass(slots=True)
class Found:
    """What studies of one world said.

    Attributes:
        held: By method, (N, C) whether the interval holds the truth.
        told_apart: (N,) whether any true order of a pair is contradicted, or equals told apart.
    """

    held: dict[str, list[BoolArray]] = field(default_factory=lambda: {m: [] for m in METHODS})
    told_apart: list[bool] = field(default_factory=list)

    def coverage(self, method: str = DEFAULT, contestants: slice = slice(None)) -> float:
        return float(np.array(self.held[method])[:, contestants].mean())

    @property
    def false(self) -> float:
        return float(np.mean(self.told_apart))


def study(world: World, *, studies: int, judge: bool = False) -> Found:
    """What studies with seeds 0, 1, 2 and so on say of a world; `judge` also judges all pairs.

    Studies whose votes determine no ratings are left out.
    """
    found, truth = Found(), world.truth()
    for seed in range(studies):
        votes = world.votes(np.random.default_rng(seed))
        try:
            _add(found, votes, truth, seed if judge else None)
        except DidNotConverge:
            continue
    return found


def _add(found: Found, votes: Comparisons, truth: FloatArray, seed: int | None) -> None:
    counts = count_pairs(votes)
    met = Meetings(len(truth), counts)
    strengths = models.fit(met, counts.games[:, None], counts.scores[:, None])[:, 0]
    pulls = pulls_of_model(votes, met, counts.games, strengths)
    rating, spread = to_elo(strengths), spread_of(pulls, Unit.TWO_WAY)
    half_widths = {
        DEFAULT: spread.half_widths(),
        SINGLE: 1.959964 * np.sqrt(pulls.by_row().diagonal()),
    }
    for method, half_width in half_widths.items():
        found.held[method].append(np.abs(rating - truth) <= half_width)
    if seed is not None:
        above = judge_pairs(rating, spread, rounds=ROUNDS, seed=seed).above
        found.told_apart.append(bool((above & (truth[:, None] < truth + 1e-6)).any()))


def lines(studies: int) -> Iterator[str]:
    """Yield the table of worlds: per plan and effects the lowest and highest of its worlds."""
    yield from _head("plan", "scenario / expert", "experts", *METHODS, "told apart, at most")
    groups: dict[tuple[str, float, float], list[World]] = {}
    for plan, world in worlds():
        groups.setdefault((plan, world.scenario_sd, world.expert_sd), []).append(world)
    for (plan, scenario_sd, expert_sd), members in groups.items():
        found, false = [], []
        for world in members:
            found.append(study(world, studies=studies))
            if min(world.experts, world.scenarios) >= FEWEST_TO_JUDGE:
                equal = replace(world, ratings=np.full(len(world.ratings), 1000.0))
                false.append(study(equal, studies=studies, judge=True).false)
        cells = (
            plan,
            f"{scenario_sd:.0f} / {expert_sd:.0f}",
            _range([world.experts for world in members], "d"),
            *(_range([one.coverage(method) for one in found], ".1%") for method in METHODS),
            f"{max(false):.1%}" if false else "",
        )
        yield "| " + " | ".join(cells) + " |"


def _range(values: Sequence[float], form: str) -> str:
    lowest, highest = format(min(values), form), format(max(values), form)
    return lowest if lowest == highest else f"{lowest} to {highest}"


def _head(*heads: str) -> Iterator[str]:
    yield "| " + " | ".join(heads) + " |"
    yield "|---" * len(heads) + "|"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("studies", type=int, nargs="?", default=400)
    parser.add_argument("--write", action="store_true", help="into docs/rating.md")
    asked = parser.parse_args()
    printed = [f"{asked.studies} simulated studies a row.", ""]
    for line in lines(asked.studies):
        print(line, flush=True)
        printed.append(line)
    if asked.write:
        before, rest = PAGE.read_text().split("<!-- worlds -->\n")
        after = rest.partition("<!-- end of worlds -->")[2]
        text = "\n".join(["<!-- worlds -->", *printed, "<!-- end of worlds -->"])
        PAGE.write_text(before + text + after)


if __name__ == "__main__":
    main()
