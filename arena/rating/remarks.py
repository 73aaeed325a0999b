"""What to say with ratings: why intervals are missing, and what to keep in mind."""

from __future__ import annotations

import numpy as np

from arena.rating import elo, sandwich
from arena.rating.bootstrap import Unit
from arena.rating.chains import few_of
from arena.rating.comparisons import Comparisons, FloatArray, IntArray, renumber_codes
from arena.rating.rules import Intervals, Rules

FEWEST = {"expert": 5, "scenario": 10}
"""A table that rests on fewer says so: docs/rating.md."""


def _clusters(votes: Comparisons, unit: Unit) -> dict[str, int]:
    """How many of what is drawn there are."""
    numbers = {}
    if unit in (Unit.EXPERT, Unit.TWO_WAY):
        numbers["expert"] = len(renumber_codes(votes.expert)[0])
    if unit in (Unit.SCENARIO, Unit.TWO_WAY):
        numbers["scenario"] = len(renumber_codes(votes.scenario)[0])
    return numbers


def few_clusters(votes: Comparisons, unit: Unit) -> int | None:
    """The smaller number of clusters where that is few; one alone can't vary and is left out."""
    numbers = [number for number in _clusters(votes, unit).values() if number > 1]
    smallest = min(numbers, default=sandwich.FEW_CLUSTERS)
    return smallest if smallest < sandwich.FEW_CLUSTERS else None


def why_no_interval(names: tuple[str, ...], rules: Rules, *, lost: int) -> str:
    """Why nobody of a part has a bound.

    Args:
        names: Of the part.
        rules: How it was rated.
        lost: Rounds that did not determine everybody.
    """
    named = ", ".join(few_of(names))
    if rules.intervals is not Intervals.RESAMPLES:
        return (
            f"Among {named} no intervals can be given: there are too few votes, or "
            "hardly any against some contestant."
        )
    return (
        f"Among {named} the votes determined no ratings in {lost} of {rules.rounds} "
        "resamples, so intervals can't be given: there are too few votes, or hardly any against "
        "some contestant."
    )


def why_no_spread(rules: Rules) -> str:
    """Why the votes leave no width for an interval."""
    if rules.intervals is Intervals.RESAMPLES:
        return _ALL_THE_SAME[rules.unit]
    return (
        "The votes do not vary between what they are clustered by, so intervals can't be given: "
        "there is too little that could have come out otherwise."
    )


def notes_on_bounds(lower: FloatArray, upper: FloatArray, rank: IntArray) -> tuple[str, ...]:
    """(C,) which bounds or ranks are missing and why; bounds NaN and ranks 0 are missing."""
    return tuple(
        _MISSING[no_lower, no_upper, no_rank]
        for no_lower, no_upper, no_rank in zip(
            np.isnan(lower).tolist(), np.isnan(upper).tolist(), (rank == 0).tolist(), strict=True
        )
    )


def why_too_few(votes: Comparisons, unit: Unit, notes: tuple[str, ...]) -> tuple[str, ...]:
    """Say what is too few where neither bound is known: votes, experts or scenarios.

    Args:
        votes: Of the contestants (C,).
        unit: What hangs together.
        notes: (C,) as `notes_on_bounds` gives them.
    """
    codes = {"expert": votes.expert, "scenario": votes.scenario}
    wanted = {Unit.EXPERT: ("expert",), Unit.SCENARIO: ("scenario",), Unit.VOTE: ()}
    kinds = wanted.get(unit, ("expert", "scenario"))
    found = list(notes)
    for place, note in enumerate(notes):
        if note != TOO_FEW:
            continue
        own = (votes.first == place) | (votes.second == place)
        numbers = {kind: len(np.unique(codes[kind][own])) for kind in kinds}
        kind = min(numbers, key=numbers.__getitem__, default="")
        if kind and numbers[kind] < _FEWEST_CLUSTERS:
            many = f"only {numbers[kind]} {kind}s" if numbers[kind] > 1 else f"one {kind}"
            prefix = "of" if kind == "expert" else "on"
            found[place] = f"no interval and no rank: all votes are {prefix} {many}"
    return tuple(found)


_FEWEST_CLUSTERS = 6
"""Six independent comparisons are the fewest that tell two apart."""


def who_is_open(names: tuple[str, ...], notes: tuple[str, ...]) -> tuple[str, ...]:
    """That some lack bounds, and who; nothing if nobody does."""
    lacking = tuple(name for name, note in zip(names, notes, strict=True) if note)
    if not lacking:
        return ()
    rest = "; the others' intervals do not rest on them" if len(lacking) < len(names) else ""
    return (
        f"The votes set no two bounds for {', '.join(few_of(lacking))}: too few votes, or hardly "
        f"any score on one side. The lines say what is missing{rest}.",
    )


