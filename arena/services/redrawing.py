"""Which pictures an update of the program draws anew, and which somebody still has to judge."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from arena.models import LabelTask, Study
from augment.errors import AugmentError
from augment.models import Scenario
from augment.services.scenarios.redrawing import is_outdated, redraw


@dataclass(frozen=True, slots=True, kw_only=True)
class Redrawn:
    """What was done about one scenario.

    Attributes:
        pictures: How many have been drawn anew.
        needed_by: The open study or labelling that shows the old ones, "" for none.
        fault: Why they could not be drawn, "" where they could.
    """

    scenario: str
    pictures: int = 0
    needed_by: str = ""
    fault: str = ""

    @property
    def says(self) -> str:
        """One line about it."""
        if self.fault:
            return f"{self.scenario}: kept as they are. {self.fault}"
        if self.needed_by:
            return f"{self.scenario}: kept, {self.needed_by!r} is open and shows them"
        return f"{self.scenario}: {self.pictures} drawn anew"


def redraw_pictures() -> Iterator[Redrawn]:
    """Draw every scenario's pictures in today's window, one scenario after the other.

    A scenario of an open study, or of a labelling with pictures to label, keeps its pictures until
    that is over: nobody shall see a scenario in two windows. Whoever opens one meanwhile keeps
    them too. What can't be drawn is told, and does not stop the others. Pictures that are as
    they should be cost a look at their names.
    """
    drawn = Scenario.objects.filter(augmentations__image__gt="").distinct().order_by("slug")
    for pk, slug in list(drawn.values_list("pk", "slug")):
        found = _redrawn(pk, slug)
        if found.pictures or found.needed_by or found.fault:
            yield found


def _redrawn(pk: int, slug: str) -> Redrawn:
    scenario = Scenario.objects.select_related("base_scene").get(pk=pk)
    try:
        if not is_outdated(scenario):
            return Redrawn(scenario=slug)
        if needed_by := find_judged_now(pk):
            return Redrawn(scenario=slug, needed_by=needed_by)
        pictures = redraw(scenario, is_free=lambda: not find_judged_now(pk))
    except AugmentError as error:
        return Redrawn(scenario=slug, fault=str(error))
    if pictures is None:
        return Redrawn(scenario=slug, needed_by=find_judged_now(pk))
    return Redrawn(scenario=slug, pictures=pictures)


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
