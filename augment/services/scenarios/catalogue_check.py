"""Whether the catalogue's references are what their intents ask for, and can be shown.

Those of the paper set are also held against what a driver expects (`catalogue_rules`).

Reads files, touches no rows.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from augment.checks import Ground
from augment.checks.parties import AUTHORED
from augment.checks.registry import check_against_intent
from augment.geometry.polyline import FloatArray
from augment.prompts.vectors import DEFAULT_RADIUS_M
from augment.render.camera import Camera, camera_for
from augment.scene.codec import CatalogueEntry, intent_to_parts
from augment.scene.entities import CatalogueSet, Scene, without_traffic
from augment.scene.intent_statements import list_statements
from augment.services.scenarios.catalogue import folder_of, read_catalogue
from augment.services.scenarios.catalogue_check import (
    RULES,
    StagedScenario,
    WayPast,
    find_sparse,
    way_past,
)

MOST_ON_ONE_SCENE = 8

FEWEST_PARAPHRASES = 3
"""Of a scenario that has any."""

_NUMBER = re.compile(r"\d+(?:\.\d+)?")
_DECIMAL_COMMA = re.compile(r"(?<=\d),(?=\d)")


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenarioCheck:
    """What was found about one scenario.

    Attributes:
        statements: How many its intent makes; each is held against the reference.
        way_past: By which lane the ego gets past what the reference adds.
        reasons: Why it is not as it should be; empty if all is well.
    """

    slug: str
    statements: int
    way_past: WayPast
    reasons: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class CatalogueCheck:
    """All scenarios of a folder, and what is wrong with the folder as a whole."""

    scenarios: tuple[ScenarioCheck, ...]
    reasons: tuple[str, ...]


def check_catalogue(
    *, folder: Path, sets: Sequence[CatalogueSet] = (CatalogueSet.PAPER,)
) -> CatalogueCheck:
    """Hold every reference against the geometric checks, its intent and its picture.

    Args:
        folder: Holds `scenes` and `scenarios`, and those of the hard set in `hard`.
        sets: Which parts of it.

    Raises:
        InvalidDocument: The folder holds no catalogue, or its files do not fit together.
    """
    read = {one: read_catalogue(folder_of(folder, one)) for one in sets}
    staged = {
        one: [_staged(scenes[entry.scene], entry) for entry in entries]
        for one, (scenes, entries) in read.items()
    }
    paper = staged.get(CatalogueSet.PAPER, [])
    everything = [one.entry for among in staged.values() for one in among]
    return CatalogueCheck(
        scenarios=tuple(_check(one, which) for which, among in staged.items() for one in among),
        reasons=(*_whole(everything), *find_sparse(paper)),
    )


def _staged(whole: Scene, entry: CatalogueEntry) -> StagedScenario:
    scene = whole if entry.keep_traffic else without_traffic(whole)
    return StagedScenario(entry=entry, scene=scene)


def _check(staged: StagedScenario, which: CatalogueSet) -> ScenarioCheck:
    scene, entry = staged.scene, staged.entry
    ground = Ground.of(scene)
    way = way_past(scene, entry.reference)
    if entry.intent is None:
        return ScenarioCheck(
            slug=entry.slug, statements=0, way_past=way, reasons=("it has no intent",)
        )
    reasons = [
        f"{one.severity}: {one.sentence()}"
        for one in check_against_intent(ground, entry.reference, entry.intent, AUTHORED)
        if one.is_fault
    ]
    return ScenarioCheck(
        slug=entry.slug,
        statements=len(list_statements(entry.intent)),
        way_past=way,
        reasons=(
            *reasons,
            *_unheld(entry),
            *_unparaphrased(entry),
            *_refusal(entry),
            *_unseen(scene, entry),
            *_unreached(entry),
            *(_unlikely(staged, way) if which is CatalogueSet.PAPER else ()),
        ),
    )


def _unheld(entry: CatalogueEntry) -> Iterator[str]:
    """Numbers of the sentence or a paraphrase that its intent does not hold."""
    assert entry.intent is not None
    held = set(_numbers_in(intent_to_parts(entry.intent)))
    others = {f"paraphrase {n}": one.text for n, one in enumerate(entry.paraphrases, 1)}
    for what, text in {"the instruction": entry.instruction, **others}.items():
        for number in dict.fromkeys(_NUMBER.findall(_DECIMAL_COMMA.sub(".", text))):
            if float(number) not in held:
                yield f"{what} says {number}, and its intent does not"


def _unparaphrased(entry: CatalogueEntry) -> Iterator[str]:
    """Too few paraphrases, or the same twice."""
    given = [entry.instruction, *(paraphrase.text for paraphrase in entry.paraphrases)]
    if 1 < len(given) <= FEWEST_PARAPHRASES:
        yield f"it has {len(given) - 1} paraphrases; {FEWEST_PARAPHRASES} are the fewest"
    if len({" ".join(one.casefold().split()) for one in given}) < len(given):
        yield "two of its wordings are the same"


def _refusal(entry: CatalogueEntry) -> Iterator[str]:
    """A reference that changes something about a wish that can't be met, or nothing otherwise."""
    assert entry.intent is not None
    if bool(entry.intent.unmet) is not entry.reference.is_empty:
        yield "its reference is empty where the wish can't be met, and there alone"


def _numbers_in(part: Any) -> Iterator[float]:
    if isinstance(part, dict):
        part = list(part.values())
    if isinstance(part, list):
        for one in part:
            yield from _numbers_in(one)
    elif isinstance(part, (int, float)) and not isinstance(part, bool):
        yield abs(float(part))


def _unseen(scene: Scene, entry: CatalogueEntry) -> Iterator[str]:
    camera = camera_for(scene, entry.reference)
    for agent in entry.reference.changed:
        points = agent.box.corners_m
        if agent.walk_to_m is not None:
            points = np.vstack([points, [agent.walk_to_m]])
        if not _holds(camera, points):
            yield f"{agent.id} is not wholly inside the picture"


def _unreached(entry: CatalogueEntry) -> Iterator[str]:
    """Places that prompts don't show and answers may not name."""
    for agent in entry.reference.changed:
        points = [(agent.x_m, agent.y_m), agent.walk_to_m or (0.0, 0.0)]
        if max(abs(value) for point in points for value in point) > DEFAULT_RADIUS_M:
            yield f"{agent.id} lies further than {DEFAULT_RADIUS_M:g} m off, which no prompt shows"


def _unlikely(staged: StagedScenario, way: WayPast) -> Iterator[str]:
    """What no driver would expect to meet."""
    for rule in RULES:
        yield from rule(staged)
    if way is WayPast.NONE:
        yield "it leaves no way past"


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
