"""How often 95 % intervals contain the truth, over simulated studies: `docs/rating.md`.

    python -m bench.coverage_study [STUDIES] [--write]
    python -m bench.coverage_study [STUDIES] --odd [--write]      # worlds that break assumptions
    python -m bench.coverage_study [STUDIES] --raters [--write]   # judgements of experts

Each world is simulated with the paper's nine ratings, for coverage, and with nine equals, of whom
no pair should be told apart. 400 studies a row take about half an hour of one processor.
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import product

import numpy as np

from arena.rating import models
from arena.rating.comparisons import TIE, WIN, BoolArray, Comparisons, FloatArray, count_pairs
from arena.rating.influence import bradley_terry, without_each_expert
from arena.rating.models import DidNotConverge, Meetings, to_elo
from arena.rating.panel import judge_rater
from arena.rating.random_effects import find_quantiles
from arena.rating.ranking import FEWEST_TO_JUDGE, judge_pairs
from arena.rating.reliability import Evidence, evidence_of_repeats, raters, repeat_consistency
from arena.rating.rules import Unit
from arena.rating.sandwich import estimate_spread, pulls_of_model
from arena.rating.snapshot_document import PanelRater
from bench.odd_worlds import ODD_WORLDS, OddWorld
from bench.report import ROOT, table, write_block
from bench.worlds import World, paper_ratings

EFFECTS = ((0.0, 0.0), (100.0, 40.0), (0.0, 80.0))
"""Points by which scenarios, and experts, differ about a contestant."""
ROUNDS = 500
DEFAULT, CLOSED, SINGLE = METHODS = "bootstrap, default", "closed form", "single votes"


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
        widths: (N,) of the default intervals over those in closed form, the median contestant's.
        told_apart: (N,) whether any true order of a pair is contradicted, or equals told apart.
    """

    held: dict[str, list[BoolArray]] = field(default_factory=lambda: {m: [] for m in METHODS})
    widths: list[float] = field(default_factory=list)
    told_apart: list[bool] = field(default_factory=list)

    def coverage(self, method: str = DEFAULT, contestants: slice = slice(None)) -> float:
        return float(np.array(self.held[method])[:, contestants].mean())

    @property
    def false(self) -> float:
        return float(np.mean(self.told_apart))


def study(world: World | OddWorld, *, studies: int, judge: bool = False) -> Found:
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
    rating, spread = to_elo(strengths), estimate_spread(pulls, Unit.TWO_WAY)
    if seed is not None:
        above = judge_pairs(rating, spread, rounds=ROUNDS, seed=seed).above
        found.told_apart.append(bool((above & (truth[:, None] < truth + 1e-6)).any()))
        return
    quantiles = find_quantiles(
        pulls,
        spread,
        Unit.TWO_WAY,
        np.ones(len(truth), dtype=np.bool_),
        rounds=ROUNDS,
        seed=len(found.widths),
    )
    half_widths = {
        DEFAULT: quantiles * np.sqrt(spread.covariance.diagonal()),
        CLOSED: spread.half_widths(),
        SINGLE: 1.959964 * np.sqrt(pulls.by_row().diagonal()),
    }
    found.widths.append(float(np.median(half_widths[DEFAULT] / half_widths[CLOSED])))
    for method, half_width in half_widths.items():
        found.held[method].append(np.abs(rating - truth) <= half_width)


Rows = Iterator[list[str]]


def rows_of_worlds(studies: int) -> Rows:
    """Yield per plan and effects the lowest and highest of its worlds."""
    yield ["plan", "scenario / expert", "experts", *METHODS, "told apart, at most"]
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
        yield [
            plan,
            f"{scenario_sd:.0f} / {expert_sd:.0f}",
            _range([world.experts for world in members], "d"),
            *(_range([one.coverage(method) for one in found], ".1%") for method in METHODS),
            f"{max(false):.1%}" if false else "",
        ]


def rows_of_odd_worlds(studies: int) -> Rows:
    """Yield worlds that break assumptions; a controversial contestant by itself."""
    yield ["world", *METHODS, "width / closed form"]
    for name, world in ODD_WORLDS.items():
        found = study(world, studies=studies)
        cells = [f"{found.coverage(method):.1%}" for method in METHODS]
        yield [name, *cells, f"{np.median(found.widths):.2f}"]
        for contestant in world.controversial:
            alone = slice(contestant, contestant + 1)
            cells = [f"{found.coverage(method, alone):.1%}" for method in METHODS]
            yield ["– this contestant alone", *cells, ""]


