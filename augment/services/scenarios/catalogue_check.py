"""Whether the catalogue's references are what their intents ask for, and can be shown.

Reads files, touches no rows.
"""

import json
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from augment.checks import Ground
from augment.checks.parties import AUTHORED
from augment.checks.registry import check_against_intent
from augment.prompts.vectors import DEFAULT_RADIUS_M
from augment.render.camera import camera_for
from augment.scene.codec import CatalogueEntry, intent_to_parts
from augment.scene.entities import CatalogueSet, Scene, without_traffic
from augment.scene.intent_statements import list_statements
from augment.services.scenarios.catalogue import folder_of, read_catalogue

MOST_ON_ONE_SCENE = 8
FEWEST_PARAPHRASES = 3
"""Of a scenario that has any."""
_NUMBER = re.compile(r"\d+(?:\.\d+)?")


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenarioCheck:
    """What was found about one scenario.

    Attributes:
        statements: How many its intent makes; each is held against the reference.
        reasons: Why it is not as it should be; empty if all is well.
    """

    slug: str
    statements: int
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
    checks, entries = [], []
    for which in sets:
        scenes, of_set = read_catalogue(folder_of(folder, which))
        for entry in of_set:
            scene = scenes[entry.scene]
            checks.append(_check(entry, scene if entry.keep_traffic else without_traffic(scene)))
        entries += of_set
    return CatalogueCheck(scenarios=tuple(checks), reasons=tuple(_find_alike(entries)))


def _check(entry: CatalogueEntry, scene: Scene) -> ScenarioCheck:
    if entry.intent is None:
        return ScenarioCheck(slug=entry.slug, statements=0, reasons=("it has no intent",))
    findings = check_against_intent(Ground.of(scene), entry.reference, entry.intent, AUTHORED)
    reasons = [f"{one.severity}: {one.sentence()}" for one in findings if one.is_fault]
    reasons += [*_find_wrong_words(entry), *_find_unseen(entry, scene)]
    if bool(entry.intent.unmet) is not entry.reference.is_empty:
        reasons.append("its reference is empty where the wish can't be met, and there alone")
    statements = len(list_statements(entry.intent))
    return ScenarioCheck(slug=entry.slug, statements=statements, reasons=tuple(reasons))


def _find_wrong_words(entry: CatalogueEntry) -> Iterator[str]:
    """Numbers that the intent does not hold; too few paraphrases, or the same twice."""
    assert entry.intent is not None
    held = {abs(float(one)) for one in _NUMBER.findall(json.dumps(intent_to_parts(entry.intent)))}
    wordings = {"the instruction": entry.instruction}
    wordings |= {f"paraphrase {n}": one.text for n, one in enumerate(entry.paraphrases, 1)}
    for what, text in wordings.items():
        decimal = re.sub(r"(?<=\d),(?=\d)", ".", text)
        for number in dict.fromkeys(_NUMBER.findall(decimal)):
            if float(number) not in held:
                yield f"{what} says {number}, and its intent does not"
    if 0 < len(entry.paraphrases) < FEWEST_PARAPHRASES:
        yield f"it has {len(entry.paraphrases)} paraphrases; {FEWEST_PARAPHRASES} are the fewest"
    if len({" ".join(one.casefold().split()) for one in wordings.values()}) < len(wordings):
        yield "two of its wordings are the same"


def _find_unseen(entry: CatalogueEntry, scene: Scene) -> Iterator[str]:
    """What lies outside of the picture, or where prompts don't show and answers may not name."""
    camera = camera_for(scene, entry.reference)
    for agent in entry.reference.changed:
        places_m = np.array([(agent.x_m, agent.y_m), agent.walk_to_m or (agent.x_m, agent.y_m)])
        pixels = camera.to_pixels(np.vstack([agent.box.corners_m, places_m]))
        if (pixels < 0.0).any() or (pixels > [camera.width_px, camera.height_px]).any():
            yield f"{agent.id} is not wholly inside the picture"
        if np.abs(places_m).max() > DEFAULT_RADIUS_M:
            yield f"{agent.id} lies further than {DEFAULT_RADIUS_M:g} m off, which no prompt shows"


def _find_alike(entries: list[CatalogueEntry]) -> Iterator[str]:
    for scene, number in sorted(Counter(entry.scene for entry in entries).items()):
        if number > MOST_ON_ONE_SCENE:
            yield f"{scene} carries {number} scenarios, more than {MOST_ON_ONE_SCENE}"
    bare: dict[str, str] = {}
    for entry in entries:
        words = _NUMBER.sub("#", entry.instruction.casefold())
        if words in bare:
            yield f"{entry.slug} and {bare[words]} differ by numbers alone"
        bare[words] = entry.slug
