"""Simulated studies that break what intervals assume: camps, drifts, gaps, adaptive plans.

As `bench.worlds`, whose worlds are regular; here effects need not be normal or independent, plans
not balanced. The truth is the Bradley-Terry rating of infinitely many votes of new experts on new
scenarios, by pairs as frequent as in the study; it is simulated.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.random import Generator
from scipy.special import expit

from arena.rating.comparisons import LOSS, TIE, WIN, BoolArray, Comparisons, FloatArray, IntArray
from arena.rating.models import ELO_PER_LOGIT
from bench.worlds import paper_ratings, rate_scores

_DRAWN = 20_000
"""Experts on scenarios that the truth is the mean of."""
_TYPES = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class OddWorld:
    """What is true, in Elo points but for thresholds, which are logits.

    Attributes:
        expert_sd, scenario_sd: By how much each kind differs about a contestant.
        cell_sd: By how much an expert differs from themselves between scenarios.
        threshold, threshold_sd: Of calling two equal, and by how much experts differ in it.
        side, side_sd: What being on the left is worth, and by how much experts differ in it.
        is_heavy: Effects of experts have Student's t with 3 degrees, of scenarios are exponential.
        uneven, uneven_scenarios: The standard deviation of the logarithm of votes of each.
        seldom: Contestants who have a twentieth of the others' votes.
        seen: Scenarios that an expert sees; 0 for all.
        camps: By how much two camps of experts differ from the mean.
        types: By how much five types of scenarios, always the same, differ.
        is_adaptive: The second half of votes goes to the closest pairs of the first.
        spammers: The chance that an expert answers at random.
        copies: How often each vote is counted.
        drift: By how much experts change their minds between first and last vote.
        controversial: Contestants about whom experts differ four times as much.
    """

    ratings: FloatArray = field(default_factory=paper_ratings)
    experts: int = 9
    scenarios: int = 50
    votes_per_expert: int = 200
    expert_sd: float = 0.0
    scenario_sd: float = 0.0
    cell_sd: float = 0.0
    threshold: float = 0.9
    threshold_sd: float = 0.3
    side: float = 0.0
    side_sd: float = 0.0
    is_heavy: bool = False
    uneven: float = 0.0
    uneven_scenarios: float = 0.0
    seldom: tuple[int, ...] = ()
    seen: int = 0
    camps: float = 0.0
    types: float = 0.0
    is_adaptive: bool = False
    spammers: float = 0.0
    copies: int = 1
    drift: float = 0.0
    controversial: tuple[int, ...] = ()

    def truth(self) -> FloatArray:
        """(C,) points."""
        size, rng = len(self.ratings), np.random.default_rng(99)
        drawn = _DRAWN if size < 12 else _DRAWN // 4
        low, high = np.triu_indices(size, 1)
        of_pairs = self._frequencies() * len(low)
        seen = self.ratings + self._draw_scenarios(rng, drawn) + self._draw_tastes(rng, drawn)
        seen += self.cell_sd * rng.normal(size=(drawn, size))
        threshold, side = self._draw_thresholds(rng, drawn), self._draw_sides(rng, drawn)
        at_random = rng.random(drawn) < self.spammers
        scores = np.empty(len(low))
        for pair, (one, other) in enumerate(zip(low, high, strict=True)):
            gap = seen[:, one] - seen[:, other]
            both = [
                expit((gap + way * side) / ELO_PER_LOGIT - threshold)
                - expit(-(gap + way * side) / ELO_PER_LOGIT - threshold)
                for way in (1.0, -1.0)
            ]
            score = 0.5 * (1.0 + np.mean(both, axis=0))
            scores[pair] = np.where(at_random, 0.5, score).mean()
        if not np.ptp(self.ratings) and not self.camps and not self.types:
            return np.full(size, 1000.0)
        return rate_scores(size, of_pairs, scores)

    def votes(self, rng: Generator) -> Comparisons:
        """A study: experts and scenarios are new ones each time."""
        size, numbers = len(self.ratings), self._draw_numbers(rng)
        expert = np.repeat(np.arange(self.experts), numbers)
        time = np.concatenate([np.arange(number) / max(number, 1) for number in numbers])
        of_scenarios = self._draw_scenarios(rng, self.scenarios)
        tastes = self._draw_tastes(rng, self.experts)
        of_cells = self.cell_sd * rng.normal(size=(self.experts, self.scenarios, size))
        turned = self.drift * rng.normal(size=(self.experts, size))
        threshold = self._draw_thresholds(rng, self.experts)
        side = self._draw_sides(rng, self.experts)
        at_random = rng.random(self.experts) < self.spammers
        scenario = self._draw_plan(rng, expert, numbers)
        low, high = np.triu_indices(size, 1)
        pair = rng.choice(len(low), len(expert), p=self._frequencies())

        def vote(rows: IntArray) -> FloatArray:
            e, s = expert[rows], scenario[rows]

            def see(who: IntArray) -> FloatArray:
                seen = self.ratings[who] + of_scenarios[s, who] + tastes[e, who]
                seen = seen + of_cells[e, s, who]
                return np.asarray(seen + (2.0 * time[rows] - 1.0) * turned[e, who])

            gap = (see(first[rows]) - see(second[rows]) + side[e]) / ELO_PER_LOGIT
            win, loss = expit(gap - threshold[e]), expit(-gap - threshold[e])
            win, loss = (np.where(at_random[e], 1 / 3, chance) for chance in (win, loss))
            dice = rng.random(len(rows))
            return np.where(dice < win, WIN, np.where(dice < win + loss, LOSS, TIE))

        is_turned = rng.random(len(expert)) < 0.5
        first, second = _turn(low[pair], high[pair], is_turned)
        score = np.empty(len(expert))
        batches = (0.0, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0) if self.is_adaptive else (0.0, 1.0)
        for begin, end in pairwise(batches):
            rows = np.flatnonzero((time >= begin) & (time < end))
            if begin:
                before = time < begin
                closest = _closest_pairs(size, first[before], second[before], score[before])
                chosen = rng.choice(closest, len(rows))
                first[rows], second[rows] = _turn(
                    low[chosen], high[chosen], rng.random(len(rows)) < 0.5
                )
            score[rows] = vote(rows)
        return Comparisons(
            names=tuple(f"c{number}" for number in range(size)),
            first=np.tile(first, self.copies),
            second=np.tile(second, self.copies),
            score=np.tile(score, self.copies),
            expert=np.tile(expert, self.copies),
            scenario=np.tile(scenario, self.copies),
        )

    def _frequencies(self) -> FloatArray:
        """(P,) of pairs among votes."""
        weight = np.ones(len(self.ratings))
        weight[list(self.seldom)] = 0.05
        low, high = np.triu_indices(len(weight), 1)
        return np.asarray(weight[low] * weight[high] / (weight[low] * weight[high]).sum())

    def _draw_numbers(self, rng: Generator) -> IntArray:
        """(E,) votes of each expert."""
        if not self.uneven:
            return np.full(self.experts, self.votes_per_expert)
        drawn = rng.lognormal(0.0, self.uneven, self.experts)
        votes = drawn / drawn.sum() * self.votes_per_expert * self.experts
        return np.asarray(np.maximum(10, np.round(votes)), dtype=np.int64)

    def _draw_plan(self, rng: Generator, expert: IntArray, numbers: IntArray) -> IntArray:
        """(R,) the scenario of each vote."""
        if self.seen:
            allowed = [rng.permutation(self.scenarios)[: self.seen] for _ in numbers]
            return np.asarray(np.array(allowed)[expert, rng.integers(0, self.seen, len(expert))])
        if self.uneven_scenarios:
            size = rng.lognormal(0.0, self.uneven_scenarios, self.scenarios)
            return np.asarray(rng.choice(self.scenarios, len(expert), p=size / size.sum()))
        return np.concatenate([rng.permutation(np.arange(n) % self.scenarios) for n in numbers])

    def _draw_scenarios(self, rng: Generator, number: int) -> FloatArray:
        """(N, C) effects."""
        shape = number, len(self.ratings)
        drawn = rng.exponential(1.0, shape) - 1.0 if self.is_heavy else rng.normal(size=shape)
        return self.scenario_sd * drawn + self.types * _patterns(shape[1])[np.arange(number) % 5]

    def _draw_tastes(self, rng: Generator, number: int) -> FloatArray:
        """(N, C) effects."""
        shape = number, len(self.ratings)
        drawn = rng.normal(size=shape)
        if self.is_heavy:
            drawn = rng.standard_t(3, shape) / np.sqrt(3.0)
        drawn[:, list(self.controversial)] *= 4.0
        camp = np.where(rng.random(number) < 0.5, 1.0, -1.0)[:, None]
        return np.asarray(self.expert_sd * drawn + self.camps * camp * _patterns(shape[1])[-1])

    def _draw_thresholds(self, rng: Generator, number: int) -> FloatArray:
        return np.maximum(0.05, self.threshold + self.threshold_sd * rng.normal(size=number))

    def _draw_sides(self, rng: Generator, number: int) -> FloatArray:
        return np.asarray(self.side + self.side_sd * rng.normal(size=number))


def _patterns(contestants: int) -> FloatArray:
    """(6, C) what types of scenarios, and at last camps, prefer; always the same."""
    drawn = np.random.default_rng(77).normal(size=(_TYPES + 1, contestants))
    return np.asarray(drawn - drawn.mean(axis=1, keepdims=True))


def _turn(low: IntArray, high: IntArray, is_turned: BoolArray) -> tuple[IntArray, IntArray]:
    return np.where(is_turned, high, low), np.where(is_turned, low, high)


def _closest_pairs(size: int, first: IntArray, second: IntArray, score: FloatArray) -> IntArray:
    """Return the six pairs whose mean scores are closest."""
    scored = np.bincount(first, score, size) + np.bincount(second, 1.0 - score, size)
    share = scored / np.maximum(np.bincount(np.concatenate([first, second]), minlength=size), 1)
    low, high = np.triu_indices(size, 1)
    return np.asarray(np.argsort(np.abs(share[low] - share[high]))[:6])


def _with(**more: object) -> OddWorld:
    return OddWorld(**{"expert_sd": 40.0, "scenario_sd": 60.0} | more)  # type: ignore[arg-type]


_PAPER = paper_ratings()
ODD_WORLDS = {
    "3 experts, independent": OddWorld(experts=3),
    "3 experts, tastes of 300": OddWorld(experts=3, votes_per_expert=480, expert_sd=300.0),
    "2 scenarios, 5 experts": _with(
        experts=5, scenarios=2, votes_per_expert=100, scenario_sd=100.0
    ),
    "one expert": OddWorld(experts=1, votes_per_expert=400, scenario_sd=60.0),
    "2 contestants, 5 experts": _with(
        ratings=np.array([1030.0, 970.0]), experts=5, votes_per_expert=60, scenario_sd=80.0
    ),
    "30 contestants": _with(
        ratings=1000.0 + 40.0 * np.linspace(-1.7, 1.7, 30), votes_per_expert=400
    ),
    "uneven scenarios": OddWorld(uneven_scenarios=1.2, expert_sd=30.0, scenario_sd=100.0),
    "uneven experts": OddWorld(uneven=1.5, expert_sd=60.0, scenario_sd=60.0),
    "two newcomers with 5 % of the votes": _with(seldom=(3, 8), votes_per_expert=400),
    "8 of 50 scenarios an expert": _with(seen=8, scenario_sd=80.0),
    "one wins 95 %": _with(
        ratings=np.array([1500.0, 1030, 1015, 1005, 1000, 995, 985, 970, 950]),
        threshold=0.3,
        threshold_sd=0.1,
    ),
    "62 % ties": _with(threshold=1.55),
    "side habits of 80": OddWorld(side=30.0, side_sd=80.0, expert_sd=30.0, scenario_sd=50.0),
    "five fixed types": OddWorld(types=100.0, scenario_sd=40.0, expert_sd=30.0),
    "experts differ by scenario": OddWorld(cell_sd=100.0, expert_sd=30.0, scenario_sd=50.0),
    "two camps of 8 experts": OddWorld(experts=8, camps=60.0, expert_sd=20.0),
    "closest pairs, effects": _with(is_adaptive=True),
    "closest pairs, independent": OddWorld(is_adaptive=True),
    "every vote twice": OddWorld(copies=2),
    "heavy tails": OddWorld(expert_sd=60.0, scenario_sd=100.0, is_heavy=True),
    "drift of 80": OddWorld(drift=80.0, expert_sd=40.0),
    "a fifth spammers, far apart": _with(ratings=1000.0 + 3.0 * (_PAPER - 1000.0), spammers=0.2),
    "one controversial, 3 experts": _with(controversial=(4,), experts=3),
    "one controversial, 9 experts": _with(controversial=(4,)),
    "one controversial, 20 experts": _with(controversial=(4,), experts=20),
}
"""By what is odd about them."""
