"""A plain judgement of an expert from what their votes say, with its reason.

It removes no vote: it says where somebody should look. The thresholds are conventions, set so that
an expert who guesses is looked at and one who only differs from the others is not.
"""

from dataclasses import dataclass
from enum import StrEnum

from arena.rating.lines import whole_percent
from arena.rating.snapshot_document import PanelRater

FEWEST_VOTES = 20
"""Of fewer votes nothing is said but that they are few, unless there is a reason to look."""
FAST, TOO_FAST = 0.1, 0.25
"""Shares of votes under a second that raise a doubt, and that ask for a look."""
FEWEST_REPEATS = 5
ALIKE, HARDLY_ALIKE = 0.6, 0.4
"""Below such shares of hidden repeats answered alike; who guesses among three has a third."""
PASSED = 0.8
"""Two attention checks failed and a smaller share passed ask for a look; one failed is a doubt."""
ONE_SIDED = 0.7
"""Such a share of decided votes for one side, its interval away from a half, asks for a look."""
MOSTLY_TIES = 0.9


class Reliability(StrEnum):
    """What is to be done about an expert, the most urgent first."""

    LOOK = "look here"
    UNCERTAIN = "uncertain"
    RELIABLE = "reliable"


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """The word and its reasons, as one line."""

    reliability: Reliability
    reason: str


def judge_rater(rater: PanelRater) -> Judgement:
    """Judge an expert: a reason to look counts before a doubt, and a doubt before good signs."""
    found = {
        Reliability.LOOK: _reasons_to_look(rater),
        Reliability.UNCERTAIN: _doubts(rater),
        Reliability.RELIABLE: _good_signs(rater),
    }
    for reliability, reasons in found.items():
        said = [reason for reason, holds in reasons.items() if holds]
        if said:
            return Judgement(reliability=reliability, reason="; ".join(said))
    reason = "no checks, no hidden repeats, and nobody to compare with"
    return Judgement(reliability=Reliability.UNCERTAIN, reason=reason)


# --- Private -----------------------------------------------------------------------------------


def _reasons_to_look(rater: PanelRater) -> dict[str, bool]:
    (checks, passed), (repeats, alike) = rater.checks, rater.repeats
    left, favourites = rater.left, rater.favourites
    lower, upper = left.lower or 0.0, 1.0 if left.upper is None else left.upper
    is_left = lower > 0.5
    one_sided = 0.0 if left.value is None else max(left.value, 1.0 - left.value)
    return {
        f"failed {checks - passed} of {checks} attention checks": (
            checks - passed > 1 and passed < PASSED * checks
        ),
        _of_votes(rater.fast, "of the votes took less than a second"): (
            (rater.fast or 0.0) >= TOO_FAST
        ),
        f"answered {alike} of {repeats} hidden repeats alike": (
            repeats >= FEWEST_REPEATS and alike < HARDLY_ALIKE * repeats
        ),
        _of_votes(one_sided, f"of the decided votes for the {'left' if is_left else 'right'}"): (
            one_sided >= ONE_SIDED and (is_left or upper < 0.5)
        ),
        "mostly picks what the others rate lower": (
            favourites.upper is not None and favourites.upper < 0.5
        ),
    }


def _doubts(rater: PanelRater) -> dict[str, bool]:
    (checks, passed), (repeats, alike) = rater.checks, rater.repeats
    favourites = rater.favourites
    return {
        f"only {rater.votes} vote{'' if rater.votes == 1 else 's'}": rater.votes < FEWEST_VOTES,
        f"failed {checks - passed} of {checks} attention checks": passed < checks,
        f"skipped {rater.checks_skipped} attention checks": rater.checks_skipped > 1,
        _of_votes(rater.fast, "of the votes took less than a second"): (rater.fast or 0.0) >= FAST,
        f"answered {alike} of {repeats} hidden repeats alike": (
            repeats >= FEWEST_REPEATS and alike < ALIKE * repeats
        ),
        _of_votes(rater.ties, "of the votes call both equal"): rater.ties >= MOSTLY_TIES,
        "picks the others’ favourite no more often than chance": (
            favourites.lower is not None and favourites.lower <= 0.5
        ),
    }


def _good_signs(rater: PanelRater) -> dict[str, bool]:
    checks, (repeats, alike) = rater.checks[0], rater.repeats
    return {
        f"passed {checks} of {checks} attention checks": checks > 0,
        f"answered {alike} of {repeats} hidden repeats alike": repeats >= FEWEST_REPEATS,
        _of_votes(rater.favourites.value, "of the decided votes for the others’ favourite"): (
            rater.favourites.value is not None
        ),
    }


def _of_votes(share: float | None, what: str) -> str:
    return f"{whole_percent(share or 0.0)} % {what}"
