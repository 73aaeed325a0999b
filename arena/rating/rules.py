"""Rules of a rating: method, clusters, kind of intervals, number of rounds, seed."""

from dataclasses import dataclass
from enum import StrEnum

FEWEST_DRAWS, MOST_DRAWS = 100, 100_000
"""Rounds that may be asked for; of fewer, what 95 % of them say is chance."""


class Method(StrEnum):
    """Method that turns votes into ratings."""

    BRADLEY_TERRY = "bt"
    DAVIDSON = "davidson"
    ELO = "elo"


class Unit(StrEnum):
    """Cluster of dependent votes, and unit of the bootstrap."""

    VOTE = "vote"
    SCENARIO = "scenario"
    EXPERT = "expert"
    TWO_WAY = "two-way"

    @property
    def kinds(self) -> tuple[str, ...]:
        """The arrays of votes by which they are clustered."""
        return {"vote": (), "two-way": ("expert", "scenario")}.get(self.value, (self.value,))


class Intervals(StrEnum):
    """Kind of intervals: a closed form, or percentiles of resampled rounds."""

    CLOSED_FORM = "closed"
    RESAMPLES = "resamples"


METHOD_TEXTS = {
    "bt": "Bradley-Terry on the Elo scale",
    "davidson": "Davidson's tie model on the Elo scale",
    "elo": "online Elo, median over resamples",
}
"""What a method is called in files and on a terminal, by its value."""

UNIT_TEXTS = {
    "vote": "votes",
    "scenario": "scenarios",
    "expert": "experts",
    "two-way": "experts and scenarios",
}
"""What is drawn anew, by the unit's value, in the same places."""

MOST_CONTESTANTS = 2000
"""Covariances of all pairs are kept as matrices; more contestants are refused."""


class TooManyContestants(ValueError):
    """More contestants than `MOST_CONTESTANTS`; the text says so."""


def default_intervals(method: Method, unit: Unit) -> Intervals:
    """In closed form wherever votes are clustered; single votes are resampled as in the paper."""
    if method is Method.ELO or unit is Unit.VOTE:
        return Intervals.RESAMPLES
    return Intervals.CLOSED_FORM


def unit_for(*, judges: bool, items: bool) -> Unit:
    """Return the clusters of votes of which judges, items or both are known."""
    if judges and items:
        return Unit.TWO_WAY
    if judges:
        return Unit.EXPERT
    return Unit.SCENARIO if items else Unit.VOTE


@dataclass(frozen=True, slots=True, kw_only=True)
class Rules:
    """Rules of a rating; the fields are those of `leaderboard.rate`."""

    method: Method
    unit: Unit
    intervals: Intervals
    rounds: int
    seed: int
    founders: frozenset[str] = frozenset()


def choose_rules(
    method: Method, unit: Unit | None, intervals: Intervals | None, *, rounds: int, seed: int
) -> Rules:
    """Fill in what is left open.

    Raises:
        ValueError: The choices do not go together; the text says what does.
    """
    unit = unit or (Unit.VOTE if method is Method.ELO else Unit.TWO_WAY)
    intervals = intervals or default_intervals(method, unit)
    refusals = {
        f"a bootstrap needs at least 1 round, not {rounds}": rounds < 1,
        f"online Elo resamples single votes only, not by {unit}": method is Method.ELO
        and unit is not Unit.VOTE,
        "online Elo has no intervals in closed form, only resamples": method is Method.ELO
        and intervals is Intervals.CLOSED_FORM,
    }
    for sentence, is_refused in refusals.items():
        if is_refused:
            raise ValueError(sentence)
    return Rules(method=method, unit=unit, intervals=intervals, rounds=rounds, seed=seed)
