"""The catalogue: scenes and scenarios that come with the project, from a folder into rows.

Loading it twice changes nothing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TypeVar

from django.conf import settings
from django.contrib.auth.models import User
from django.db import transaction

from augment.errors import Conflict, InvalidDocument, InvalidModification, UnknownName
from augment.formats.documents import read_json
from augment.models import Augmentation, BaseScene, Scenario
from augment.scene.codec import (
    CatalogueEntry,
    entry_from_document,
    intent_to_document,
    modification_to_document,
    scene_from_document,
    scene_to_document,
)
from augment.scene.entities import CatalogueSet, Scene, without_traffic
from augment.scene.intent import IntentOrigin
from augment.services.events import log_event
from augment.services.scenarios.scenes import (
    add_scenario,
    check_reference,
    check_slug,
    content_hash,
)

Read = TypeVar("Read")
Problems = list[tuple[str, str]]


def folder_of(folder: Path, one: CatalogueSet) -> Path:
    """Where the files of a set lie within a catalogue's folder."""
    return folder if one is CatalogueSet.PAPER else folder / one.value


def read_catalogue(folder: Path) -> tuple[dict[str, Scene], list[CatalogueEntry]]:
    """The scenes by name and the scenarios of a folder, each fitting its scene.

    Raises:
        InvalidDocument: The folder holds no catalogue, or files break their format or do not
            fit together; every problem names its file and the path inside it.
    """
    problems: Problems = []
    scenes = {
        name: scene
        for name, scene in _read_files(folder / "scenes", "scene", scene_from_document, problems)
        if _is_named(f"scenes/{name}.json", "name", name, scene.name, problems)
    }
    entries = [
        entry
        for name, entry in _read_files(
            folder / "scenarios", "scenario", entry_from_document, problems
        )
        if _is_named(f"scenarios/{name}.json", "slug", name, entry.slug, problems)
    ]
    if not (scenes or entries or problems):
        problems.append((str(folder), "holds no scenes/*.json and no scenarios/*.json"))
    for entry in entries:
        _check_fits(entry, scenes, problems)
    if problems:
        raise InvalidDocument("catalogue", problems)
    return scenes, entries


# Private


def _read_files(
    folder: Path, what: str, parse: Callable[[object], Read], problems: Problems
) -> list[tuple[str, Read]]:
    """What the files of a folder hold, by their names; what can't be read becomes problems."""
    found = []
    for file in sorted(folder.glob("*.json")):
        try:
            found.append((file.stem, parse(read_json(file, what=what))))
        except InvalidDocument as fault:
            at = f"{folder.name}/{file.name}"
            problems += [(f"{at}: {path}" if path else at, text) for path, text in fault.problems]
    return found


def _is_named(at: str, key: str, name: str, given: str, problems: Problems) -> bool:
    try:
        check_slug(given, what="catalogue")
    except InvalidDocument as fault:
        problems += [(f"{at}: {key}", text) for _, text in fault.problems]
        return False
    if given != name:
        problems.append(
            (f"{at}: {key}", f"expected {name!r} as the file is called, got {given!r}")
        )
        return False
    return True


def _check_fits(entry: CatalogueEntry, scenes: dict[str, Scene], problems: Problems) -> None:
    at = f"scenarios/{entry.slug}.json"
    scene = scenes.get(entry.scene)
    if scene is None:
        known = ", ".join(scenes) or "none"
        problems.append((f"{at}: scene", f"{entry.scene!r} is not in the folder; known: {known}"))
        return
    try:
        check_reference(scene if entry.keep_traffic else without_traffic(scene), entry.reference)
    except InvalidModification as fault:
        problems.append((f"{at}: reference", str(fault)))
    except InvalidDocument as fault:
        problems += [(f"{at}: reference.{path}", text) for path, text in fault.problems]


SOURCE = "authored"


@dataclass(frozen=True, slots=True, kw_only=True)
class CatalogueReport:
    """How many rows a loading added, changed and found as they should be.

    Attributes:
        kept: Scenarios whose file has changed and that stay as they were stored, because
            something was made from them or from their scene.
    """

    scenes_added: int
    scenes_changed: int
    scenes_unchanged: int
    scenarios_added: int
    scenarios_changed: int
    scenarios_unchanged: int
    kept: tuple[str, ...] = ()


@transaction.atomic
def load_catalogue(
    *,
    folder: Path,
    actor: User | None = None,
    sets: Sequence[CatalogueSet] = (CatalogueSet.PAPER,),
    with_paraphrases: bool = False,
) -> CatalogueReport:
    """Bring the rows in line with the files, all of them or none.

    Rows whose file is gone stay. So does a scenario of which augmentations were made, and a scene
    with all its scenarios once something was made on it: the stored version is what they were
    made from. The report names them.

    Args:
        folder: Holds `scenes` and `scenarios`, and those of the hard set in `hard`.
        actor: Who did it.
        sets: Which parts of it.
        with_paraphrases: Whether every paraphrase becomes a scenario of its own beside the one
            that it says in other words, with the same intent and reference.

    Raises:
        InvalidDocument: The folder holds no catalogue, or files break their format or do not
            fit together; every problem names its file and the path inside it.
        Conflict: A slug belongs to a row from elsewhere.
    """
    read = {one: read_catalogue(folder_of(folder, one)) for one in sets}
    scene_steps = {
        name: _store_scene(scene, actor)
        for scenes, _ in read.values()
        for name, scene in scenes.items()
    }
    scenario_steps: dict[str, _Step] = {}
    for one, (_, entries) in read.items():
        for entry in entries:
            is_kept = scene_steps[entry.scene] is _Step.KEPT
            step = _Step.KEPT if is_kept else _store_scenario(entry, one, actor)
            scenario_steps[entry.slug] = step
            if with_paraphrases and step is not _Step.KEPT:
                scenario_steps |= _store_paraphrases(entry, one, actor)
    of_scenes, of_scenarios = Counter(scene_steps.values()), Counter(scenario_steps.values())
    return CatalogueReport(
        scenes_added=of_scenes[_Step.ADDED],
        scenes_changed=of_scenes[_Step.CHANGED],
        scenes_unchanged=of_scenes[_Step.UNCHANGED],
        scenarios_added=of_scenarios[_Step.ADDED],
        scenarios_changed=of_scenarios[_Step.CHANGED],
        scenarios_unchanged=of_scenarios[_Step.UNCHANGED],
        kept=tuple(slug for slug, step in scenario_steps.items() if step is _Step.KEPT),
    )


