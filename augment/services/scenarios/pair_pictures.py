"""Pictures of a pair: both sides and the scene before, in a window of the pair's own."""

from dataclasses import dataclass
from typing import Any

from augment.metrics.displacement import find_shifts
from augment.models import Augmentation
from augment.render.camera import Camera
from augment.render.legend import change_keys, scene_keys
from augment.render.pair_window import covered_boxes, pair_camera
from augment.scene.entities import Modification
from augment.scene.intent import Intent, Relation
from augment.services.scenarios.pictures import draw_picture, find_modification, picture_view
from augment.services.scenarios.scenes import LoadedScenario


@dataclass(frozen=True, slots=True, kw_only=True)
class PairPictures:
    """What is shown of a pair.

    Attributes:
        names: Of the pictures, by the key of their augmentation.
        original: The scene before any change.
        view: Where metres lie, and `covered_px`: boxes over the ground.
        scene_legend: The legend's entries of the scene before.
        pair_legend: Those that either side adds.
    """

    names: dict[int, str]
    original: str
    view: dict[str, Any]
    scene_legend: list[str]
    pair_legend: list[str]


def draw_pair(
    first: Augmentation, other: Augmentation, *, has_ticks: bool = False
) -> PairPictures:
    """Draw two answers to one scenario, the same whichever comes first.

    It takes some tenths of a second: call it from a worker or a command, not in a request.

    Args:
        first: One side; its scenario is loaded with its scene.
        other: Of the same scenario.
        has_ticks: Whether distances that the instruction names are marked on the ego's lane.

    Raises:
        InvalidDocument: What is stored can't be read.
        InvalidModification: A change does not fit the scene.
    """
    loaded, sides, camera = frame_pair(first, other, has_ticks=has_ticks)
    view, scene = picture_view(camera), loaded.scene
    covered = [[round(edge) for edge in box] for box in covered_boxes(scene, camera, sides)]
    rows = zip((first, other), sides, strict=True)
    return PairPictures(
        names={row.pk: draw_picture(loaded, side, camera) for row, side in rows},
        original=draw_picture(loaded, Modification(), camera),
        view=view | {"covered_px": covered},
        scene_legend=sorted(scene_keys(scene, view)),
        pair_legend=sorted(set().union(*(change_keys(side, view) for side in sides))),
    )


def frame_pair(
    first: Augmentation, other: Augmentation, *, has_ticks: bool = False
) -> tuple[LoadedScenario, tuple[Modification, Modification], Camera]:
    """Return the scenario of a pair, both changes and their window; as `draw_pair`."""
    loaded = LoadedScenario(first.scenario)
    sides = find_modification(first), find_modification(other)
    shown = [change for change in (loaded.reference, *sides) if change is not None]
    shifts = [shift for shift in find_shifts(*sides) or () if shift.metres > 0.0]
    camera = pair_camera(
        loaded.ground,
        sides,
        intent=loaded.intent,
        is_filmed=any(change.has_motion for change in shown),
        differing=tuple((shift.one, shift.other, shift.metres) for shift in shifts),
        ticks_m=list_distances(loaded.intent) if has_ticks else (),
    )
    return loaded, sides, camera


def list_distances(intent: Intent | None) -> tuple[float, ...]:
    """Return the metres ahead of the ego that an instruction names, sorted; behind it negative."""
    asks = (*intent.requests, *intent.moves) if intent else ()
    # Only what counts from the ego itself.
    own = [
        (spot.distance, -1.0 if spot.relation is Relation.BEHIND else 1.0)
        for spot in (ask.spot for ask in asks)
        if spot.distance
        and spot.relation
        and not (spot.anchor or spot.landmark or spot.mark or spot.via)
    ]
    return tuple(sorted({sign * at_m for at, sign in own for at_m in (at.low_m, at.high_m)}))
