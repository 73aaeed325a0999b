"""Remarks on ratings: reasons of missing values, and caveats."""

from collections.abc import Sequence

import numpy as np

from arena.rating.chains import join_few
from arena.rating.comparisons import BoolArray, Comparisons, count_codes
from arena.rating.rules import Intervals, Rules, Unit

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
NO_INTERVALS = (
    "No intervals can be given: there are too few votes, hardly any against some contestant, or "
    "nothing that could have come out otherwise."
)

NOT_RANKED = "Not enough votes to rank: no contestant can be told from any other."
NOT_RATED = "no rating by this model"
NO_INTERVAL = "no interval and no rank: too few votes"
NOTHING_DIFFERS = "no interval and no rank: the votes show nothing that differs"
NO_RANK = "no rank: too few votes"


_MISSING = {
    (True, True): ("", NO_RANK),
    (True, False): (
        "no upper bound: hardly anybody scored",
        "no rank, because the lower bound is not above the average",
    ),
    (False, True): (
        "no lower bound: hardly any score",
        "no rank, because the upper bound tells it from nobody",
    ),
}
"""What to say of a bound, and of a rank, by whether there are a lower and an upper bound."""


def note_on_bounds(*, has_lower: bool, has_upper: bool, has_rank: bool) -> str:
    """Say which bound or rank of a contestant is missing; empty for who has all."""
    if not has_lower and not has_upper:
        return NO_INTERVAL
    of_bound, of_rank = _MISSING[has_lower, has_upper]
    return "; ".join(filter(None, (of_bound, "" if has_rank else of_rank)))


def note_on_limits(*, has_higher: bool, has_lower: bool) -> str:
    """Say why somebody who is alone in a part has no rating."""
    if has_higher and has_lower:
        return "no limits among equals"
    return "no upper limit" if has_lower else "no lower limit"


def who_is_open(votes: Comparisons, is_open: BoolArray) -> str:
    """Say which contestants (C,) lack bounds."""
    names = [votes.shown[place] for place in np.flatnonzero(is_open)]
    rest = "; the others' intervals do not rest on them" if not is_open.all() else ""
    return (
        f"The votes set no two bounds for {', '.join(join_few(names))}: too few votes, or hardly "
        f"any score on one side. The lines say what is missing{rest}."
    )


def why_no_intervals(votes: Comparisons, unit: Unit) -> str:
    """Say why nobody has an interval."""
    if unit is Unit.VOTE or any(len(set(getattr(votes, kind))) > 1 for kind in unit.kinds):
        return NO_INTERVALS
    alone = " and one ".join(unit.kinds)
    return f"No intervals can be given: all votes belong to one {alone}, of which none differs."


def warnings(votes: Comparisons, *, rules: Rules, rounds: int, degenerate: int) -> list[str]:
    """Return the caveats of intervals by these rules."""
    texts: list[str] = []
    is_resampled = rules.intervals is Intervals.RESAMPLES
    for kind in Unit.TWO_WAY.kinds:
        number = count_codes(getattr(votes, kind))
        limit = FEWEST[kind]
        if number == 1 and kind in rules.unit.kinds:
            texts.append(
                f"All votes belong to one {kind}: how much {kind}s differ can't be seen, and the "
                f"intervals hold for this {kind} only."
            )
        elif 1 < number < limit:
            texts.append(
                f"Only {number} {kind}s: intervals that rest on fewer than {limit} of them are "
                "rough."
            )
    if degenerate and is_resampled:
        texts.append(
            f"In {degenerate} of {rounds} resamples the votes did not determine everybody's "
            "rating; there it counts as far above or below the others, as the votes say."
        )
    return texts


def remark_on_ignored(kinds: Sequence[str]) -> list[str]:
    """Say that votes are clustered in ways that the intervals do not know of; or nothing."""
    sentence = (
        f"Votes are known by {' and '.join(kinds)}, and intervals that take those of one for "
        "independent are too narrow: nobody is called better by them."
    )
    return [sentence] if kinds else []
