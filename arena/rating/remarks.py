"""What to say with ratings: why intervals are missing, and what to keep in mind."""

import numpy as np

from arena.rating.chains import few_of
from arena.rating.comparisons import Comparisons, FloatArray, IntArray
from arena.rating.rules import Intervals, Rules, Unit
from arena.rating.sandwich import FEW_CLUSTERS

FEWEST = {"expert": 5, "scenario": 10}
"""A table that rests on fewer says so: docs/rating.md."""

ELO_NOTE = (
    "Online Elo follows the latest votes: its interval does not shrink with more votes, and the "
    "order of the votes matters."
)
NO_DAVIDSON = (
    "Davidson's model has no finite ratings for these votes: some score one way by ties only. "
    "Bradley-Terry rates them."
)
NOT_ADJUSTED = (
    "The votes do not determine what was to be adjusted for: it is the same in all votes, or "
    "says no more than who was shown. The ratings stand without it."
)


def few_clusters(votes: Comparisons, unit: Unit) -> int | None:
    """The smaller number of clusters where that is few; one alone can't vary and is left out."""
    numbers = [number for number in _clusters(votes, unit).values() if number > 1]
    smallest = min(numbers, default=FEW_CLUSTERS)
    return smallest if smallest < FEW_CLUSTERS else None


def why_no_interval(names: tuple[str, ...], rules: Rules, *, lost: int) -> str:
    """Why nobody of a part has a bound; `lost` rounds did not determine everybody."""
    named = ", ".join(few_of(names))
    if rules.intervals is Intervals.CLOSED_FORM:
        return (
            f"Among {named} no intervals can be given: there are too few votes, or hardly any "
            "against some contestant."
        )
    return (
        f"Among {named} the votes determined no ratings in {lost} of {rules.rounds} resamples, so "
        "intervals can't be given: there are too few votes, or hardly any against some contestant."
    )


def why_no_spread(rules: Rules) -> str:
    """Why the votes leave no width for an interval."""
    start = "The votes do not vary between what they are clustered by"
    if rules.intervals is Intervals.RESAMPLES:
        drawn = " and ".join(rules.unit.kinds) or "vote"
        start = f"Every resample by {drawn} gave the same ratings"
    return (
        f"{start}, so intervals can't be given: there is too little that could have come out "
        "otherwise."
    )


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
    found: list[str] = []
    is_resampled = rules.intervals is Intervals.RESAMPLES
    is_widened = False
    for kind, number in _clusters(votes, Unit.TWO_WAY).items():
        is_drawn = kind in rules.unit.kinds and is_resampled
        limit = FEW_CLUSTERS if is_drawn else FEWEST[kind]
        if number == 1 and kind in rules.unit.kinds:
            found.append(
                f"All votes belong to one {kind}: how much {kind}s differ can't be seen, and the "
                f"intervals hold for this {kind} only."
            )
        elif 1 < number < limit:
            found.append(
                f"Only {number} {kind}s: intervals that rest on fewer than {limit} of them are "
                "rough."
            )
            is_widened |= is_drawn
    if is_widened and rules.unit is Unit.TWO_WAY:
        found.append(
            "Drawing both ways is too wide where votes are independent and too narrow where few "
            "experts differ much; intervals in closed form are neither."
        )
    elif is_widened:
        found.append("Such intervals are widened by Student's t.")
    if degenerate and is_resampled:
        found.append(
            f"In {degenerate} of {rounds} resamples the votes did not determine everybody's "
            "rating; there it counts as far above or below the others, as the votes say."
        )
    return tuple(found)


def _clusters(votes: Comparisons, unit: Unit) -> dict[str, int]:
    return {kind: len(np.unique(getattr(votes, kind))) for kind in unit.kinds}


# --- Notes of single lines -----------------------------------------------------------------------


NO_SPREAD = "no interval and no rank: the votes leave no spread"
ONLY_TIES = "no interval and no rank: every vote is a tie"
TOO_FEW = "no interval and no rank: too few votes"
NOT_RATED = "no rating by this model"

_FEWEST_CLUSTERS = 6
"""Six independent comparisons are the fewest that tell two apart."""
_NO_LOWER = "no lower bound: hardly any score"
_NO_UPPER = "no upper bound: hardly anybody scored"

_MISSING: dict[tuple[bool, bool, bool], str] = {
    (False, False, False): "",
    (True, False, False): _NO_LOWER,
    (False, True, False): _NO_UPPER,
    (True, False, True): f"{_NO_LOWER}; no rank, because the upper bound tells it from nobody",
    (False, True, True): (
        f"{_NO_UPPER}; no rank, because the lower bound is not above the average"
    ),
    (True, True, True): TOO_FEW,
}
"""By whether the lower bound, the upper bound and the rank are missing."""

_UNRANKED = {
    "no upper limit": "no upper limit; no rank: too few votes say that it is above",
    "no lower limit": "no lower limit; no rank: too few votes say that it is below",
    "no limits among equals": "no limits among equals; no rank",
}
"""Notes of those without a rating, where the votes decide no rank either."""


def notes_on_bounds(
    votes: Comparisons, unit: Unit, lower: FloatArray, upper: FloatArray, rank: IntArray
) -> tuple[str, ...]:
    """(C,) which bounds or ranks are missing and why; bounds NaN and ranks 0 are missing.

    Where neither bound is known it is said what is too few: votes, experts or scenarios.
    """
    notes = []
    for place in range(len(rank)):
        is_missing = (bool(np.isnan(lower[place])), bool(np.isnan(upper[place])))
        note = _MISSING[*is_missing, bool(rank[place] == 0)]
        own = (votes.first == place) | (votes.second == place)
        numbers = {kind: len(np.unique(getattr(votes, kind)[own])) for kind in unit.kinds}
        kind = min(numbers, key=numbers.__getitem__, default="")
        if note == TOO_FEW and kind and numbers[kind] < _FEWEST_CLUSTERS:
            many = f"only {numbers[kind]} {kind}s" if numbers[kind] > 1 else f"one {kind}"
            prefix = "of" if kind == "expert" else "on"
            note = f"no interval and no rank: all votes are {prefix} {many}"
        notes.append(note)
    return tuple(notes)


def note_with_rank(note: str, rank: int | None) -> str:
    """The note of a line whose rank over all parts is decided, or None, unlike within its part."""
    if rank is None:
        return _UNRANKED.get(note, note or "no rank: too few votes against those above")
    return note.partition("; no rank")[0]
