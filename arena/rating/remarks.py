"""What to say with ratings: why intervals are missing, and what to keep in mind."""

from __future__ import annotations

import numpy as np

from arena.rating import elo, sandwich
from arena.rating.bootstrap import LEVEL, Unit
from arena.rating.comparisons import Comparisons, FloatArray, renumbered
from augment.sentences import Sentence, sentence

MOST_DEGENERATE = (1.0 - LEVEL) / 2.0
"""The largest share of rounds without ratings that still leaves a percentile to read."""

_SAME = 1e-6
"""Points. Rounds that all lie within this say nothing about the spread."""


def _clusters(votes: Comparisons, unit: Unit) -> dict[str, int]:
    """How many of what is drawn there are."""
    found = {}
    if unit in (Unit.EXPERT, Unit.TWO_WAY):
        found["expert"] = len(renumbered(votes.expert)[0])
    if unit in (Unit.SCENARIO, Unit.TWO_WAY):
        found["scenario"] = len(renumbered(votes.scenario)[0])
    return found


def few_clusters(votes: Comparisons, unit: Unit) -> int | None:
    """The smaller number of clusters where that is few; one alone can't vary and is left out."""
    numbers = [number for number in _clusters(votes, unit).values() if number > 1]
    smallest = min(numbers, default=sandwich.FEW_CLUSTERS)
    return smallest if smallest < sandwich.FEW_CLUSTERS else None


def why_no_interval(
    samples: FloatArray, *, rounds: int, unit: Unit, among: tuple[str, ...]
) -> tuple[Sentence, ...]:
    """Why rounds (C, b) of those that determined ratings have no percentiles; nothing if they do.

    Args:
        samples: Ratings in the rounds that determined any.
        rounds: How many were drawn.
        unit: What was drawn.
        among: Whom it is about, nobody where it is about all.
    """
    degenerate = rounds - samples.shape[1]
    if degenerate > MOST_DEGENERATE * rounds:
        if among:
            return (
                sentence(
                    "Among %(names)s the votes determined no ratings in %(lost)s of %(rounds)s "
                    "resamples, so intervals can't be given: there are too few votes, or hardly "
                    "any against some contestant.",
                    names=among,
                    lost=degenerate,
                    rounds=rounds,
                ),
            )
        return (
            sentence(
                "In %(lost)s of %(rounds)s resamples the votes determined no ratings, so "
                "intervals can't be given: there are too few votes, or hardly any against some "
                "contestant.",
                lost=degenerate,
                rounds=rounds,
            ),
        )
    if np.ptp(samples, axis=1).max() < _SAME:
        return (_ALL_THE_SAME[unit],)
    return ()


def warnings(
    votes: Comparisons, *, unit: Unit, rounds: int, degenerate: int
) -> tuple[Sentence, ...]:
    """What to keep in mind with intervals by this unit."""
    said = []
    few = 0
    for kind, number in _clusters(votes, unit).items():
        if number == 1:
            said.append(_ONLY_ONE[kind])
        elif number < sandwich.FEW_CLUSTERS:
            said.append(_few(kind, number))
            few += 1
    if few:
        said.append(_WIDENED[unit])
    if degenerate:
        said.append(
            sentence(
                "In %(lost)s of %(rounds)s resamples the votes determined no ratings; these are "
                "left out of the intervals.",
                lost=degenerate,
                rounds=rounds,
            )
        )
    return tuple(said)


def _few(kind: str, number: int) -> Sentence:
    limit = sandwich.FEW_CLUSTERS
    if kind == "expert":
        return sentence(
            "Only %(number)s experts: intervals that rest on fewer than %(limit)s of them are "
            "rough.",
            number=number,
            limit=limit,
        )
    return sentence(
        "Only %(number)s scenarios: intervals that rest on fewer than %(limit)s of them are "
        "rough.",
        number=number,
        limit=limit,
    )


ELO_NOTE = sentence(elo.INTERVAL_NOTE)

NO_DAVIDSON = sentence(
    "Davidson's model has no finite ratings for these votes: some score one way by ties only. "
    "Bradley-Terry rates them."
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
        "Drawing both ways errs on the wide side; the cross-check uses Student's t."
    ),
}
