"""Bets against experts: does somebody vote without looking, or the wrong way round?

The claim is that an expert judges as the other experts do, up to the error of their ratings, a
taste of the expert's own, and slips. Against it stand two bettors: one says that the votes do not
depend on who is shown, and goes by the expert's share of left votes so far; the other says that
the expert's keys are swapped. Each begins with half a coin, and every vote multiplies what they
have by how much better than the claim they foresaw it. If the claim is true their wealth ever
exceeds w with a chance of at most 1 / w (Ville 1939), so it may be watched vote by vote: it is an
e-value, the kind of test that Chatbot Arena runs on its voters.

Ties count neither way, for honest experts differ in how often they call two pictures equal. What
the claim allows for is learnt from the votes themselves: a logistic Kalman filter begins at the
others' ratings and follows the expert (MacKay 1992 for a chance averaged over what is unknown).

Notation: V votes, C contestants, E experts, n votes of one expert. Strengths are natural
logarithms of odds.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from math import pi, sqrt, tanh

import numpy as np
from scipy.special import expit

from arena.rating.bradley_terry import ELO_PER_LOGIT, Meetings, inverse_curvature, newton
from arena.rating.comparisons import (
    WIN,
    Comparisons,
    FloatArray,
    count_pairs,
    restrict_to,
    select_votes,
)
from arena.rating.connectivity import are_determined
from arena.rating.influence import without_each_expert

_FALSE_ALARMS = 0.05
_TASTE = 40.0 / ELO_PER_LOGIT
"""How far an expert's taste moves each contestant, as a standard deviation; as in the coverage
study's realistic experts."""
_SLIPS = 0.05
"""The share of votes that the claim takes for slips of the hand, which go either way."""
_MOST_VOTES = 5000
"""Of one expert; by then the bet is decided, and each costs some microseconds."""
_LARGEST = 1e12


class Manner(StrEnum):
    """How else somebody may vote."""

    BLIND = "blind"
    SWAPPED = "swapped"


@dataclass(frozen=True, slots=True, kw_only=True)
class Bet:
    """What was won by betting against one expert.

    Attributes:
        e_value: The most that the bettors ever had, of 1 at the start; no more than 1e12 is said.
        manner: Whose bettor had more of it.
        votes: The decided votes that were bet on.
    """

    e_value: float
    manner: Manner
    votes: int


def detection_limit(experts: int) -> float:
    """Above this e-value an expert deserves a look.

    Of so many honest experts together at least one gets there in at most 5 % of studies.
    """
    return experts / _FALSE_ALARMS


def compute_e_values(votes: Comparisons) -> dict[int, Bet]:
    """By expert what a bet against their votes won; only where the others' votes say enough.

    Nothing is said of an expert without decided votes, nor of one without whom the decided votes
    determine no ratings.

    Args:
        votes: A row each (no counts), an expert's in the order in which they were given; `first`
            was shown on the left; without planned repeats.
    """
    decided = _with_members(select_votes(votes, votes.score != 0.5))
    fitted = _fitted(decided)
    if fitted is None:
        return {}
    strengths, error = fitted
    without = without_each_expert(decided, strengths)
    bets = {}
    for expert in np.flatnonzero(~np.isnan(without).any(axis=1)).tolist():
        own = decided.expert == expert
        if number := int(own.sum()):
            # The error without an expert is that of all, wider by how many votes are missing.
            missing = len(decided) / (len(decided) - number)
            unknown = error * missing + np.diag(np.full(len(error), _TASTE**2))
            bets[expert] = _bet(select_votes(decided, own), without[expert], unknown)
    return bets


# --- Private -----------------------------------------------------------------------------------


def _with_members(votes: Comparisons) -> Comparisons:
    """The same votes without contestants that have none."""
    return restrict_to(votes, np.unique([votes.first, votes.second]).tolist())


def _fitted(votes: Comparisons) -> tuple[FloatArray, FloatArray] | None:
    """(C,) strengths and the (C, C) covariance of their errors; None where undetermined."""
    counts = count_pairs(votes)
    met = Meetings(contestants=len(votes.names), low=counts.low, high=counts.high)
    fine = are_determined(
        contestants=met.contestants,
        low=met.low,
        high=met.high,
        games=counts.games[None],
        scores=counts.scores[None],
    )
    if not len(votes) or not fine[0]:
        return None
    strengths = newton(met, counts.games[:, None], counts.scores[:, None])[:, 0]
    return strengths, inverse_curvature(met, counts.games, strengths)


def _bet(votes: Comparisons, strengths: FloatArray, unknown: FloatArray) -> Bet:
    """The bet against one expert's decided votes, in their order."""
    votes = select_votes(votes, np.arange(min(len(votes), _MOST_VOTES)))
    left = votes.score == WIN
    claimed = np.log(_with_slips(_learnt(votes, strengths, unknown)))
    lefts = np.cumsum(left) - left
    share = (lefts + 0.5) / (np.arange(len(left)) + 1.0)
    blind = np.cumsum(np.log(np.where(left, share, 1.0 - share)) - claimed)
    swapped = np.cumsum(np.log(_with_slips(_at_first(votes, -strengths, unknown))) - claimed)
    wealth = np.logaddexp(blind, swapped) - np.log(2.0)
    best = int(np.argmax(wealth))
    return Bet(
        e_value=float(np.exp(np.clip(wealth[best], 0.0, np.log(_LARGEST)))),
        manner=Manner.BLIND if blind[best] >= swapped[best] else Manner.SWAPPED,
        votes=len(votes),
    )


def _with_slips(chance: FloatArray) -> FloatArray:
    return np.asarray((1.0 - _SLIPS) * chance + _SLIPS / 2.0)


def _at_first(votes: Comparisons, strengths: FloatArray, unknown: FloatArray) -> FloatArray:
    """(n,) the chance of each decided vote as it was given, by what is known before the first."""
    first, second = votes.first, votes.second
    variance = unknown[first, first] + unknown[second, second] - 2.0 * unknown[first, second]
    gap = (strengths[first] - strengths[second]) / np.sqrt(1.0 + pi / 8.0 * variance)
    return np.asarray(expit(np.where(votes.score == WIN, gap, -gap)))


def _learnt(votes: Comparisons, strengths: FloatArray, unknown: FloatArray) -> FloatArray:
    """(n,) the same by what is known before each vote, which its forerunners have changed."""
    mean, covariance = strengths.copy(), unknown.copy()
    found = np.empty(len(votes))
    rows = zip(votes.first.tolist(), votes.second.tolist(), votes.score.tolist(), strict=True)
    for row, (first, second, score) in enumerate(rows):
        gain = covariance[first] - covariance[second]
        variance = float(gain[first] - gain[second])
        gap = float(mean[first] - mean[second])
        chance = _logistic(gap / sqrt(1.0 + pi / 8.0 * variance))
        found[row] = chance if score == WIN else 1.0 - chance
        expected = _logistic(gap)
        curvature = expected * (1.0 - expected)
        shrinks = 1.0 + curvature * variance
        mean += gain * ((score - expected) / shrinks)
        covariance -= gain[:, None] * (gain * (curvature / shrinks))
    return found


def _logistic(x: float) -> float:
    return 0.5 * (1.0 + tanh(0.5 * x))
