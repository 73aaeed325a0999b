"""Whether the catalogue's references are what their instructions say, and can be shown.

Reads files, touches no rows.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from augment.checks import Ground, Severity
from augment.checks.against_intent import judged
from augment.checks.claims import broken
from augment.checks.intent_claims import claims_of
from augment.errors import InstructionNotUnderstood
from augment.geometry.boxes import corners
from augment.geometry.polyline import FloatArray
from augment.instruction import parse
from augment.render.camera import Camera, camera_for
from augment.scene.catalogue_codec import CatalogueEntry
from augment.scene.entities import Scene
from augment.scene.modification import without_traffic
from augment.services.catalogue import read_catalogue

MOST_ON_ONE_SCENE = 8

_NUMBER = re.compile(r"\d+(?:\.\d+)?")


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenarioCheck:
    """What was found about one scenario.

    Attributes:
        claims: How many statements of its author's were held against the reference.
        understood: How many statements the grammar read, None where it refused the sentence.
        reasons: Why it is not as it should be; empty if all is well.
    """

    slug: str
    claims: int
    understood: int | None
    reasons: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class CatalogueCheck:
    """All scenarios of a folder, and what is wrong with the folder as a whole."""

    scenarios: tuple[ScenarioCheck, ...]
    reasons: tuple[str, ...]


def check_catalogue(*, folder: Path) -> CatalogueCheck:
    """Hold every reference against the geometric checks, its sentence and its picture.

    Args:
        folder: Holds `scenes` and `scenarios`.

    Raises:
        InvalidDocument: The folder holds no catalogue, or its files do not fit together.
    """
    scenes, entries = read_catalogue(folder)
    checked = tuple(_check(scenes[entry.scene], entry) for entry in entries)
    return CatalogueCheck(scenarios=checked, reasons=tuple(_whole(entries)))


def _check(whole: Scene, entry: CatalogueEntry) -> ScenarioCheck:
    scene = whole if entry.keep_traffic else without_traffic(whole)
    ground = Ground.of(scene)
    try:
        intent = parse(entry.instruction)
    except InstructionNotUnderstood:
        intent = None  # its author's claims alone count then
    reasons = [
        f"{one.severity}: {one.sentence()}"
        for one in judged(ground, entry.reference, intent)
        # What is doubtful may be what was asked for, where nobody knows what that is.
        if one.severity is Severity.WRONG or (one.is_fault and intent is not None)
    ]
    reasons += [str(one) for one in broken(ground, entry.reference, entry.claims)]
    reasons += [*_unclaimed(entry), *_unseen(scene, entry)]
    understood = None
    if intent is not None:
        read = claims_of(intent, entry.reference, scene.traffic_side)
        understood = len(read)
        reasons += [
            f"read from the sentence: {one}" for one in broken(ground, entry.reference, read)
        ]
    return ScenarioCheck(
        slug=entry.slug,
        claims=len(entry.claims),
        understood=understood,
        reasons=tuple(reasons),
    )


def _unclaimed(entry: CatalogueEntry) -> Iterator[str]:
    """Numbers of the sentence that no claim holds."""
    held = {abs(claim.value) for claim in entry.claims}
    for number in dict.fromkeys(_NUMBER.findall(entry.instruction)):
        if float(number) not in held:
            yield f"the instruction says {number}, and no claim does"


def _unseen(scene: Scene, entry: CatalogueEntry) -> Iterator[str]:
    camera = camera_for(scene, entry.reference)
    for agent in entry.reference.changed:
        points = corners(agent.pose, agent.length_m, agent.width_m)
        if agent.walk_to_m is not None:
            points = np.vstack([points, [agent.walk_to_m]])
        if not _holds(camera, points):
            yield f"{agent.id} is not wholly inside the picture"


def _holds(camera: Camera, points_m: FloatArray) -> bool:
    pixels = camera.to_pixels(points_m)
    return bool((pixels >= 0.0).all() and (pixels <= [camera.width_px, camera.height_px]).all())


def _whole(entries: list[CatalogueEntry]) -> Iterator[str]:
    for scene, number in sorted(Counter(entry.scene for entry in entries).items()):
        if number > MOST_ON_ONE_SCENE:
            yield f"{scene} carries {number} scenarios, more than {MOST_ON_ONE_SCENE}"
    bare: dict[str, str] = {}
    for entry in entries:
        words = _NUMBER.sub("#", entry.instruction.casefold())
        if words in bare:
            yield f"{entry.slug} and {bare[words]} differ by numbers alone"
        bare[words] = entry.slug
