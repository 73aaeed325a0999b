"""Whether the rules of a plan can be met, and how many votes each pair gets where they say it."""

from __future__ import annotations

import numpy as np

from arena.errors import NothingToPlan
from arena.pairing.arrays import IntArray
from arena.pairing.rules import Grid, PlanRules
from arena.pairing.targets import votes_by_appearances

MOST_OVERLAP = 0.8
"""More can't be brought together where all pairs and scenarios stay balanced for everybody."""

MOST_CHECKS = 0.5
MOST_REPEATS = 0.5
MOST_ADAPTIVE = 0.9
ATTENTION_CHECKS = "attention checks"


def check_rules(rules: PlanRules, grid: Grid) -> None:
    """Whether the rules make sense.

    Raises:
        NothingToPlan: They do not; the text has the numbers.
    """
    if rules.seed < 0:
        raise NothingToPlan(f"The seed must be 0 or more, not {rules.seed}.")
    if rules.votes_per_expert < 1:
        raise NothingToPlan(f"Votes per expert must be 1 or more, not {rules.votes_per_expert}.")
    if not rules.experts:
        raise NothingToPlan("There is nobody to vote: name at least one expert.")
    if len(set(rules.experts)) < len(rules.experts):
        raise NothingToPlan("An expert is named twice.")
    if not grid.pairs:
        contestants = len({entry.contestant for entry in rules.entries})
        raise NothingToPlan(
            f"A comparison needs two contestants with pictures, not {contestants}."
        )
    _check_extras(rules, grid)
    units = int(grid.showable.sum())
    if units < rules.votes_per_expert:
        raise NothingToPlan(_too_few(rules, grid, units))


def pair_totals(rules: PlanRules, grid: Grid) -> IntArray:
    """Votes of every pair (P,) over all experts, where the rules say how often.

    Raises:
        NothingToPlan: The wanted numbers can't be met; the text has them.
    """
    experts, votes = len(rules.experts), len(rules.experts) * rules.votes_per_expert
    capacity = experts * grid.showable.sum(axis=1)
    totals = (
        _by_pair(rules, grid, votes)
        if rules.pair_votes
        else _by_contestant(rules, grid, votes, capacity)
    )
    for pair, wanted, most in zip(grid.pairs, totals, capacity, strict=True):
        if wanted > most:
            raise NothingToPlan(
                f"{pair[0]} against {pair[1]} is to get {int(wanted)} votes, but {experts} "
                f"experts on {int(most) // experts} scenarios can give {int(most)}."
            )
    return totals


# --- Private -----------------------------------------------------------------------------------


def _too_few(rules: PlanRules, grid: Grid, units: int) -> str:
    identical = f" (and {len(grid.identical)} with identical pictures)" if grid.identical else ""
    return (
        f"Nobody sees the same pair of a scenario twice: {len(grid.scenarios)} scenarios have "
        f"{units} different pairs to show{identical}, but each expert is to judge "
        f"{rules.votes_per_expert}."
    )


def check_share(part: str, share: float, most: float) -> None:
    """Do nothing for a share from 0 to the most that there can be.

    Raises:
        NothingToPlan: It is none.
    """
    if not 0 <= share <= most:
        raise NothingToPlan(f"The share of {part} goes from 0 to {most:.0%}, not {share:.1%}.")


def _check_shares(rules: PlanRules) -> None:
    check_share("repeats", rules.repeat_share, MOST_REPEATS)
    check_share("what two experts judge", rules.overlap_share, MOST_OVERLAP)
    check_share(ATTENTION_CHECKS, rules.check_share, MOST_CHECKS)
    check_share("the adaptive part", rules.adaptive_share, MOST_ADAPTIVE)
    if not 0.2 <= rules.uniform_share <= 1:
        raise NothingToPlan(
            "At least 20 % of the adaptive draws are uniform, else no vote could be "
            f"weighted; not {rules.uniform_share:.0%}."
        )


def _check_extras(rules: PlanRules, grid: Grid) -> None:
    _check_shares(rules)
    if rules.overlap_share and len(rules.experts) < 2:
        raise NothingToPlan("For pairs that two experts judge there must be two.")
    if rules.appearances and rules.pair_votes:
        raise NothingToPlan("Targets are given by contestant or by pair, not both.")
    if rules.adaptive_share and (rules.appearances or rules.pair_votes):
        raise NothingToPlan("Targets fix every vote, so none are left for an adaptive part.")
    places = [given.scenario for given in rules.checks]
    if set(places) - set(grid.scenarios) or len(set(places)) < len(places):
        raise NothingToPlan("Each check is on a scenario of its own out of those of the study.")


def _by_pair(rules: PlanRules, grid: Grid, votes: int) -> IntArray:
    totals = np.zeros(len(grid.pairs), dtype=np.int64)
    places = {pair: row for row, pair in enumerate(grid.pairs)}
    for first, second, wanted in rules.pair_votes:
        row = places.get((first, second), places.get((second, first)))
        if row is None:
            raise NothingToPlan(f"{first} against {second} is no pair of this study.")
        totals[row] += wanted
    if totals.sum() != votes:
        raise NothingToPlan(
            f"The targets add up to {totals.sum():,} votes, but the experts' quotas to {votes:,}."
        )
    return totals


def _by_contestant(rules: PlanRules, grid: Grid, votes: int, capacity: IntArray) -> IntArray:
    names = sorted({name for pair in grid.pairs for name in pair})
    wanted = dict(rules.appearances)
    if set(wanted) != set(names) or len(wanted) < len(rules.appearances):
        odd = tuple(sorted(set(wanted) ^ set(names))) or ("one is named twice",)
        raise NothingToPlan(f"Each contestant of the study needs one target: {', '.join(odd)}.")
    given = sum(wanted.values())
    if given != 2 * votes:
        raise NothingToPlan(
            f"The targets add up to {given:,} appearances, but the experts' quotas to "
            f"{2 * votes:,}."
        )
    most = np.zeros((len(names), len(names)), dtype=np.int64)
    rows, columns = np.triu_indices(len(names), 1)  # in the order of the pairs
    most[rows, columns] = most[columns, rows] = capacity
    sums = np.array([wanted[name] for name in names], dtype=np.int64)
    found: IntArray = votes_by_appearances(names, sums, most)[rows, columns]
    return found