# --- Judgements of experts -----------------------------------------------------------------------

KINDS = ("honest", "coin", "always equal", "alternating", "reversed", "always left", "hasty")
PANEL = World(ratings=paper_ratings(), scenario_sd=100.0, expert_sd=40.0)


def rows_of_raters(studies: int) -> Rows:
    """Yield how often an expert of each kind is looked at, and called reliable."""
    yield ["checks", "votes", *KINDS]
    for checks, votes in product((0.0, 0.05), (30, 100, 300)):
        world, cells = replace(PANEL, votes_per_expert=votes), []
        for kind in KINDS:
            words = [word for seed in range(studies) for word in _judge(world, kind, checks, seed)]
            shares = [words.count(word) / len(words) for word in ("look here", "reliable")]
            cells.append("{:.0%}, {:.0%}".format(*shares))
        yield [f"{checks:.0%}", str(votes), *cells]


def _judge(world: World, kind: str, checks: float, seed: int) -> Iterator[str]:
    """Yield the word on everybody who is honest, or on expert 0 who is not."""
    rng = np.random.default_rng(seed)
    votes, repeated, again = world.with_repeats(rng, 0.05)
    score = votes.score.copy()
    rows, own = np.flatnonzero(votes.expert == 0), votes.expert[repeated] == 0
    if kind == "reversed":
        score[rows], again[own] = 1.0 - score[rows], 1.0 - again[own]
    elif kind != "honest":
        answers = _careless(kind, len(rows) + own.sum(), rng)
        score[rows] = answers[: len(rows)]
        # Repeats have their sides swapped; the left one is the other contestant then.
        again[own] = 1.0 - answers[len(rows) :]
    shown = round(checks * world.votes_per_expert)
    chance = {"reversed": 0.05, "alternating": 0.5, "always left": 0.5, "always equal": 0.0}
    chance |= dict.fromkeys(("coin", "hasty"), 1 / 3)
    votes = replace(votes, score=score)
    strengths = bradley_terry(votes)
    without = np.full((world.experts, len(world.ratings)), np.nan)
    if strengths is not None:
        without = without_each_expert(votes, strengths)
    ms = np.where((votes.expert == 0) & (kind == "hasty"), 600.0, 4000.0)
    repeats = repeat_consistency(score[repeated], again, votes.expert[repeated])
    lines = raters(votes, ms=ms, without=without)
    steadiness = evidence_of_repeats(repeats, {line.expert: line.ties for line in lines})
    for line in lines if kind == "honest" else lines[:1]:
        passed = int(rng.binomial(shown, chance.get(kind, 0.95)))
        rater = PanelRater(
            **{one.name: getattr(line, one.name) for one in fields(line)}
            | {"evidence": line.evidence + steadiness.get(line.expert, Evidence())},
            judge="",
            name="",
            moves=None,
            repeats=repeats.by_expert.get(line.expert, (0, 0)),
            checks=(shown, passed),
        )
        yield judge_rater(rater).reliability.value


def _careless(kind: str, number: int, rng: np.random.Generator) -> FloatArray:
    """(N,) what the left ones score."""
    if kind in ("coin", "hasty"):
        return np.asarray(rng.integers(0, 3, number) / 2.0)
    if kind == "alternating":
        return np.asarray(np.arange(number) % 2, dtype=np.float64)
    return np.full(number, TIE if kind == "always equal" else WIN)


def _range(values: Sequence[float], form: str) -> str:
    lowest, highest = format(min(values), form), format(max(values), form)
    return lowest if lowest == highest else f"{lowest} to {highest}"


TABLES = {"worlds": rows_of_worlds, "odd": rows_of_odd_worlds, "raters": rows_of_raters}


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("studies", type=int, nargs="?", default=400)
    parser.add_argument("--write", action="store_true", help="into docs/rating.md")
    for name in ("odd", "raters"):
        parser.add_argument(f"--{name}", action="store_const", dest="table", const=name)
    asked = parser.parse_args()
    name, rows = asked.table or "worlds", list[list[str]]()
    for row in TABLES[name](asked.studies):
        print(*row, sep=" | ", flush=True)
        rows.append(row)
    if asked.write:
        text = f"{asked.studies} simulated studies a row.\n\n{table(rows[0], rows[1:])}"
        write_block(name, text, page=ROOT / "docs" / "rating.md")


if __name__ == "__main__":
    main()
