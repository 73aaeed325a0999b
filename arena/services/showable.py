"""Which pictures can be shown at all, what is missing, and which windows they show."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable

from django.db.models import QuerySet

from arena.errors import NothingToPlan
from arena.pairing.plan import Entry
from arena.pairing.rules import scenario_of
from augment.models import Augmentation, Contestant, Scenario
from augment.services.scenarios.pictures import window_of

MOST_NAMED = 8
"""So many missing pictures are named, the others counted."""


def find_showable(scenarios: list[Scenario]) -> QuerySet[Augmentation]:
    """Every augmentation of these scenarios that has a picture to judge."""
    return (
        Augmentation.objects.filter(scenario__in=scenarios, state__in=Augmentation.SHOWABLE)
        .exclude(image="")
        .select_related("scenario", "contestant")
        .only(
            *("image", "earlier_images", "sample", "options", "job", "scenario__slug"),
            *("contestant__slug", "contestant__kind"),
        )
    )


def with_picture(row: Augmentation, is_wanted: Callable[[str], bool]) -> Augmentation | None:
    """Return the row with that of its pictures, of today or of before, that is wanted.

    The row's `image` is changed in memory alone; None where no picture of it is wanted.
    """
    names = (row.image, *reversed(row.earlier_images))
    image = next((name for name in names if is_wanted(name)), None)
    if image is None:
        return None
    row.image = image
    return row


def refuse_missing(
    contestants: list[Contestant], scenarios: list[Scenario], cells: Collection[tuple[str, str]]
) -> None:
    """Do nothing where everybody has a picture of every scenario.

    Raises:
        NothingToPlan: Pictures are missing; the text names them.
    """
    missing = [
        f"{contestant.slug} on {scenario.slug}"
        for contestant in contestants
        for scenario in scenarios
        if (scenario.slug, contestant.slug) not in cells
    ]
    if missing:
        raise NothingToPlan(_no_pictures(missing))


def windows_of(entries: Iterable[Entry]) -> dict[str, str]:
    """By scenario, the window that its pictures in a study show: of the first sample, if apart."""
    found: dict[str, str] = {}
    for entry in sorted(entries, key=lambda one: one.scenario):
        found.setdefault(scenario_of(entry.scenario), window_of(entry.picture))
    return found


# --- Private -----------------------------------------------------------------------------------


def _no_pictures(missing: list[str]) -> str:
    if len(missing) <= MOST_NAMED:
        return f"There is no picture yet of {', '.join(missing)}. Generate them first."
    return (
        f"There is no picture yet of {', '.join(missing[:MOST_NAMED])} and "
        f"{len(missing) - MOST_NAMED} more. Generate them first."
    )
