"""What to say with ratings: why intervals are missing, and what to keep in mind."""

from __future__ import annotations

import numpy as np

from arena.rating import elo, sandwich
from arena.rating.bootstrap import Unit
from arena.rating.comparisons import Comparisons, FloatArray, IntArray, renumber_codes
from arena.rating.connectivity import few_of
from arena.rating.rules import Intervals, Rules
from augment.sentences import Sentence, sentence

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


def why_no_interval(names: tuple[str, ...], rules: Rules, *, lost: int) -> Sentence:
    """Why nobody of a part has a bound.

    Args:
        names: Of the part.
        rules: How it was rated.
        lost: Rounds that did not determine everybody.
    """
    named = few_of(names, mark="…")
    if rules.intervals is not Intervals.RESAMPLES:
        return sentence(
            "Among %(names)s no intervals can be given: there are too few votes, or hardly any "
            "against some contestant.",
            names=named,
        )
    return sentence(
        "Among %(names)s the votes determined no ratings in %(lost)s of %(rounds)s "
        "resamples, so intervals can't be given: there are too few votes, or hardly "
        "any against some contestant.",
        names=named,
        lost=lost,
        rounds=rules.rounds,
    )


def why_no_spread(rules: Rules) -> Sentence:
    """Why the votes leave no width for an interval."""
    if rules.intervals is Intervals.RESAMPLES:
        return _ALL_THE_SAME[rules.unit]
    return sentence(
        "The votes do not vary between what they are clustered by, so intervals can't be given: "
        "there is too little that could have come out otherwise."
    )


def notes_on_bounds(
    lower: FloatArray, upper: FloatArray, rank: IntArray
) -> tuple[Sentence | str, ...]:
    """(C,) which bounds or ranks are missing and why; bounds NaN and ranks 0 are missing."""
    return tuple(
        _MISSING[no_lower, no_upper, no_rank]
        for no_lower, no_upper, no_rank in zip(
            np.isnan(lower).tolist(), np.isnan(upper).tolist(), (rank == 0).tolist(), strict=True
        )
    )


def why_too_few(
    votes: Comparisons, unit: Unit, notes: tuple[Sentence | str, ...]
) -> tuple[Sentence | str, ...]:
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


def who_is_open(names: tuple[str, ...], notes: tuple[Sentence | str, ...]) -> tuple[Sentence, ...]:
    """That some lack bounds, and who; nothing if nobody does."""
    lacking = tuple(name for name, note in zip(names, notes, strict=True) if note)
    if not lacking:
        return ()
    if len(lacking) == len(names):
        names = few_of(names, mark="…")
        return (
            sentence(
                "The votes set no two bounds for %(names)s: too few votes, or hardly any score on "
                "one side. The lines say what is missing.",
                names=names,
            ),
        )
    return (
        sentence(
            "The votes set no two bounds for %(names)s: too few votes, or hardly any score on "
            "one side. The lines say what is missing; the others' intervals do not rest on them.",
            names=few_of(lacking, mark="…"),
        ),
    )


def warnings(
    votes: Comparisons, *, rules: Rules, rounds: int, degenerate: int
) -> tuple[Sentence | str, ...]:
    """What to keep in mind with intervals by these rules."""
    said: list[Sentence | str] = []
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
            sentence(
                "In %(lost)s of %(rounds)s resamples the votes did not determine everybody's "
                "rating; there it counts as far above or below the others, as the votes say.",
                lost=degenerate,
                rounds=rounds,
            )
        )
    return tuple(said)


ELO_NOTE = sentence(elo.INTERVAL_NOTE)

NO_DAVIDSON = sentence(
    "Davidson's model has no finite ratings for these votes: some score one way by ties only. "
    "Bradley-Terry rates them."
)

NOT_ADJUSTED = sentence(
    "The votes do not determine what was to be adjusted for: it is the same in all votes, or says "
    "no more than who was shown. The ratings stand without it."
)

_ALL_THE_SAME = {
    Unit.VOTE: sentence(
        "Every resample by vote gave the same ratings, so intervals can't be given: there is too "
        "little that could have come out otherwise."
    ),
    Unit.EXPERT: sentence(
        "Every resample by expert gave the same ratings, so intervals can't be given: there is "
        "too little that could have come out otherwise."
    ),
    Unit.SCENARIO: sentence(
        "Every resample by scenario gave the same ratings, so intervals can't be given: there is "
        "too little that could have come out otherwise."
    ),
    Unit.TWO_WAY: sentence(
        "Every resample by expert and scenario gave the same ratings, so intervals can't be "
        "given: there is too little that could have come out otherwise."
    ),
}


def note_with_rank(note: Sentence | str, rank: int | None) -> Sentence | str:
    """The note of a line whose rank over all parts is decided, or None, unlike within its part."""
    if rank is None:
        return _UNRANKED.get(note, note or _NO_RANK_ACROSS)
    return _RANKED.get(note, note)


NO_SPREAD = sentence("no interval and no rank: the votes leave no spread")
ONLY_TIES = sentence("no interval and no rank: every vote is a tie")
TOO_FEW = sentence("no interval and no rank: too few votes")
NOT_RATED = sentence("no rating by this model")
_NO_RANK_ACROSS = sentence("no rank: too few votes against those above")

_UNRANKED: dict[str, Sentence] = {
    "no upper limit": sentence("no upper limit; no rank: too few votes say that it is above"),
    "no lower limit": sentence("no lower limit; no rank: too few votes say that it is below"),
    "no limits among equals": sentence("no limits among equals; no rank"),
}
"""Notes of those without a rating, where the votes decide no rank either."""

_MISSING: dict[tuple[bool, bool, bool], Sentence | str] = {
    (False, False, False): "",
    (True, False, False): sentence("no lower bound: hardly any score"),
    (False, True, False): sentence("no upper bound: hardly anybody scored"),
    (True, False, True): sentence(
        "no lower bound: hardly any score; no rank, because the upper bound tells it from nobody"
    ),
    (False, True, True): sentence(
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
    "expert": sentence(
        "All votes belong to one expert: how much experts differ can't be seen, and the "
        "intervals hold for this expert only."
    ),
    "scenario": sentence(
        "All votes belong to one scenario: how much scenarios differ can't be seen, and the "
        "intervals hold for this scenario only."
    ),
}

_BY_T = sentence("Such intervals are widened by Student's t.")

_WIDENED = {
    Unit.EXPERT: _BY_T,
    Unit.SCENARIO: _BY_T,
    Unit.TWO_WAY: sentence(
        "Drawing both ways is too wide where votes are independent and too narrow where few "
        "experts differ much; intervals in closed form are neither."
    ),
}
