"""Which pictures an update of the program draws anew, and which somebody still has to judge."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from arena.models import LabelTask, Study
from augment.errors import AugmentError
from augment.models import Scenario
from augment.services.scenarios.pictures import redraw


@dataclass(frozen=True, slots=True, kw_only=True)
class Redrawn:
    """What was done about one scenario.

    Attributes:
        pictures: How many have been drawn anew.
        fault: Why they could not be drawn, "" where they could.
    """

    scenario: str
    pictures: int = 0
    fault: str = ""

    @property
    def says(self) -> str:
        """One line about it."""
        if self.fault:
            return f"{self.scenario}: kept as they are. {self.fault}"
        return f"{self.scenario}: {self.pictures} drawn anew"


def redraw_pictures() -> Iterator[Redrawn]:
    """Draw every scenario's pictures in today's window, one scenario after the other.

    Open studies go on showing those that they were opened with. What can't be drawn is told, and
    does not stop the others.
    """
    drawn = Scenario.objects.filter(augmentations__image__gt="").distinct().order_by("slug")
    for pk, slug in list(drawn.values_list("pk", "slug")):
        scenario = Scenario.objects.select_related("base_scene").get(pk=pk)
        try:
            if pictures := redraw(scenario):
                yield Redrawn(scenario=slug, pictures=pictures)
        except AugmentError as error:
            yield Redrawn(scenario=slug, fault=str(error))


def find_judged_now(scenario: int) -> str:
    """The open study or labelling that shows its pictures to somebody, empty for none."""
    studies = Study.objects.filter(state=Study.State.OPEN, scenarios=scenario).order_by("pk")
    tasks = LabelTask.objects.filter(
        augmentation__scenario=scenario, label=None, labelling__closed_at=None
    ).order_by("labelling")
    return (
        studies.values_list("name", flat=True).first()
        or tasks.values_list("labelling__name", flat=True).first()
        or ""
    )
