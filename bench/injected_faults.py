"""Faults made on purpose against the first guess of the checks, over the whole catalogue.

`python -m bench.injected_faults [COUNT [SEED]]`: COUNT placements with one fault each,
every kind as often as every other, and COUNT right ones, jittered. Prints tables in Markdown.
"""

import random
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache

from augment.checks import Ground
from augment.checks.finding import FaultClass
from augment.checks.registry import check_against_intent
from augment.metrics.fault_guess import first_guess
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import Modification
from augment.scene.intent import Intent
from bench.faults import LABELS, MAKERS
from bench.report import table
from bench.shifts import jitter, move_along
from tests.fixtures.shelf import SLUGS, entry, shown_scene

COUNT, SEED = 1000, 2026
SHIFTS_M = (1.0, 2.0, 2.5, 3.0, 4.0, 5.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Case:
    """A scenario, read once."""

    slug: str
    reference: Modification
    ground: Ground
    route: EgoRoute
    intent: Intent | None

    def guess(self, change: Modification) -> frozenset[FaultClass]:
        """The checks see the scene, the intent and the change: nothing else is handed over."""
        return first_guess(check_against_intent(self.ground, change, self.intent))


@dataclass(kw_only=True)
class Tally:
    """What was guessed against what is true."""

    hits: Counter[FaultClass] = field(default_factory=Counter)
    false: Counter[FaultClass] = field(default_factory=Counter)
    missed: Counter[FaultClass] = field(default_factory=Counter)
    kinds: set[str] = field(default_factory=set)
    clean: int = 0
    right: int = 0

    def add(self, true: frozenset[FaultClass], guessed: frozenset[FaultClass]) -> None:
        self.hits.update(true & guessed)
        self.false.update(guessed - true)
        self.missed.update(true - guessed)

    def precision(self, fault: FaultClass) -> float:
        return _share(self.hits[fault], self.hits[fault] + self.false[fault])

    def recall(self, fault: FaultClass) -> float:
        return _share(self.hits[fault], self.hits[fault] + self.missed[fault])


@cache
def cases() -> tuple[Case, ...]:
    """All scenarios of the catalogue."""
    return tuple(_case(slug) for slug in SLUGS)


def measure(count: int, seed: int, *, among: tuple[Case, ...] | None = None) -> Tally:
    """So many injected faults and as many right placements, over the scenarios in turn."""
    rng, tally = random.Random(seed), Tally()
    chosen = cases() if among is None else among
    for case, kind, change in _injections(chosen, count, rng):
        guessed = case.guess(change)
        tally.add(frozenset({LABELS[kind]}), guessed)
        tally.kinds.add(kind)
    for number in range(count):
        case = chosen[number % len(chosen)]
        guessed = case.guess(jitter(case.route, case.reference, rng))
        tally.add(frozenset(), guessed)
        tally.clean += not guessed
        tally.right += 1
    return tally


def shifted_share(along_m: float) -> float:
    """The share of references that, so far off along the lane, are called misplaced."""
    read = [case for case in cases() if case.intent is not None]
    found = 0
    for case in read:
        for sign in (-1.0, 1.0):
            moved = tuple(
                move_along(case.route, one, sign * along_m) for one in case.reference.added
            )
            found += FaultClass.POSITION in case.guess(Modification(added=moved))
    return _share(found, 2 * len(read))


def class_table(tally: Tally) -> str:
    """Precision and recall of each class of fault, in Markdown."""
    rows = [
        [fault.value, f"{tally.precision(fault):.3f}", f"{tally.recall(fault):.3f}"]
        for fault in FaultClass
    ]
    return table(["class", "precision", "recall"], rows)


def report(tally: Tally, *, count: int, seed: int) -> str:
    """Return what docs/method.md shows, in Markdown."""
    read = sum(case.intent is not None for case in cases())
    shifts = [[f"{shift_m:g} m", f"{shifted_share(shift_m):.0%}"] for shift_m in SHIFTS_M]
    return "\n\n".join(
        [
            f"{count} injections, {tally.right} right placements, seed {seed}; {read} of "
            f"{len(cases())} instructions have an intent.",
            class_table(tally),
            f"Right placements without a guess: {tally.clean} of {tally.right}.",
            table(["moved by", "called a position fault"], shifts),
        ]
    )


# Private


def _injections(
    among: tuple[Case, ...], count: int, rng: random.Random
) -> Iterator[tuple[Case, str, Modification]]:
    """Kinds in turn, each on the next scenario on which it makes a difference."""
    kinds, turns, number = list(MAKERS), Counter[str](), 0
    while number < count:
        kind = kinds[number % len(kinds)]
        for _ in among:
            case = among[turns[kind] % len(among)]
            turns[kind] += 1
            right = jitter(case.route, case.reference, rng)
            agents = MAKERS[kind](case.route, right.added, rng) if right.added else None
            if agents is not None:
                yield case, kind, Modification(added=agents)
                break
        else:
            raise LookupError(f"{kind} makes no difference on any scenario")
        number += 1


def _case(slug: str) -> Case:
    scene = shown_scene(slug)
    route = EgoRoute.of(scene)
    assert route is not None
    return Case(
        slug=slug,
        reference=entry(slug).reference,
        ground=Ground.of(scene),
        route=route,
        intent=entry(slug).intent,
    )


def _share(part: int, whole: int) -> float:
    return part / whole if whole else 1.0


def main(count: int = COUNT, seed: int = SEED) -> None:
    """Print all tables."""
    print(report(measure(count, seed), count=count, seed=seed))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
