"""Pairs that nobody can tell apart: which are shown all the same, and the ties of the others.

A settled pair counts as if it had been shown: with as many ties as a pair that can be shown has
votes on average, from experts drawn in proportion to their votes. Left out, contestants who are
often alike would come to lie further apart than their pictures do.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from random import Random

from arena.pairing.rules import Entry

Triple = tuple[str, str, str]
"""Scenario (or sample of one) and two contestants."""

SHOWN_SHARE = 0.1
"""Of the pairs alike within the tolerance: whether experts take these for equal is seen there."""


def draw_shown(alike: Sequence[Triple], entries: Sequence[Entry], *, seed: int) -> list[Triple]:
    """Return the pairs to show, a tenth of those whose pictures differ at all, sorted."""
    pictures = {(entry.scenario, entry.contestant): entry.picture for entry in entries}
    differing = sorted(
        (place, one, other)
        for place, one, other in alike
        if pictures[place, one] != pictures[place, other]
    )
    number = round(SHOWN_SHARE * len(differing))
    return sorted(Random(f"shown {seed}").sample(differing, number))


def draw_ties(
    settled: Sequence[Triple], votes_by_judge: Mapping[str, int], *, showable: int, seed: int
) -> list[tuple[Triple, str]]:
    """Return who gives a tie on which settled pair.

    Args:
        settled: Pairs that nobody was shown.
        votes_by_judge: Decided votes on shown pairs.
        showable: How many pairs could be shown.
        seed: Of the lots that round the average and choose the judges.
    """
    average = sum(votes_by_judge.values()) / showable if showable else 0.0
    drawn = []
    for triple in settled:
        dice = Random(f"ties {seed} {triple}")
        number = math.floor(average) + (dice.random() < average % 1.0)
        # Each judge's place in line: without replacement, in proportion to the votes.
        turn = {judge: dice.random() ** (1.0 / n) for judge, n in sorted(votes_by_judge.items())}
        chosen = sorted(turn, key=lambda judge: -turn[judge])[:number]
        drawn += [(triple, judge) for judge in sorted(chosen)]
    return drawn