def load_own_catalogue(
    *, sets: Sequence[str], with_paraphrases: bool = False, actor: User
) -> CatalogueReport:
    """What comes with the project, by the names of its sets; see `load_catalogue`.

    Raises:
        UnknownName: There is no such set.
    """
    known = [one.value for one in CatalogueSet]
    for name in sets:
        if name not in known:
            raise UnknownName("set", name, known)
    folder = settings.BASE_DIR / "fixtures"
    return load_catalogue(
        folder=folder,
        actor=actor,
        sets=[CatalogueSet(one) for one in sets],
        with_paraphrases=with_paraphrases,
    )


# Private


class _Step(StrEnum):
    """What became of a file; `KEPT` where the stored version is another one and in use."""

    ADDED = "added"
    CHANGED = "changed"
    UNCHANGED = "unchanged"
    KEPT = "kept"


def _store_scene(scene: Scene, actor: User | None) -> _Step:
    document = scene_to_document(scene)
    row, is_new = BaseScene.objects.get_or_create(
        slug=scene.name,
        defaults={
            "document": document,
            "source": SOURCE,
            "provenance": scene.provenance,
            "content_hash": content_hash(document),
        },
    )
    if is_new:
        _log(actor, "add", "scene", row, slug=row.slug, source=SOURCE)
        return _Step.ADDED
    if row.source != SOURCE:
        raise Conflict(
            f"There is a scene called {row.slug!r} already, from the source {row.source!r}; "
            "the catalogue does not replace it."
        )
    if row.document == document:
        return _Step.UNCHANGED
    is_augmented = Augmentation.objects.filter(scenario__base_scene=row).exists()
    if is_augmented or row.scenarios.filter(catalogue_set="").exists():
        return _Step.KEPT
    row.document, row.provenance = document, scene.provenance
    row.content_hash = content_hash(document)
    row.save(update_fields=["document", "provenance", "content_hash"])
    row.scenarios.update(original_image="")
    _log(actor, "change", "scene", row, slug=row.slug, source=SOURCE)
    return _Step.CHANGED


def _store_paraphrases(
    entry: CatalogueEntry, which: CatalogueSet, actor: User | None
) -> dict[str, _Step]:
    original = Scenario.objects.get(slug=entry.slug)
    wordings = [
        replace(
            entry,
            slug=f"{entry.slug}-p{number}",
            instruction=wording.text,
            language=wording.language,
        )
        for number, wording in enumerate(entry.paraphrases, start=1)
    ]
    return {one.slug: _store_scenario(one, which, actor, original) for one in wordings}


def _store_scenario(
    entry: CatalogueEntry,
    which: CatalogueSet,
    actor: User | None,
    original: Scenario | None = None,
) -> _Step:
    row = Scenario.objects.filter(slug=entry.slug).select_related("base_scene").first()
    reference = modification_to_document(entry.reference)
    intent = None if entry.intent is None else intent_to_document(entry.intent)
    if row is None:
        row = add_scenario(
            scene=entry.scene,
            type=entry.type.value,
            instruction=entry.instruction,
            slug=entry.slug,
            reference=reference,
            intent=intent,
            intent_origin=IntentOrigin.AUTHORED,
            keep_traffic=entry.keep_traffic,
            actor=actor,
        )
        row.catalogue_set, row.language = which.value, entry.language
        row.paraphrase_of = original
        row.save(update_fields=["catalogue_set", "language", "paraphrase_of"])
        return _Step.ADDED
    if not row.in_catalogue:
        raise Conflict(
            f"There is a scenario called {row.slug!r} already that is not the catalogue's; "
            "the catalogue does not replace it."
        )
    wanted = {
        "base_scene": BaseScene.objects.get(slug=entry.scene),
        "type": entry.type.value,
        "instruction": entry.instruction.strip(),
        "reference": reference,
        "keep_traffic": entry.keep_traffic,
        "catalogue_set": which.value,
        "language": entry.language,
        "paraphrase_of": original,
        "intent": intent,
        "intent_origin": "" if intent is None else IntentOrigin.AUTHORED.value,
    }
    changed = sorted(name for name, value in wanted.items() if getattr(row, name) != value)
    if not changed:
        return _Step.UNCHANGED
    # An intent where there was none changes nothing that anybody was shown or asked.
    is_new_to_readers = row.intent is not None or set(changed) - {"intent", "intent_origin"}
    if is_new_to_readers and row.augmentations.exists():
        return _Step.KEPT
    for name, value in wanted.items():
        setattr(row, name, value)
    if set(changed) - {"intent", "intent_origin"}:
        row.original_image = ""
    row.save(update_fields=[*wanted, "original_image"])
    _log(actor, "change", "scenario", row, slug=row.slug, changed=changed)
    return _Step.CHANGED


def _log(
    actor: User | None, verb: str, kind: str, row: BaseScene | Scenario, **after: object
) -> None:
    log_event(actor=actor, verb=verb, object_kind=kind, object_code=row.code, after=after)
