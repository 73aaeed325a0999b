"""Rules of a rating: method, clusters, kind of intervals, number of rounds, seed."""

from dataclasses import dataclass
from enum import StrEnum

FEWEST_DRAWS, MOST_DRAWS = 100, 100_000
"""Rounds that may be asked for; of fewer, what 95 % of them say is chance."""
ROUNDS, BOOTSTRAP_ROUNDS = 10_000, 4000
"""Where nobody says how many: of single votes, and of random effects, by which ends of intervals
move by one percent of the width from seed to seed."""
ROUNDS_OF_MANY, MANY_VOTES, MANY_CONTESTANTS = 1000, 500_000, 100
"""Above so many votes or, but for the closed form, contestants a round takes long."""


class Method(StrEnum):
    """Method that turns votes into ratings."""

    BRADLEY_TERRY = "bt"
    DAVIDSON = "davidson"
    ELO = "elo"


class Unit(StrEnum):
    """Cluster of dependent votes."""

    VOTE = "vote"
    SCENARIO = "scenario"
    EXPERT = "expert"
    TWO_WAY = "two-way"

    @property
    def kinds(self) -> tuple[str, ...]:
        """The arrays of votes by which they are clustered."""
        return {"vote": (), "two-way": ("expert", "scenario")}.get(self.value, (self.value,))


class Intervals(StrEnum):
    """Kind of intervals: by random effects of clusters, a closed form, or resampled votes."""

    BOOTSTRAP = "bootstrap"
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
"""What votes are clustered by, by the unit's value, in the same places."""

MOST_CONTESTANTS = 2000
"""Covariances of all pairs are kept as matrices; more contestants are refused."""


class TooManyContestants(ValueError):
    """More contestants than `MOST_CONTESTANTS`; the text says so."""


def usual_rounds(intervals: Intervals, *, contestants: int = 0, votes: int = 0) -> int:
    """Return the number of rounds where nobody says how many."""
    is_slow = intervals is not Intervals.CLOSED_FORM and contestants > MANY_CONTESTANTS
    if is_slow or votes > MANY_VOTES:
        return ROUNDS_OF_MANY
    return BOOTSTRAP_ROUNDS if intervals is Intervals.BOOTSTRAP else ROUNDS


def text_of_intervals(intervals: str, unit: str, rounds: int) -> str:
    """Say how intervals came about, for files and pages; earlier ones resampled clusters too."""
    names = UNIT_TEXTS[unit]
    if intervals == Intervals.BOOTSTRAP.value:
        return f"bootstrap 95 % intervals, {rounds:,} rounds, clustered by {names}"
    if intervals == Intervals.CLOSED_FORM.value:
        return f"95 % intervals in closed form, clustered by {names}"
    return f"95 % intervals by {rounds} resamples of {names}"


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
    method: Method,
    unit: Unit | None,
    intervals: Intervals | None,
    *,
    rounds: int | None,
    seed: int,
    **numbers: int,
) -> Rules:
    """Fill in what is left open; numbers are those of `usual_rounds`.

    Raises:
        ValueError: The choices do not go together; the text says what does.
    """
    unit = unit or (Unit.VOTE if method is Method.ELO else Unit.TWO_WAY)
    # By effects of clusters where votes have some; single votes are resampled as in the paper.
    is_resampled = method is Method.ELO or unit is Unit.VOTE
    intervals = intervals or (Intervals.RESAMPLES if is_resampled else Intervals.BOOTSTRAP)
    if rounds is None:
        rounds = usual_rounds(intervals, **numbers)
    refusals = {
        f"a bootstrap needs at least 1 round, not {rounds}": rounds < 1,
        f"online Elo resamples single votes only, not by {unit}": method is Method.ELO
        and unit is not Unit.VOTE,
        "online Elo has resamples of single votes only": method is Method.ELO
        and intervals is not Intervals.RESAMPLES,
        f"resamples are of single votes, not of {UNIT_TEXTS[unit]}": unit is not Unit.VOTE
        and intervals is Intervals.RESAMPLES,
        "single votes have no effects to draw: resamples, or a closed form": unit is Unit.VOTE
        and intervals is Intervals.BOOTSTRAP,
    }
    for sentence, is_refused in refusals.items():
        if is_refused:
            raise ValueError(sentence)
    return Rules(method=method, unit=unit, intervals=intervals, rounds=rounds, seed=seed)
