"""What somebody asks for who estimates how many votes a study needs; shares in percent."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from arena.rating.planning import Question, StudyDesign
from augment.services.inputs import InputKind, input_field, inputs_of

POINTS = "Elo points"


def _whole(label: str, least: int, most: int, default: int | None) -> Any:
    return input_field(InputKind.WHOLE, label, default=default, least=least, most=most)


def _number(label: str, unit: str, least: float, most: float, default: float) -> Any:
    return input_field(InputKind.NUMBER, label, unit=unit, default=default, least=least, most=most)


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyEstimate:
    """A study in mind, and what it is to tell; the defaults are guesses (docs/method.md)."""

    contestants: int = _whole("Contestants", 2, 500, 9)
    experts: int = _whole("Experts", 2, 500, 9)
    scenarios: int = _whole("Scenarios", 2, 10_000, 50)
    spread: float = _number("From the worst to the best", POINTS, 0, 3000, 150)
    ties: float = _number("Votes that say Equal", "%", 0, 99, 45)
    expert_sd: float = _number("Experts differ about a contestant by", POINTS, 0, 1000, 30)
    scenario_sd: float = _number("Scenarios differ in a contestant by", POINTS, 0, 1000, 70)
    half_width: float = _number("Expected widest interval ±", POINTS, 1, 1000, 25)
    gap: float = _number("Tell two apart that differ by", POINTS, 1, 2000, 40)
    power: float = _number("with a chance of", "%", 50, 99.9, 80)
    seconds: float = _number("Seconds for one vote", "", 0.1, 3600, 12)
    repeats: float = _number("Hidden repeats", "%", 0, 50, 5)
    checks: float = _number("Attention checks", "%", 0, 50, 2)
    overlap: float = _number("Pairs that two experts judge", "%", 0, 80, 10)
    votes_per_expert: int | None = _whole("Votes per expert in mind", 1, 10_000, None)

    @property
    def most_ties(self) -> float:
        """The percentage of ties that contestants so far apart can't reach."""
        return 100 * self._design(ties=0.0).most_ties

    def question(self) -> Question:
        """Return what is to be foretold.

        Raises:
            ValueError: So many ties do not go together with so large a spread.
        """
        return Question(
            design=self._design(ties=self.ties),
            half_width=self.half_width,
            gap=self.gap,
            power=self.power / 100,
            votes_per_expert=self.votes_per_expert,
            seconds=self.seconds,
            extra_share=(self.repeats + self.checks) / 100,
        )

    def _design(self, *, ties: float) -> StudyDesign:
        return StudyDesign(
            contestants=self.contestants,
            experts=self.experts,
            scenarios=self.scenarios,
            spread=self.spread,
            expert_sd=self.expert_sd,
            scenario_sd=self.scenario_sd,
            tie_share=ties / 100,
            overlap_share=self.overlap / 100,
        )


ESTIMATE_INPUTS = inputs_of(StudyEstimate)
