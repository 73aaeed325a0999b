"""Whether what a table claims is true, over simulated studies: `docs/rating.md`.

    python -m bench.claims [STUDIES] [--write]

The sentence above a table of nine equals should call nobody better; intervals of a board's
founders and newcomers, and that of the left side's advantage, should hold the truth in 95 %. 300
studies a row take about a quarter of an hour of one processor.
"""

import argparse
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import groupby, product

import numpy as np

from arena.rating.board_table import anchor_lines
from arena.rating.comparisons import select_votes
from arena.rating.leaderboard import Leaderboard, rate
from arena.rating.side import side_bias
from arena.rating.verdict import verdict
from bench.coverage_study import EFFECTS, differing
from bench.report import ROOT, table, write_block
from bench.worlds import World, paper_ratings

ROUNDS = 500
PAPER = World(ratings=paper_ratings(), votes_per_expert=200)
EQUALS = replace(PAPER, ratings=np.full(9, 1000.0), votes_per_expert=100)
CLAIMS = (" better ", " worse ", "The order")
NEWCOMERS = 3

Measured = Mapping[str, float]


def null_worlds() -> list[World]:
    """Nine equals: few and many experts, even and uneven, and few scenarios."""
    by_experts = product((2, 3, 4, 5, 9, 40), (0.0, 1.5), (*EFFECTS, (0.0, 300.0)))
    worlds = [
        replace(differing(EQUALS, effects), experts=experts, uneven=uneven)
        for experts, uneven, effects in by_experts
    ]
    by_scenarios = product((2, 3, 5), (2, 5, 20), (*EFFECTS[:2], (300.0, 40.0)))
    few = replace(EQUALS, votes_per_expert=60)
    return worlds + [
        replace(differing(few, effects), experts=experts, scenarios=scenarios)
        for scenarios, experts, effects in by_scenarios
    ]


def write_sentence(board: Leaderboard) -> str:
    """Return what a study's page says of the table."""
    place = {number: place for place, number in enumerate(board.order)}
    above = None if board.judged is None else np.argwhere(board.judged.above).tolist()
    apart = None if above is None else [(place[a], place[b]) for a, b in above]
    return verdict(board.standings, board.votes, apart, is_few=board.is_few)


def measure_claims(world: World, studies: int) -> Measured:
    """Return the share of studies of equals of whom the sentence calls somebody better."""
    claims: list[bool] = []
    for seed in range(studies):
        board = rate(world.votes(np.random.default_rng(seed)), rounds=ROUNDS, seed=seed)
        text = write_sentence(board)
        claims.append(any(claim in text for claim in CLAIMS))
    return {"sentence": float(np.mean(claims))}


def board_worlds() -> list[World]:
    """Boards of the paper's contestants, the last three of whom come with a batch."""
    numbers = product(((5, 200), (9, 200), (20, 100)), EFFECTS)
    return [
        replace(differing(PAPER, effects), experts=experts, votes_per_expert=votes)
        for (experts, votes), effects in numbers
    ]


def measure_boards(world: World, studies: int) -> Measured:
    """Return how often intervals hold the truth around the founders' mean, by who it is.

    A third of the votes with a newcomer are cast.
    """
    names = [f"c{number}" for number in range(len(world.ratings))]
    founders = names[:-NEWCOMERS]
    points = world.truth()
    truth = dict(zip(names, points - points[:-NEWCOMERS].mean() + 1000.0, strict=True))
    held: dict[str, list[bool]] = {"founders": [], "newcomers": []}
    for seed in range(studies):
        rng = np.random.default_rng(seed)
        votes = world.votes(rng)
        is_old = np.maximum(votes.first, votes.second) < len(founders)
        votes = select_votes(votes, is_old | (rng.random(len(votes)) < 1 / 3))
        board = rate(votes, rounds=ROUNDS, founders=founders)
        for line in anchor_lines(board.lines, founders):
            who = "founders" if line.name in founders else "newcomers"
            if line.lower is not None and line.upper is not None:
                held[who].append(line.lower <= truth[line.name] <= line.upper)
    return {who: float(np.mean(inside)) for who, inside in held.items()}


def side_worlds() -> list[World]:
    """Experts who differ about the left side or do not, ever more uneven."""
    return [
        replace(
            PAPER, experts=experts, uneven=uneven, scenario_sd=50.0, side=30.0, side_sd=side_sd
        )
        for uneven, side_sd, experts in product((0.0, 1.0, 1.5), (0.0, 80.0), (3, 5, 20, 9))
    ]


def measure_sides(world: World, studies: int) -> Measured:
    """Return how often the interval of the left side's advantage holds the truth."""
    truth, held = world.truth_of_side(), list[bool]()
    for seed in range(studies):
        advantage = side_bias(world.votes(np.random.default_rng(seed))).advantage
        if advantage.lower is not None and advantage.upper is not None:
            held.append(advantage.lower <= truth <= advantage.upper)
    return {"advantage": float(np.mean(held))}


def spread_text(shares: Iterable[float]) -> str:
    """The median of the worlds, and the lowest and highest."""
    low, middle, high = np.percentile(list(shares), [0, 50, 100])
    return f"{middle:.1%} ({low:.1%} to {high:.1%})"


def rows_by(
    worlds: Sequence[World],
    title: Callable[[World], str],
    measure: Callable[[World, int], Measured],
    studies: int,
) -> list[list[str]]:
    """A row for all worlds of one title, with the shares of each measured kind."""
    rows = []
    for name, members in groupby(sorted(worlds, key=title), key=title):
        found = [measure(world, studies) for world in members]
        rows.append([name, str(len(found)), *(spread_text(m[k] for m in found) for k in found[0])])
        print(*rows[-1], sep=" | ", flush=True)
    return rows


def report(studies: int) -> str:
    """The three tables in Markdown."""
    few = [world for world in null_worlds() if world.scenarios < PAPER.scenarios]
    many = [world for world in null_worlds() if world.scenarios == PAPER.scenarios]
    sentence = rows_by(
        many,
        lambda world: f"{world.experts:2d} experts, {'uneven' if world.uneven else 'even'}",
        measure_claims,
        studies,
    )
    sentence += rows_by(
        few, lambda world: f"{world.scenarios} scenarios, 2 to 20 experts", measure_claims, studies
    )
    boards = rows_by(board_worlds(), lambda w: f"{w.experts:2d} experts", measure_boards, studies)
    sides = rows_by(
        side_worlds(),
        lambda w: f"uneven by {w.uneven}, habits differ by {w.side_sd:.0f}",
        measure_sides,
        studies,
    )
    form = "median (lowest to highest)"
    return "\n\n".join(
        [
            f"{studies} simulated studies a world; {form} of the worlds.",
            table(["nine equals", "worlds", "sentence"], sentence),
            table(["board", "worlds", "founders", "newcomers"], boards),
            table(["left side", "worlds", "advantage"], sides),
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("studies", type=int, nargs="?", default=300)
    parser.add_argument("--write", action="store_true", help="into docs/rating.md")
    asked = parser.parse_args()
    text = report(asked.studies)
    print(text)
    if asked.write:
        write_block("claims", text, page=ROOT / "docs" / "rating.md")


if __name__ == "__main__":
    main()