def warnings(votes: Comparisons, *, rules: Rules, rounds: int, degenerate: int) -> tuple[str, ...]:
    """What to keep in mind with intervals by these rules."""
    said: list[str] = []
    unit = rules.unit
    clusters = _clusters(votes, unit)
    few = False
    for kind, number in _clusters(votes, Unit.TWO_WAY).items():
        is_drawn = kind in clusters and rules.intervals is Intervals.RESAMPLES
        limit = sandwich.FEW_CLUSTERS if is_drawn else FEWEST[kind]
        if number == 1 and kind in clusters:
            said.append(_ONLY_ONE[kind])
        elif 1 < number < limit:
            said.append(
                f"Only {number} {kind}s: intervals that rest on fewer than {limit} of them are "
                "rough."
            )
            few = few or is_drawn
    if few:
        said.append(_WIDENED[unit])
    if degenerate and rules.intervals is Intervals.RESAMPLES:
        said.append(
            f"In {degenerate} of {rounds} resamples the votes did not determine everybody's "
            "rating; there it counts as far above or below the others, as the votes say."
        )
    return tuple(said)


ELO_NOTE = elo.INTERVAL_NOTE

NO_DAVIDSON = (
    "Davidson's model has no finite ratings for these votes: some score one way by ties only. "
    "Bradley-Terry rates them."
)

NOT_ADJUSTED = (
    "The votes do not determine what was to be adjusted for: it is the same in all votes, or "
    "says no more than who was shown. The ratings stand without it."
)

_ALL_THE_SAME = {
    Unit.VOTE: (
        "Every resample by vote gave the same ratings, so intervals can't be given: there is too "
        "little that could have come out otherwise."
    ),
    Unit.EXPERT: (
        "Every resample by expert gave the same ratings, so intervals can't be given: there is "
        "too little that could have come out otherwise."
    ),
    Unit.SCENARIO: (
        "Every resample by scenario gave the same ratings, so intervals can't be given: there is "
        "too little that could have come out otherwise."
    ),
    Unit.TWO_WAY: (
        "Every resample by expert and scenario gave the same ratings, so intervals can't be "
        "given: there is too little that could have come out otherwise."
    ),
}


def note_with_rank(note: str, rank: int | None) -> str:
    """The note of a line whose rank over all parts is decided, or None, unlike within its part."""
    if rank is None:
        return _UNRANKED.get(note, note or _NO_RANK_ACROSS)
    return _RANKED.get(note, note)


NO_SPREAD = "no interval and no rank: the votes leave no spread"
ONLY_TIES = "no interval and no rank: every vote is a tie"
TOO_FEW = "no interval and no rank: too few votes"
NOT_RATED = "no rating by this model"
_NO_RANK_ACROSS = "no rank: too few votes against those above"

_UNRANKED: dict[str, str] = {
    "no upper limit": "no upper limit; no rank: too few votes say that it is above",
    "no lower limit": "no lower limit; no rank: too few votes say that it is below",
    "no limits among equals": "no limits among equals; no rank",
}
"""Notes of those without a rating, where the votes decide no rank either."""

_MISSING: dict[tuple[bool, bool, bool], str] = {
    (False, False, False): "",
    (True, False, False): "no lower bound: hardly any score",
    (False, True, False): "no upper bound: hardly anybody scored",
    (True, False, True): (
        "no lower bound: hardly any score; no rank, because the upper bound tells it from nobody"
    ),
    (False, True, True): (
        "no upper bound: hardly anybody scored; no rank, because the lower bound is not above "
        "the average"
    ),
    (True, True, True): TOO_FEW,
}
"""By whether the lower bound, the upper bound and the rank are missing."""

_RANKED = {
    str(_MISSING[lower, upper, True]): _MISSING[lower, upper, False]
    for lower, upper in ((True, False), (False, True))
}

_ONLY_ONE = {
    "expert": (
        "All votes belong to one expert: how much experts differ can't be seen, and the "
        "intervals hold for this expert only."
    ),
    "scenario": (
        "All votes belong to one scenario: how much scenarios differ can't be seen, and the "
        "intervals hold for this scenario only."
    ),
}

_BY_T = "Such intervals are widened by Student's t."

_WIDENED = {
    Unit.EXPERT: _BY_T,
    Unit.SCENARIO: _BY_T,
    Unit.TWO_WAY: (
        "Drawing both ways is too wide where votes are independent and too narrow where few "
        "experts differ much; intervals in closed form are neither."
    ),
}
