"""The paper's study, planned with many seeds: `python -m bench.planner [SEEDS]`.

Nine experts, 50 scenarios, the paper's uneven numbers of votes, 5 % hidden repeats and 2 %
attention checks. Every plan is checked; the first that breaks a rule stops the run.
"""

from __future__ import annotations

import math
import statistics
import sys
import time

from arena.pairing.order import CHECK, MAIN, REPEAT
from arena.pairing.plan import plan
from tests.pairing.studies import (
    APPEARANCES,
    appearances,
    by_expert,
    check_extras,
    chi_square_of_sides,
    paper_rules,
    smallest_distance,
    smallest_gap,
)

SEEDS = 200
ONE_IN_A_THOUSAND = 27.9
"""The chi-square beyond which nine fair coins lie once in a thousand times."""


def main(seeds: int) -> None:
    seconds, chi_squares, gaps, distances = [], [], [], []
    kinds = {MAIN: 0, REPEAT: 0, CHECK: 0}
    for seed in range(seeds):
        rules = paper_rules(seed)
        started = time.process_time()
        made = plan(rules)
        seconds.append(time.process_time() - started)
        check_extras(rules, made)
        assert appearances(made) == APPEARANCES, f"seed {seed}: {appearances(made)}"
        chi_squares.append(chi_square_of_sides(made))
        gaps += [smallest_gap(mine) for mine in by_expert(made).values()]
        distances += [smallest_distance(mine) for mine in by_expert(made).values()]
        kinds = {kind: sum(m.kind == kind for m in made.matchups) for kind in kinds}
    assert max(chi_squares) < ONE_IN_A_THOUSAND
    ninetieth = sorted(seconds)[math.ceil(0.9 * seeds) - 1]
    print(f"| | {seeds} seeds |")
    print("|---|---|")
    print(f"| votes, repeats, checks | {kinds[MAIN]:,}, {kinds[REPEAT]:,}, {kinds[CHECK]:,} |")
    print("| appearances of each contestant | exact in every plan |")
    print(f"| others between two showings of a scenario | {min(gaps)} or more |")
    print(f"| places between a pair and its repeat | {min(distances)} or more |")
    print(f"| chi-square of sides, nine contestants | {max(chi_squares):.2f} at most |")
    print(f"| seconds, median | {statistics.median(seconds):.3f} |")
    print(f"| seconds, 90 % / longest | {ninetieth:.3f} / {max(seconds):.3f} |")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS)
