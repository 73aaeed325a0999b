"""Simulated studies whose truth is known: experts and scenarios that differ, several plans.

Experts and scenarios may differ in what they make of each contestant: normal effects with a
standard deviation in Elo points. Every expert has a threshold of their own for calling two equal
(Rao and Kupper 1967). The truth is what infinitely many votes of new experts on new scenarios
would be rated.

Plans: the product's (default); `uneven` experts, who judge a lognormal number of random units;
`handed_over`, the product's plan of which a fifth of the experts judge a random part and others
the rest.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from arena.pairing.plan import Entry, PlanRules, plan
from arena.rating.comparisons import LOSS, TIE, WIN, Comparisons, FloatArray, IntArray, PairCounts
from arena.rating.models import ELO_PER_LOGIT, Meetings, fit, to_elo
from arena.rating.side import side_bias

PAPER = Path(__file__).parents[1] / "tests" / "rating" / "paper_table.json"
SCENARIOS = 50
THRESHOLDS = np.exp(np.linspace(0.5, 1.5, 5))
"""Of experts, drawn evenly: two equals are called so in 24 to 63 % of votes, 45 % on average."""
PLANS = 4
"""Different plans for a size; contestants take turns in them."""


def paper_ratings() -> FloatArray:
    return np.array([row[2] for row in json.loads(PAPER.read_text())["rows"]], dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """What is true: ratings, and how much scenarios and experts differ, in Elo points.

    Attributes:
        spammers: The chance that an expert answers at random.
        uneven: The standard deviation of the logarithm of the votes of an expert.
        side, side_sd: What being on the left is worth on average, and by how much experts differ.
    """

    ratings: FloatArray
    scenario_sd: float = 0.0
    expert_sd: float = 0.0
    experts: int = 9
    votes_per_expert: int = 640
    scenarios: int = SCENARIOS
    spammers: float = 0.0
    uneven: float = 0.0
    handed_over: bool = False
    side: float = 0.0
    side_sd: float = 0.0

    def truth(self, thresholds: FloatArray = THRESHOLDS) -> FloatArray:
        """(C,) what infinitely many votes of this world would be rated, if these thresholds
        were alike frequent among experts.
        """
        win, loss, weights = self._chances_of_pairs(thresholds)
        scores = 0.5 * (1.0 + (1.0 - self.spammers) * (win - loss).mean(axis=0) @ weights)
        return rate_scores(len(self.ratings), np.ones(len(scores)), scores)

    def truth_of_side(self) -> float:
        """What the left side would be worth by infinitely many votes."""
        many, ends = 10.0**7, np.stack(np.triu_indices(len(self.ratings), 1))
        win, loss, weights = self._chances_of_pairs(THRESHOLDS, self.side)
        lost, won, _ = self._chances_of_pairs(THRESHOLDS, -self.side)
        won_left = np.concatenate([win.mean(axis=0) @ weights, won.mean(axis=0) @ weights])
        lost_left = np.concatenate([loss.mean(axis=0) @ weights, lost.mean(axis=0) @ weights])
        first, second = np.hstack([ends, ends[::-1]])
        shares = np.concatenate([won_left, 1.0 - won_left - lost_left, lost_left])
        nobody = np.zeros(len(shares), dtype=np.int64)
        votes = Comparisons(
            names=tuple(f"c{index}" for index in range(len(self.ratings))),
            first=np.tile(first, 3),
            second=np.tile(second, 3),
            score=np.repeat([WIN, TIE, LOSS], len(first)),
            expert=nobody,
            scenario=nobody.copy(),
            count=np.round(many * shares).astype(np.int64),
        )
        value = side_bias(votes).advantage.value
        assert value is not None
        return value

    def tie_share(self) -> float:
        """Of all votes, pairs alike frequent."""
        win, loss, weights = self._chances_of_pairs(THRESHOLDS)
        return float(((1.0 - win - loss).mean(axis=0) @ weights).mean())

    def shown_expert_sd(self) -> float:
        """Points by which experts differ about a contestant, as it shows in ratings.

        An expert who seldom calls two equal pulls them further apart than another one: where
        contestants differ, thresholds show as tastes do.
        """
        truth = self.truth()
        by_thresholds = [self.truth(one) - truth for one in np.split(THRESHOLDS, len(THRESHOLDS))]
        contestants = len(truth)
        of_thresholds = np.mean(np.square(by_thresholds)) * contestants / (contestants - 1)
        spread = float(np.ptp(self.ratings))
        pulled = float(np.ptp(truth)) / spread if spread else 1.0
        return float(np.hypot(pulled * self.expert_sd, np.sqrt(of_thresholds)))

    def _chances_of_pairs(
        self, thresholds: FloatArray, side: float = 0.0
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(T, P, N) of T thresholds and N sizes of effects that the first wins, and loses; and
        (N,) how likely these sizes are.
        """
        strengths = self.ratings / ELO_PER_LOGIT
        low, high = np.triu_indices(len(strengths), 1)
        variance = 2.0 * (self.scenario_sd**2 + self.expert_sd**2) + self.side_sd**2
        spread = np.sqrt(variance) / ELO_PER_LOGIT
        nodes, weights = np.polynomial.hermite_e.hermegauss(60)
        gaps = (strengths[low] - strengths[high])[:, None] + side / ELO_PER_LOGIT + spread * nodes
        win, loss = chances(gaps[None], thresholds[:, None, None])
        return win, loss, weights / weights.sum()

    def votes(self, rng: np.random.Generator) -> Comparisons:
        """A study: experts and scenarios are new ones each time."""
        return self.with_repeats(rng, 0.0)[0]

    def with_repeats(
        self, rng: np.random.Generator, share: float
    ) -> tuple[Comparisons, IntArray, FloatArray]:
        """A study, a share of every expert's votes (R,) that is shown again, and (R,) what their
        first contestants score then.
        """
        panel = _Panel(self, rng)
        expert, scenario, first, second = self._planned(rng)
        if self.uneven and (self.side or self.side_sd):  # a plan shows pairs either way round
            is_turned = rng.random(len(first)) < 0.5
            first, second = np.where(is_turned, second, first), np.where(is_turned, first, second)
        score = panel.scores(expert, scenario, first, second, rng)
        own = [np.flatnonzero(expert == one) for one in range(self.experts)] if share else []
        rows = [rng.permutation(some)[: round(share * len(some))] for some in own]
        repeated = np.concatenate(rows) if rows else np.empty(0, dtype=np.int64)
        planned = np.stack([expert, scenario, first, second])[:, repeated]
        again = panel.scores(planned[0], planned[1], planned[2], planned[3], rng)
        votes = Comparisons(
            names=tuple(f"c{index}" for index in range(len(self.ratings))),
            first=first,
            second=second,
            score=score,
            expert=expert.copy(),
            scenario=scenario.copy(),
        )
        return votes, repeated, again

    def _planned(self, rng: np.random.Generator) -> IntArray:
        """(4, V) expert, scenario, first and second contestant of every vote."""
        contestants = len(self.ratings)
        if self.uneven:
            return self._uneven_votes(rng)
        number = int(rng.integers(PLANS))
        planned = _plan(contestants, self.experts, self.votes_per_expert, self.scenarios, number)
        expert = planned[0]
        if self.handed_over:
            expert = _handed_over(planned, self.experts, rng)
        return np.stack([expert, planned[1], *rng.permutation(contestants)[planned[2:]]])

    def _uneven_votes(self, rng: np.random.Generator) -> IntArray:
        low, high = np.triu_indices(len(self.ratings), 1)
        units = len(low) * self.scenarios
        size = rng.lognormal(-0.5 * self.uneven**2, self.uneven, self.experts)
        votes = np.clip(size * self.votes_per_expert, 1, units).astype(int)
        unit = np.concatenate([rng.permutation(units)[:number] for number in votes])
        expert = np.repeat(np.arange(self.experts), votes)
        return np.stack(
            [expert, unit % self.scenarios, *np.stack([low, high])[:, unit // self.scenarios]]
        )


class _Panel:
    """The experts and scenarios of one study: effects in points, thresholds, who answers at
    random.
    """

    def __init__(self, world: World, rng: np.random.Generator) -> None:
        contestants = len(world.ratings)
        of_scenarios = rng.normal(0.0, 1.0, (world.scenarios, contestants)) * world.scenario_sd
        of_experts = rng.normal(0.0, 1.0, (world.experts, contestants)) * world.expert_sd
        self.seen = world.ratings + of_scenarios[:, None] + of_experts
        self.threshold = THRESHOLDS[rng.integers(0, len(THRESHOLDS), world.experts)]
        self.side = np.full(world.experts, float(world.side))
        if world.side_sd:
            self.side += rng.normal(0.0, world.side_sd, world.experts)
        self.is_spammer = rng.random(world.experts) < world.spammers

    def scores(
        self,
        expert: IntArray,
        scenario: IntArray,
        first: IntArray,
        second: IntArray,
        rng: np.random.Generator,
    ) -> FloatArray:
        """(V,) what the first contestants score."""
        seen = self.seen[scenario, expert]
        rows = np.arange(len(expert))
        gap = (seen[rows, first] - seen[rows, second] + self.side[expert]) / ELO_PER_LOGIT
        win, loss = chances(gap, self.threshold[expert])
        at_random = self.is_spammer[expert]
        win, loss = np.where(at_random, 1 / 3, win), np.where(at_random, 1 / 3, loss)
        drawn = rng.random(len(rows))
        return np.where(drawn < win, WIN, np.where(drawn < 1.0 - loss, TIE, LOSS))


def _handed_over(planned: IntArray, experts: int, rng: np.random.Generator) -> IntArray:
    """(V,) the experts when a fifth of them leave; nobody gets a unit twice."""
    expert: IntArray = planned[0].copy()
    low, high = np.sort(planned[2:], axis=0)
    units = (planned[1] * 1000 + low) * 1000 + high
    known = [set(units[expert == one].tolist()) for one in range(experts)]
    leaving = rng.permutation(experts)[: max(1, round(experts / 5))]
    staying = np.setdiff1d(np.arange(experts), leaving)
    for one in leaving.tolist():
        places = np.flatnonzero(expert == one)
        for place in places[int(rng.uniform(0.1, 0.6) * len(places)) :].tolist():
            takers = [name for name in staying.tolist() if units[place] not in known[name]]
            if takers:
                expert[place] = takers[int(rng.integers(len(takers)))]
                known[expert[place]].add(int(units[place]))
    return expert


def rate_scores(contestants: int, games: FloatArray, scores: FloatArray) -> FloatArray:
    """(C,) points by so many games (P,) of each pair, and the mean scores (P,) in them."""
    low, high = np.triu_indices(contestants, 1)
    nobody = np.empty(0, dtype=np.int64)
    outcomes = np.tile([1, 0, 0], (len(low), 1))
    pairs = PairCounts(low=low, high=high, outcomes=outcomes, pair_of=nobody, outcome_of=nobody)
    scored = games * scores
    return to_elo(fit(Meetings(contestants, pairs), games[:, None], scored[:, None])[:, 0])


def chances(gap: FloatArray, threshold: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The chances that the first wins and loses; the rest are ties."""
    win, loss = 1.0 / (1.0 + threshold * np.exp(-gap)), 1.0 / (1.0 + threshold * np.exp(gap))
    return win, loss


def _entries(contestants: int, scenarios: int) -> tuple[Entry, ...]:
    return tuple(
        Entry(scenario=f"{scenario:02d}", contestant=f"{one:02d}", picture=f"{scenario} {one}")
        for scenario in range(scenarios)
        for one in range(contestants)
    )


@cache
def _plan(contestants: int, experts: int, votes: int, scenarios: int, number: int) -> IntArray:
    """(4, V) expert, scenario, left and right of every planned vote."""
    rules = PlanRules(
        entries=_entries(contestants, scenarios),
        experts=tuple(f"{expert:02d}" for expert in range(experts)),
        votes_per_expert=votes,
        seed=number,
    )
    rows = [
        (int(one.expert), int(one.scenario), int(one.left), int(one.right))
        for one in plan(rules).matchups
    ]
    return np.array(rows, dtype=np.int64).T
