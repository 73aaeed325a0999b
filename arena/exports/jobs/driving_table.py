"""The mean driving scores of a job or study as a table: what its files and pages show."""

from __future__ import annotations

from dataclasses import dataclass

from augment.services.judging.driving_scores import CLOSE_M, DrivingLine, DrivingScores
from augment.services.scenarios.scenes import type_choices

SOURCE = "reported in the paper"
REPORTED = (
    ("Val14", 0.908),
    ("interPlan", 0.519),
    ("GPT-4o OTM", 0.496),
    ("Gemini-1.5-Flash OTM", 0.535),
    ("Llama3.1-70B OTM", 0.540),
)
"""The paper's table "Mean driving score of PDM-Closed"; nothing of it was measured here."""
DIFFERENCES = (
    (
        "Measured in this project's own simulator, by nuPlan's rules as far as a scene knows "
        "what they need: compare contestants and the effect of a change, not absolute numbers "
        "with the paper's."
    ),
    (
        "Where nobody recorded the ego, progress is measured by an IDM drive at the speed limit "
        "without the change; where the map ends before 15 s, the drive ends there."
    ),
    (
        "Traffic that was not recorded drives its lanes by the IDM; what stands stays; lights "
        "keep the colour that they have at the start."
    ),
)
"""What differs from nuPlan; docs/simulation.md says it at length."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivingTable:
    """The lines and all that must be said with them.

    Attributes:
        with_paper: Whether the paper's rows were asked for, which nobody measured here.
    """

    title: str
    scores: DrivingScores
    with_paper: bool = False

    @property
    def reported(self) -> tuple[tuple[str, float], ...]:
        """The paper's rows, where they were asked for."""
        return REPORTED if self.with_paper else ()

    @property
    def lines(self) -> tuple[DrivingLine, ...]:
        """In the order in which they are shown."""
        return self.scores.lines

    @property
    def simulated(self) -> bool:
        """Whether a contestant in it is simulated."""
        return any(line.is_simulated for line in self.lines)

    @property
    def types(self) -> tuple[tuple[str, str], ...]:
        """Value and label of the scenario types that were driven."""
        driven = {
            kind for line in self.lines for kind, mean in line.by_type.items() if mean is not None
        }
        return tuple((name, label) for name, label in type_choices() if name in driven)

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences that belong beneath every form of it."""
        said = [self._what, *DIFFERENCES]
        for reason, number in self.scores.failures:
            said.append(f"Drives that failed: {number} ({reason}).")
        if self.scores.outlasting:
            said.append(
                f"The recording ends before the drive in {self.scores.outlasting} of "
                f"{self.scores.total} drives: there, who stands stays, who moves goes on along "
                "its lane or straight, and the expert holds the pace of its last second."
            )
        if any(line.close for line in self.lines):
            said.append(
                f"Drives that pass somebody at less than {CLOSE_M:g} m are counted beside the "
                "score, which takes nothing off for them."
            )
        if self.scores.under_way:
            said.append(f"Not complete: {self.scores.under_way} drives wait or run.")
        if self.simulated:
            said.append("Simulated contestants are marked; they say nothing about a real one.")
        return tuple(said)

    @property
    def _what(self) -> str:
        how = self.scores.options
        score = "nuPlan" if self.scores.score == "nuplan" else "interPlan"
        traffic = "reactive" if how.is_reactive else "replayed"
        return (
            f"Mean of {score}'s score over 15 s drives of the planner {how.planner} (offsets: "
            f"{how.offsets}; recorded traffic {traffic}); contestants by how much they lower it."
        )
