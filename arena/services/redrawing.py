"""Which pictures an update of the program draws anew, and which an open study still needs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from arena.models import Study
from augment.models import Scenario
from augment.services.scenarios.redrawing import redraw


@dataclass(frozen=True, slots=True, kw_only=True)
class Redrawn:
    """What was done about one scenario.

    Attributes:
        pictures: How many have been drawn anew.
        needed_by: The open study that shows the old ones, "" for none.
    """

    scenario: str
    pictures: int = 0
    needed_by: str = ""


def redraw_pictures() -> Iterator[Redrawn]:
    """Draw every scenario's pictures in today's window, one scenario after the other.

    A scenario of an open study keeps its pictures until the study is closed: nobody shall see a
    scenario in two windows. Pictures that are as they should be cost a look at their names.

    Raises:
        InvalidDocument: What is stored can't be read.
        InvalidModification: A modification does not fit the scene.
    """
    studies = Study.objects.filter(state=Study.State.OPEN).order_by("pk")
    busy = dict(studies.values_list("scenarios__slug", "name"))
    drawn = Scenario.objects.filter(augmentations__image__gt="").distinct()
    for scenario in drawn.select_related("base_scene").order_by("slug").iterator():
        if scenario.slug in busy:
            yield Redrawn(scenario=scenario.slug, needed_by=busy[scenario.slug])
            continue
        pictures = redraw(scenario)
        if pictures:
            yield Redrawn(scenario=scenario.slug, pictures=pictures)
