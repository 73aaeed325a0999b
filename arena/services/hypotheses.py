"""What somebody expects of a study, written down before its first vote, and what came of it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from arena.errors import NothingToPlan
from arena.models import Snapshot, Study

MOST = 100
LONGEST = 500
_PAIR = re.compile(r"(\S+)\s+above\s+(\S+)")


@dataclass(frozen=True, slots=True, kw_only=True)
class Hypothesis:
    """A line.

    Attributes:
        text: As it was entered.
        above: The slugs of the one that is expected to be better and of the other; None for a
            line in words, which no number answers.
    """

    text: str
    above: tuple[str, str] | None = None

    def as_document(self) -> dict[str, Any]:
        """For JSON."""
        return {"text": self.text, "above": None if self.above is None else list(self.above)}


class HypothesisVerdict(StrEnum):
    """What a rating says of an expected pair, with all pairs of the table judged at once."""

    HELD = "held"
    CONTRADICTED = "contradicted"
    UNDECIDED = "undecided"
    NOT_JUDGED = "not judged"


@dataclass(frozen=True, slots=True, kw_only=True)
class Answered:
    """A hypothesis and what came of it.

    Attributes:
        verdict: None for a line in words.
        difference: Points from the other to the one expected to be better.
        p: Adjusted for all pairs of the table.
    """

    hypothesis: Hypothesis
    verdict: HypothesisVerdict | None = None
    difference: float | None = None
    p: float | None = None


def read_hypotheses(lines: Sequence[str], contestants: Sequence[str]) -> tuple[Hypothesis, ...]:
    """Lines of text; “SLUG above SLUG” alone on a line is an expected pair.

    Args:
        lines: Empty ones are passed over.
        contestants: Slugs of the study.

    Raises:
        NothingToPlan: A pair names somebody else or somebody twice, a line is too long or comes
            twice, or there are too many.
    """
    found = [" ".join(line.split()) for line in lines if line.strip()]
    if len(found) > MOST or len(set(found)) < len(found):
        raise NothingToPlan(f"At most {MOST} hypotheses, each once, are allowed.")
    return tuple(_read(line, contestants) for line in found)


def hypotheses_of(study: Study) -> tuple[Hypothesis, ...]:
    """Those that were frozen at the opening."""
    return tuple(
        Hypothesis(
            text=kept["text"], above=None if kept["above"] is None else tuple(kept["above"])
        )
        for kept in study.rules.get("hypotheses", ())
    )


def answer_hypotheses(snapshot: Snapshot) -> tuple[Answered, ...]:
    """What a rating says of each of the study's hypotheses; one query where there are any."""
    hypotheses = hypotheses_of(snapshot.study)
    if not hypotheses:
        return ()
    ratings = dict(snapshot.standings.values_list("slug", "rating"))
    board = snapshot.results.board
    p_values = {frozenset((one.a, one.b)): one.p for one in board.p_values or ()}
    return tuple(_answered(one, ratings, board.above, p_values) for one in hypotheses)


# --- Private -----------------------------------------------------------------------------------


def _read(line: str, contestants: Sequence[str]) -> Hypothesis:
    if len(line) > LONGEST:
        raise NothingToPlan(
            f"A hypothesis has at most {LONGEST} signs: “{line[:40]}…”."
        )  # fmt: skip
    found = _PAIR.fullmatch(line)
    if found is None:
        return Hypothesis(text=line)
    better, other = found.groups()
    for slug in (better, other):
        if slug not in contestants:
            raise NothingToPlan(
                f"“{line}”: {slug} is no contestant of this study; allowed are "
                f"{', '.join(sorted(contestants))}."
            )
    if better == other:
        raise NothingToPlan(f"“{line}” names one contestant twice.")
    return Hypothesis(text=line, above=(better, other))


def _answered(
    one: Hypothesis,
    ratings: dict[str, float | None],
    above: tuple[tuple[str, str], ...] | None,
    p_values: dict[frozenset[str], float],
) -> Answered:
    if one.above is None:
        return Answered(hypothesis=one)
    better, other = one.above
    high, low = ratings.get(better), ratings.get(other)
    difference = None if high is None or low is None else high - low
    if above is None:
        verdict = HypothesisVerdict.NOT_JUDGED
    elif (better, other) in above:
        verdict = HypothesisVerdict.HELD
    elif (other, better) in above:
        verdict = HypothesisVerdict.CONTRADICTED
    else:
        verdict = HypothesisVerdict.UNDECIDED
    return Answered(
        hypothesis=one,
        verdict=verdict,
        difference=difference,
        p=p_values.get(frozenset(one.above)),
    )
