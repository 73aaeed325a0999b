"""Simulated studies whose truth is known: the product's plan, experts and scenarios that differ.

Experts and scenarios may differ in what they make of each contestant: normal effects with a
standard deviation in Elo points. Every expert has a threshold of their own for calling two equal
(Rao and Kupper 1967). The truth is what infinitely many votes of new experts on new scenarios
would be rated.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from arena.pairing.plan import Entry, PlanRules, plan
from arena.rating import bradley_terry
from arena.rating.bradley_terry import ELO_PER_LOGIT
from arena.rating.comparisons import LOSS, TIE, WIN, Comparisons, FloatArray, IntArray

PAPER = Path(__file__).parents[1] / "rating" / "paper_table.json"
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

    `controversial` contestants are those about whom experts differ four times as much.
    """

    ratings: FloatArray
    scenario_sd: float = 0.0
    expert_sd: float = 0.0
    experts: int = 9
    votes_per_expert: int = 640
    controversial: tuple[int, ...] = ()

    @property
    def expert_sds(self) -> FloatArray:
        """(C,) points."""
        found = np.full(len(self.ratings), float(self.expert_sd))
        found[list(self.controversial)] *= 4.0
        return found

    def truth(self, thresholds: FloatArray = THRESHOLDS) -> FloatArray:
        """(C,) what infinitely many votes of this world would be rated, if these thresholds
        were alike frequent among experts."""
        win, loss, weights = self._chances_of_pairs(thresholds)
        scores = (0.5 * (1.0 + win - loss)).mean(axis=0) @ weights
        low, high = np.triu_indices(len(self.ratings), 1)
        fitted = bradley_terry.fit(
            contestants=len(self.ratings),
            low=low,
            high=high,
            games=np.ones((1, len(low))),
            scores=scores[None],
        )
        return bradley_terry.to_elo(fitted[0])

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
        self, thresholds: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(T, P, N) of T thresholds and N sizes of effects that the first wins, and loses; and
        (N,) how likely these sizes are."""
        strengths = self.ratings / ELO_PER_LOGIT
        low, high = np.triu_indices(len(strengths), 1)
        variance = self.scenario_sd**2 + self.expert_sds**2
        spread = np.sqrt(variance[low] + variance[high])[:, None] / ELO_PER_LOGIT
        nodes, weights = np.polynomial.hermite_e.hermegauss(60)
        gaps = (strengths[low] - strengths[high])[:, None] + spread * nodes
        win, loss = _chances(gaps[None], thresholds[:, None, None])
        return win, loss, weights / weights.sum()

    def votes(self, rng: np.random.Generator) -> Comparisons:
        """A study: experts and scenarios are new ones each time."""
        contestants = len(self.ratings)
        number = int(rng.integers(PLANS))
        planned = _planned(contestants, self.experts, self.votes_per_expert, number)
        expert, scenario = planned[:2]
        first, second = rng.permutation(contestants)[planned[2:]]
        of_scenarios = rng.normal(0.0, 1.0, (SCENARIOS, contestants)) * self.scenario_sd
        of_experts = rng.normal(0.0, 1.0, (self.experts, contestants)) * self.expert_sds
        seen = self.ratings + of_scenarios[scenario] + of_experts[expert]
        rows = np.arange(len(expert))
        gap = (seen[rows, first] - seen[rows, second]) / ELO_PER_LOGIT
        threshold = THRESHOLDS[rng.integers(0, len(THRESHOLDS), self.experts)][expert]
        win, loss = _chances(gap, threshold)
        drawn = rng.random(len(rows))
        return Comparisons(
            names=tuple(f"c{index}" for index in range(contestants)),
            first=first,
            second=second,
            score=np.where(drawn < win, WIN, np.where(drawn < 1.0 - loss, TIE, LOSS)),
            expert=expert.copy(),
            scenario=scenario.copy(),
        )


def _chances(gap: FloatArray, threshold: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The chances that the first wins and loses; the rest are ties."""
    win, loss = 1.0 / (1.0 + threshold * np.exp(-gap)), 1.0 / (1.0 + threshold * np.exp(gap))
    return win, loss


@cache
def _planned(contestants: int, experts: int, votes: int, number: int) -> IntArray:
    """(4, V) expert, scenario, left and right of every planned vote."""
    names = [f"{index:02d}" for index in range(max(contestants, experts, SCENARIOS))]
    entries = tuple(
        Entry(scenario=scenario, contestant=one, picture=f"{scenario} {one}")
        for scenario in names[:SCENARIOS]
        for one in names[:contestants]
    )
    rules = PlanRules(
        entries=entries, experts=tuple(names[:experts]), votes_per_expert=votes, seed=number
    )
    rows = [
        (int(one.expert), int(one.scenario), int(one.left), int(one.right))
        for one in plan(rules).matchups
    ]
    return np.array(rows, dtype=np.int64).T
