"""What all showings of a scenario share: one window for both sides, and the scene before."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from django.db.models import Min, Q

from arena.errors import NothingToPlan
from arena.models import Matchup, Study
from arena.pairing.plan import PlannedMatchup
from arena.pairing.rules import scenario_of
from arena.queries.voting.showings import VIEW_OF_OLD
from augment.models import Augmentation, Scenario
from augment.services.scenarios.pictures import camera_of, view_of, window_of

Cells = dict[tuple[str, str], Augmentation]
"""By place (a scenario, or one sample of it) and contestant, the augmentation that is shown."""

MOST_NAMED = 8
"""So many missing pictures are named, the others counted."""


@dataclass(frozen=True, slots=True)
class ScenarioFrame:
    """What all showings of a scenario share: where metres lie, the scene before any change."""

    view: dict[str, Any]
    original_image: str


FramesShown = dict[tuple[str, str], ScenarioFrame]
"""By scenario and window, what a study's showings have already."""


def find_frames(
    planned: Sequence[PlannedMatchup],
    cells: Cells,
    places: dict[str, Scenario],
    shown_before: FramesShown,
) -> dict[str, ScenarioFrame]:
    """By scenario; both sides of every pair are drawn in one window, or nothing is planned.

    Args:
        planned: What is to be shown.
        cells: The pictures.
        places: The scenarios by slug.
        shown_before: Of the study; what is known so is not worked out from the scene again.

    Raises:
        NothingToPlan: Some are of an earlier version, or of before the reference was changed; or
            nobody knows any more where metres lie in them.
    """
    shown: dict[str, dict[str, Augmentation]] = {}
    for one in planned:
        for cell in sides_of(one, cells):
            shown.setdefault(one.scenario, {})[window_of(cell.image)] = cell
    mixed = [scenario_of(name) for name, windows in sorted(shown.items()) if len(windows) > 1]
    if mixed:
        raise _other_windows(mixed)
    return {
        name: shown_before.get((scenario_of(name), next(iter(windows))))
        or _frame(places[scenario_of(name)], *windows.popitem())
        for name, windows in shown.items()
    }


def frames_shown(study: Study, scenarios: Iterable[str]) -> FramesShown:
    """Those of the first showing of each scenario; without the scene before, it is none.

    To read a scene takes longer than all else that planning for one more expert does.
    """
    first = (
        study.matchups.filter(scenario__slug__in=set(scenarios), view__isnull=False)
        .order_by()
        .values("scenario")
        .annotate(first=Min("pk"))
    )
    rows = Matchup.objects.filter(pk__in=[row["first"] for row in first])
    names = ("scenario__slug", "left_image", "view", "original_image")
    return {
        (slug, window_of(image)): ScenarioFrame(view, original)
        for slug, image, view, original in rows.values_list(*names)
        if original and view
    }


def _frame(place: Scenario, window: str, cell: Augmentation) -> ScenarioFrame:
    """As the pictures need it, whatever version drew them: today's window, or one shown before.

    Raises:
        NothingToPlan: Nobody knows any more where metres lie in such a picture.
    """
    if window in place.windows:
        noted = place.windows[window]
        return ScenarioFrame(noted["view"], noted["image"])
    original = place.original_image if window_of(place.original_image) == window else ""
    camera = camera_of(place)
    if window == camera.key:
        return ScenarioFrame(view_of(camera), original)
    shows = Q(left_image=cell.image) | Q(right_image=cell.image)
    earlier = Matchup.objects.filter(shows, scenario=place, view__isnull=False)
    before = earlier.order_by("pk").first()
    if before is not None and before.view is not None:
        return ScenarioFrame(before.view, before.original_image)
    if window:
        raise _other_windows([place.slug])
    return ScenarioFrame(VIEW_OF_OLD, original)


def _other_windows(scenarios: list[str]) -> NothingToPlan:
    return NothingToPlan(
        f"The pictures of {', '.join(scenarios[:MOST_NAMED])} show different windows, so "
        "they can’t stand side by side. They are drawn anew when the program starts; restart "
        "it, or choose other scenarios."
    )


def sides_of(one: PlannedMatchup, cells: Cells) -> tuple[Augmentation, Augmentation]:
    """What is shown on the left and on the right."""
    return cells[one.scenario, one.left], cells[one.scenario, one.right]
