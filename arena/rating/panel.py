"""One judgement of an expert from all that their votes say, with its error and its reasons.

It removes no vote: it says where somebody should look. Attention is 100 % for who judges as the
other experts do and 0 % for who does not look: agreement with the others, hidden repeats and
attention checks are pooled, each by the logarithm of its likelihood ratio. Pace, a side and failed
checks can ask for a look by themselves.
"""

from dataclasses import dataclass
from enum import StrEnum

from arena.rating.lines import whole_percent
from arena.rating.reliability import Evidence
from arena.rating.snapshot_document import PanelRater

LESS, MORE = 1.5, 2.0
"""So many errors below the others is clearly less, and above guessing clearly more."""
LEAST_SCALE = 1.5
"""Of less evidence, in logarithms of likelihood ratios, nothing is said."""
PASSED = 0.95
"""The share of attention checks that an honest expert passes."""
ENOUGH = 5
"""Of fewer checks or repeats a page says that they are lacking."""
TOO_FAST = 0.25
"""Such a share of votes under a second asks for a look."""
ONE_SIDED = 0.7
"""Such a share of decided votes for one side does, three errors away from a half."""


class Reliability(StrEnum):
    """Judgement on an expert, the most urgent first."""

    LOOK = "look here"
    UNKNOWN = "can't tell yet"
    RELIABLE = "reliable"


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """The word and its reasons, as one line."""

    reliability: Reliability
    reason: str


def judge_rater(rater: PanelRater) -> Judgement:
    """Judge an expert by the attention that all evidence together shows, and by side and pace.

    Whose attention is closer to none, and clearly less than that of honest experts, is looked at;
    whose is closer to theirs, and clearly more than none, is reliable.
    """
    (checks, passed), (repeats, alike) = rater.checks, rater.repeats
    evidence = rater.evidence + _evidence_of_checks(rater)
    reasons = _reasons_to_look(rater)
    must_look = bool(reasons)
    reliability = Reliability.LOOK if must_look else Reliability.UNKNOWN
    if evidence.scale > 0.0:
        # In units of the gain that is expected of somebody who judges as the others do.
        attention, error = evidence.gain / evidence.scale, evidence.looking**0.5 / evidence.scale
        by_chance = MORE * evidence.guessing**0.5 / evidence.scale
        reasons.append(
            f"attention {whole_percent(attention)} %, where guessing is 0 ± "
            f"{whole_percent(by_chance)} and the others are 100 ± {whole_percent(MORE * error)}"
        )
        is_half = attention >= 0.5
        if not is_half and attention + LESS * error < 1.0 and evidence.scale >= LEAST_SCALE:
            reliability = Reliability.LOOK
        elif not must_look and is_half and attention > by_chance:
            reliability = Reliability.RELIABLE
    counts = {
        f"passed {passed} of {checks} attention checks": checks,
        f"answered {alike} of {repeats} hidden repeats alike": repeats,
    }
    reasons += [text for text, number in counts.items() if number]
    if reliability is Reliability.UNKNOWN:
        numbers = {"attention checks": checks, "hidden repeats": repeats}
        few = [f"{what} ({n})" for what, n in numbers.items() if n < ENOUGH]
        reasons.append(f"too few {' and '.join(few or ['votes'])} to tell")
    return Judgement(reliability=reliability, reason="; ".join(reasons))


# --- Private -----------------------------------------------------------------------------------


def _evidence_of_checks(rater: PanelRater) -> Evidence:
    """Weigh the attention checks; a single one that failed is anybody's slip."""
    checks, passed = rater.checks
    if checks - passed == 1:
        checks = passed
    # A check has a right side: who guesses and does not tie finds it every other time.
    guessing = min(max((1.0 - rater.ties) / 2.0, 0.1), 0.5)
    return Evidence.of_trials(passed, checks, looking=PASSED, guessing=guessing)


def _reasons_to_look(rater: PanelRater) -> list[str]:
    """Return single reasons to look: no time, one side only, two failed checks and a fifth."""
    checks, passed = rater.checks
    left, decided = rater.left.value or 0.0, (1.0 - rater.ties) * rater.votes
    share, side = max((left, "left"), (1.0 - left, "right"))
    reasons = {
        f"{whole_percent(rater.fast or 0.0)} % of the votes took less than a second": (
            (rater.fast or 0.0) >= TOO_FAST
        ),
        f"{whole_percent(share)} % of the decided votes for the {side}": (
            # A share of n has the error 1 / (2 sqrt n) at a half: three of these, squared.
            share >= ONE_SIDED and (2.0 * share - 1.0) ** 2 * decided >= 9.0
        ),
        f"failed {checks - passed} of {checks} attention checks": (
            checks - passed > 1 and passed < 0.8 * checks
        ),
    }
    return [reason for reason, holds in reasons.items() if holds]
