"""The judgement of an expert, at the thresholds."""

from typing import Any

from arena.rating.comparisons import Estimate
from arena.rating.panel import Reliability, judge_rater
from arena.rating.reliability import Evidence
from arena.rating.snapshot_document import PanelRater

NOTHING = Estimate(value=None)


def judged(**more: Any) -> tuple[Reliability, str]:
    """Of somebody about whom nothing else is known."""
    usual: dict[str, Any] = {
        **{"expert": 0, "votes": 40, "median_ms": None, "fast": None, "ties": 0.2},
        **{"left": Estimate(value=0.5), "agreement": NOTHING, "shared": 0, "favourites": NOTHING},
        **{"decided": 30, "judge": "e", "name": "Expert", "moves": 0},
        **{"repeats": (0, 0), "checks": (0, 0)},
    }
    found = judge_rater(PanelRater(**usual | more))
    return found.reliability, found.reason


def evidence(gain: float, scale: float) -> Evidence:
    return Evidence(gain=gain, scale=scale, looking=scale, guessing=scale)


SURE = evidence(9.0, 9.0)
"""Attention 100 % with an error of a third."""


def test_judgements_change_at_thresholds() -> None:
    for more, standing, reason in (
        ({}, "can't tell yet", "too few attention checks (0) and hidden repeats (0) to tell"),
        ({"repeats": (5, 2)}, "can't tell yet", "alike; too few attention checks (0) to tell"),
        ({"checks": (5, 4), "ties": 1.0}, "reliable", "passed 4 of 5 attention checks"),
        ({"evidence": SURE}, "reliable", "guessing is 0 ± 67 and the others are 100 ± 67"),
        ({"evidence": evidence(6.1, 9.0)}, "reliable", "attention 68 %"),
        ({"evidence": evidence(5.9, 9.0)}, "can't tell yet", "too few attention checks"),
        ({"evidence": evidence(3.9, 8.0)}, "can't tell yet", "attention 49 %"),
        ({"evidence": evidence(12.4, 36.0)}, "look here", "attention 34 %"),
        ({"evidence": evidence(4.4, 9.0)}, "look here", "attention 49 %"),
        ({"evidence": evidence(-0.4, 1.4)}, "can't tell yet", "attention -29 %"),
        ({"evidence": evidence(-0.5, 1.6)}, "look here", "attention -31 %"),
        ({"checks": (3, 3)}, "reliable", "passed 3 of 3"),
        ({"checks": (1, 0)}, "can't tell yet", "passed 0 of 1"),
        ({"checks": (9, 7)}, "look here", "failed 2 of 9"),
        ({"checks": (10, 8)}, "reliable", "passed 8 of 10"),
        ({"checks": (4, 2), "evidence": evidence(90.0, 90.0)}, "look here", "failed 2 of 4"),
        ({"evidence": SURE, "fast": 0.24}, "reliable", ""),
        ({"evidence": SURE, "fast": 0.25}, "look here", "25 % of the votes took less"),
        ({"evidence": SURE, "left": Estimate(value=0.77)}, "look here", "77 % of the decided"),
        ({"evidence": SURE, "left": Estimate(value=0.76)}, "reliable", ""),
        ({"evidence": SURE, "left": Estimate(value=0.23)}, "look here", "votes for the right"),
        ({"evidence": SURE, "left": Estimate(value=0.69), "votes": 999}, "reliable", ""),
    ):
        found, why = judged(**more)
        assert (found, reason in why) == (standing, True), why
