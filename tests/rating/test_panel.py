"""The judgement of an expert, at the thresholds."""

from typing import Any

import pytest

from arena.rating.comparisons import Estimate
from arena.rating.panel import Reliability, judge_rater
from arena.rating.snapshot_document import PanelRater

NOTHING, AGREES = Estimate(value=None), Estimate(value=0.8, lower=0.6, upper=0.9)


def judged(**more: Any) -> tuple[Reliability, str]:
    """Of somebody about whom nothing else is known than that they agree with the others."""
    usual: dict[str, Any] = {
        **{"expert": 0, "votes": 40, "median_ms": None, "fast": None, "ties": 0.2},
        **{"left": NOTHING, "agreement": NOTHING, "shared": 0, "favourites": AGREES},
        **{"decided": 30, "judge": "e", "name": "Expert", "moves": 0},
        **{"repeats": (0, 0), "checks": (0, 0)},
    }
    found = judge_rater(PanelRater(**usual | more))
    return found.reliability, found.reason


@pytest.mark.parametrize(
    ("more", "standing", "reason"),
    [
        ({}, "reliable", "80 % of the decided votes for the others’ favourite"),
        ({"favourites": NOTHING}, "uncertain", "nobody to compare with"),
        ({"votes": 20}, "reliable", ""),
        ({"votes": 19}, "uncertain", "only 19 votes"),
        ({"checks": (4, 4)}, "reliable", "passed 4 of 4 attention checks"),
        ({"checks": (4, 3)}, "uncertain", "failed 1 of 4"),
        ({"checks": (10, 8)}, "uncertain", "failed 2 of 10"),
        ({"checks": (9, 7)}, "look here", "failed 2 of 9"),
        ({"checks_skipped": 1}, "reliable", ""),
        ({"checks_skipped": 2}, "uncertain", "skipped 2"),
        ({"fast": 0.09}, "reliable", ""),
        ({"fast": 0.1}, "uncertain", "10 % of the votes took less than a second"),
        ({"fast": 0.25}, "look here", "25 %"),
        ({"repeats": (4, 0)}, "reliable", ""),
        ({"repeats": (5, 3)}, "reliable", "answered 3 of 5"),
        ({"repeats": (5, 2)}, "uncertain", "answered 2 of 5"),
        ({"repeats": (5, 1)}, "look here", "answered 1 of 5"),
        ({"ties": 0.89}, "reliable", ""),
        ({"ties": 0.9}, "uncertain", "90 % of the votes call both equal"),
        ({"left": Estimate(value=0.7, lower=0.51, upper=0.8)}, "look here", "for the left"),
        ({"left": Estimate(value=0.69, lower=0.51, upper=0.8)}, "reliable", ""),
        ({"left": Estimate(value=0.7, lower=0.5, upper=0.8)}, "reliable", ""),
        ({"left": Estimate(value=0.3, lower=0.2, upper=0.49)}, "look here", "70 % of the decided"),
        ({"favourites": Estimate(value=0.6, lower=0.5, upper=0.7)}, "uncertain", "than chance"),
        ({"favourites": Estimate(value=0.4, lower=0.3, upper=0.5)}, "uncertain", "than chance"),
        ({"favourites": Estimate(value=0.4, lower=0.3, upper=0.49)}, "look here", "rate lower"),
        ({"votes": 3, "fast": 0.5, "checks": (3, 0)}, "look here", "checks; 50 %"),
    ],
)
def test_a_judgement_changes_at_its_threshold(
    more: dict[str, Any], standing: str, reason: str
) -> None:
    found, why = judged(**more)
    assert found == standing
    assert reason in why
