"""Run mutations in copies of the tree: `python -m tests.mutants [AREA or NAME ...] [--drawn N]`.

Each one's tests run with it, up to the first that fails; in the end those that failed run once
more without a mutation: a mutation is caught where they pass then. The outcomes are printed; their
counts are written to docs/benchmarks.md when all mutations ran. `--drawn` draws N places of all
modules by a seed instead; what the nearest tests let pass is held against all that are quick.
"""

import argparse
import os
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from queue import SimpleQueue

from bench.report import PAGE, write_block
from tests.environment import fix_environment
from tests.mutants.drawn import DRAWN, EVERYTHING, draw
from tests.mutants.mutation import Mutation, mutations
from tests.mutants.trees import FAILED, PASSED, Tree

CAUGHT, SURVIVED, EQUIVALENT = "caught", "SURVIVED", "equivalent"


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What became of one mutation, and the test that noticed."""

    of: Mutation
    came: str
    noticed_by: str
    took_s: float

    @property
    def is_right(self) -> bool:
        return self.came in (CAUGHT, EQUIVALENT)


def main(wanted: Sequence[str], *, at_once: int, drawn: int, seed: int) -> int:
    chosen = [one for one in mutations() if not wanted or {one.area, one.name} & set(wanted)]
    if drawn:
        chosen = draw(drawn, seed)
    os.nice(10)
    fix_environment()
    os.environ.pop("DATABASE_URL", None)
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        trees: SimpleQueue[Tree] = SimpleQueue()
        for number in range(at_once):
            trees.put(Tree(Path(folder) / str(number)))
        with ThreadPoolExecutor(at_once) as threads:
            found = []
            for one in threads.map(lambda one: _outcome(trees, one), chosen):
                found.append(one)
                print(
                    f"{one.of.area:13} {one.of.name:45} {one.came:12} {one.took_s:5.1f} s", end=" "
                )
                print(one.noticed_by, flush=True)
        found = _without_what_is_red(trees.get(), found)
    if drawn:
        print(f"drawn by seed {seed}: {report(found)}")
    elif not wanted:
        write_block("mutants", report(found), page=PAGE)
    bad = [one.of.name for one in found if not one.is_right]
    print(f"{len(found) - len(bad)} of {len(found)} noticed or equivalent", *bad, sep="\n  ")
    return 1 if bad else 0


def _without_what_is_red(tree: Tree, found: Sequence[Outcome]) -> list[Outcome]:
    """Nothing is learnt from a test that fails without the mutation as well."""
    noticing = sorted({one.noticed_by for one in found if one.noticed_by})
    if not noticing:
        return list(found)
    ended = tree.run(noticing, to_the_end=True)
    if ended.code not in (PASSED, FAILED):
        raise SystemExit(f"{ended.said}\nThe tests do not run without a mutation.")
    print(f"{len(noticing)} tests have noticed; {len(ended.failed)} fail anyway", *ended.failed)
    return [
        replace(one, came="red without it") if one.noticed_by in ended.failed else one
        for one in found
    ]


def _outcome(trees: SimpleQueue[Tree], one: Mutation) -> Outcome:
    tree, began = trees.get(), time.monotonic()
    try:
        with tree.mutated(one):
            ended = tree.run(one.tests)
            if one.area == DRAWN and ended.code == PASSED:
                ended = tree.run(EVERYTHING)
    finally:
        trees.put(tree)
    if ended.code == FAILED and ended.failed:
        came = CAUGHT if not one.equivalent else "not equivalent"
    elif ended.code == PASSED:
        came = EQUIVALENT if one.equivalent else SURVIVED
    else:
        came = f"tests did not run ({ended.code})"
    noticed_by = ended.failed[0] if ended.failed else ""
    return Outcome(of=one, came=came, noticed_by=noticed_by, took_s=time.monotonic() - began)


def report(found: Sequence[Outcome]) -> str:
    """Return how many mutations there are, and what came of them."""
    counts = Counter(one.came for one in found).most_common()
    outcomes = ", ".join(f"{number} {came}" for came, number in counts)
    return f"{len(found)} mutations in {len({one.of.area for one in found})} areas: {outcomes}."


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("wanted", nargs="*", metavar="AREA|NAME", help="all of them without any")
    parser.add_argument("-j", type=int, default=2, dest="at_once", help="how many at once")
    parser.add_argument("--drawn", type=int, default=0, metavar="N", help="places of all modules")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    raise SystemExit(main(asked.wanted, at_once=asked.at_once, drawn=asked.drawn, seed=asked.seed))
