"""Pictures of a study's pairs, drawn by workers after its opening, each in the pair's window."""

import logging
import math
import time
from collections.abc import Collection, Generator
from contextlib import closing
from typing import Any, cast

from django.db.models import QuerySet

from arena.models import Matchup, Study
from arena.voting.queries.ballots import find_undrawn
from arena.voting.queries.showings import LEGEND
from augment.errors import AugmentError
from augment.services.clock import database_now
from augment.services.scenarios import draw_pair, load_camera, picture_view

logger = logging.getLogger(__name__)

MB_PER_PAIR = 0.1
"""Three pictures and their films: 45 to 115 kB in the catalogue."""
_CLAIM_S = 120.0


def draw_pictures(study: Study, *, within_s: float = math.inf) -> bool:
    """Draw what is not drawn yet, the first positions first; several workers may do so at once.

    Returns:
        Whether any is left after that time; one that can't be drawn is logged and left.
    """
    ends_at = time.monotonic() + within_s
    while (row := _claim(study)) is not None:
        try:
            _draw(row)
        except AugmentError:
            logger.exception("The pictures of pair %s can't be drawn.", row.code)
        if time.monotonic() >= ends_at:
            return find_undrawn(study).exists()
    return False


def show_own_pictures(study: Study, *, pairs: int | None = None) -> None:
    """Have each expert's first pairs, or all, show the pictures that their answers have.

    They are of a window that holds all answers to a scenario, wider than what voters will see.
    """
    views: dict[int, dict[str, Any]] = {}
    rows = (
        find_undrawn(study) if pairs is None else find_undrawn(study).filter(position__lte=pairs)
    )
    for row in rows.select_related("left", "right", "scenario__base_scene"):
        view = views.setdefault(row.scenario_id, {}) or picture_view(load_camera(row.scenario))
        views[row.scenario_id] = view
        row.left_image, row.right_image = row.left.image, row.right.image
        row.original_image, row.view = row.scenario.original_image, view
        row.save(update_fields=["left_image", "right_image", "original_image", "view"])


# Private


def _claim(study: Study) -> Matchup | None:
    """Return a pair that nobody draws; who loses a claim by its age draws the same once more."""
    lost = set[int]()
    while (row := _first_free(study, lost)) is not None:
        own = Matchup.objects.filter(pk=row.pk, view=row.view)
        if own.update(view={"since": database_now().timestamp()}):
            return row
        lost.add(row.pk)
    return None


def _first_free(study: Study, lost: Collection[int]) -> Matchup | None:
    """Return the first pair that is not drawn and not claimed, of those that were not lost."""
    now = database_now().timestamp()
    rows = find_undrawn(study).order_by("position", "pk").only("code", "view")
    # SQLite refuses a write while this connection still reads what others have changed since.
    undrawn = cast(Generator[Matchup, None, None], rows.iterator(chunk_size=50))
    with closing(undrawn):
        for row in undrawn:
            is_claimed = 0.0 <= now - (row.view or {}).get("since", 0.0) <= _CLAIM_S
            if row.pk not in lost and not is_claimed:
                return row
    return None


def _draw(row: Matchup) -> None:
    """Draw a pair, for every showing of it."""
    sides: QuerySet[Matchup] = Matchup.objects.select_related(
        "left__scenario__base_scene", "right", "study"
    ).defer("left__scenario__base_scene__recording")
    pair = sides.get(pk=row.pk)
    has_ticks = bool(pair.study.rules.get("show_ticks"))
    pictures = draw_pair(pair.left, pair.right, has_ticks=has_ticks)
    legend = {"scene": pictures.scene_legend, "pair": pictures.pair_legend}
    for left, right in ((pair.left_id, pair.right_id), (pair.right_id, pair.left_id)):
        find_undrawn(pair.study).filter(left=left, right=right).update(
            left_image=pictures.names[left],
            right_image=pictures.names[right],
            original_image=pictures.original,
            view=pictures.view | {LEGEND: legend},
        )
