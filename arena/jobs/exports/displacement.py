"""The displacement errors of a job as a table: what its files, chart and page show."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from augment.models import GenerationJob
from augment.services.judging.displacement import (
    PLACED_EXACTLY,
    By,
    Group,
    Measured,
    groups,
    of_job,
)
from augment.services.scenarios.scenes import ScenarioType, in_type_order

SOURCE = "read from the paper's figure"


class PublishedBox(NamedTuple):
    """One box of the paper's figure "Displacement error by variant", in metres."""

    model: str
    variant: str
    q1_m: float
    median_m: float
    q3_m: float
    high_m: float


BY_VARIANT = (
    PublishedBox("GPT-4o", "OTM", 1.2, 1.5, 2.1, 2.9),
    PublishedBox("Gemini-1.5-Flash", "OTM", 1.0, 1.4, 3.9, 5.2),
    PublishedBox("Llama3.1-70B", "OTM", 0.9, 2.7, 7.3, 9.7),
    PublishedBox("GPT-4o", "FC", 0.3, 0.5, 1.2, 1.9),
    PublishedBox("Gemini-1.5-Flash", "FC", 0.2, 0.4, 0.8, 1.8),
    PublishedBox("Llama3.1-70B", "FC", 0.3, 0.7, 1.4, 1.8),
    PublishedBox("GPT-4o", "tQA", 1.1, 1.4, 2.4, 3.9),
    PublishedBox("Gemini-1.5-Flash", "tQA", 0.6, 1.0, 2.4, 4.8),
    PublishedBox("Llama3.1-70B", "tQA", 0.9, 1.4, 3.2, 4.2),
    PublishedBox("Gemini-1.5-Flash", "vQA", 0.9, 1.3, 2.9, 4.8),
)
"""Read from the paper's box plot by eye, to a tenth of a metre; nothing was measured here. Lower
whiskers can't be told apart there, means and numbers of objects are not given."""

PAPERS_CHOICE = (
    "As in the paper, construction zone and accident site are left out: their objects can lie in "
    "many places that all follow the instruction."
)
SIMULATED_NOTE = "Simulated contestants are marked; they say nothing about a real one."


@dataclass(frozen=True, slots=True, kw_only=True)
class DisplacementTable:
    """A job's groups in order, and all that must be said with them.

    Attributes:
        types: The scenario types that count, by their names.
        measured: Every row of the job, for whoever wants the single values.
        left_out: Augmentations without a displacement, by reason.
        published: The paper's boxes to stand beside, empty where they answer another question.
    """

    job: str
    by: By
    types: tuple[str, ...]
    groups: tuple[Group, ...]
    measured: tuple[Measured, ...]
    left_out: dict[str, int]
    published: tuple[PublishedBox, ...]

    @property
    def simulated(self) -> bool:
        """Whether a contestant in it is simulated."""
        return any(group.is_simulated for group in self.groups)

    @property
    def types_text(self) -> str:
        """Which scenario types count, in words."""
        if self.types == tuple(ScenarioType):
            return "All five scenario types"
        own = {one.row.scenario.type: one.row.scenario.type_label for one in self.measured}
        known = own | {one.value: str(one.label) for one in ScenarioType}
        labels = tuple(known[name] for name in self.types)
        return f"Scenario types: {', '.join(labels)}"

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences that belong beneath every form of it."""
        return (f"{self.types_text}.", *self.remarks)

    @property
    def remarks(self) -> tuple[str, ...]:
        """The same but for the scenario types."""
        unmeasured = (
            f"Augmentations not measured: {number} ({reason})."
            for reason, number in self.left_out.items()
        )
        return (
            "Distances between centres, in metres, of objects matched within their class so that "
            "their sum is smallest; each matched object counts once.",
            "Missing and surplus objects are counted and have no distance; an unreadable or "
            "refused answer misses all.",
            *([PAPERS_CHOICE] if self.published else []),
            *unmeasured,
            *([SIMULATED_NOTE] if self.simulated else []),
        )


def displacement_table(
    job: GenerationJob, *, by: By, types: Sequence[str] | None = None
) -> DisplacementTable:
    """Return the table of a job; one query.

    Args:
        job: Whose augmentations are measured.
        by: What to group by, beside the contestant.
        types: The scenario types that count; None for the paper's choice: by variant those whose
            places are definite, else all.
    """
    measured = of_job(job)
    every = tuple(in_type_order([*ScenarioType, *(one.row.scenario.type for one in measured)]))
    if types is None:
        types = PLACED_EXACTLY if by is By.VARIANT else every
    chosen = tuple(one for one in every if one in set(types))
    left_out = Counter(one.why_not.value for one in measured if one.why_not is not None)
    return DisplacementTable(
        job=job.name,
        by=by,
        types=chosen,
        groups=tuple(groups(measured, by=by, types=chosen)),
        measured=tuple(one for one in measured if one.row.scenario.type in chosen),
        left_out=dict(sorted(left_out.items())),
        published=BY_VARIANT if by is By.VARIANT and set(chosen) == set(PLACED_EXACTLY) else (),
    )
