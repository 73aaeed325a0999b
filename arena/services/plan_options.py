"""The rules of a study beyond who takes part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from arena.services.hypotheses import Hypothesis
from arena.services.shown_pictures import SampleRule


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanOptions:
    """Rules of a plan beyond who takes part; see arena.pairing.rules for what they mean.

    Attributes:
        check_share: Needs as many scenarios with pictures for an attention check; see
            `enough_checks`.
        allow_measures: Experts may lay lines and rings of the instruction over both pictures.
        practice: Experts practise before their first pair; see arena.services.practice.
        samples: Which samples of a cell are shown.
        jobs: Names or codes of the jobs whose augmentations are shown; none for every job.
        hypotheses: What is expected, a line each; see `read_hypotheses`.
    """

    repeat_share: float = 0.0
    overlap_share: float = 0.0
    check_share: float = 0.0
    adaptive_share: float = 0.0
    appearances: tuple[tuple[str, int], ...] = ()
    pair_votes: tuple[tuple[str, str, int], ...] = ()
    allow_both_miss: bool = False
    allow_text: bool = False
    settle_alike: bool = False
    allow_replay: bool = False
    allow_measures: bool = True
    practice: bool = False
    samples: SampleRule = SampleRule.ONE
    jobs: tuple[str, ...] = ()
    hypotheses: tuple[str, ...] = ()

    def frozen_aims(self, hypotheses: Sequence[Hypothesis]) -> dict[str, Any]:
        """What is expected, as the study's rules keep it."""
        return {"hypotheses": [one.as_document() for one in hypotheses]}


OF_THE_PLAN = (
    *("appearances", "pair_votes", "repeat_share", "overlap_share", "check_share"),
    "adaptive_share",
)
"""Those that the planner knows by the same name."""
