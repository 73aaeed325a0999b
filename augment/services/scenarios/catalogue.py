"""The catalogue: scenes and scenarios that come with the project, from a folder into rows.

Loading it twice changes nothing.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import count
from pathlib import Path
from typing import Any, TypeVar

from django.conf import settings
from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import Q, QuerySet

from augment.benchmark.values import Split
from augment.errors import Conflict, InvalidDocument, InvalidModification, check_names
from augment.formats.documents import read_json
from augment.models import Augmentation, BaseScene, BenchmarkItem, Scenario
from augment.scene import codec
from augment.scene.entities import CatalogueSet, Scene, without_traffic
from augment.scene.intent import IntentOrigin
from augment.services.events import log_change, retire
from augment.services.scenarios import scenes as scene_rows
from augment.services.scenarios.choosing import label_for
from augment.services.texts import check_slug

SOURCE = "authored"
_SHARED = {
    CatalogueSet.MOVING: (CatalogueSet.PAPER, CatalogueSet.HARD),
    CatalogueSet.FOLLOW_UPS: (CatalogueSet.PAPER,),
    CatalogueSet.OPEN: (CatalogueSet.PAPER, CatalogueSet.HARD),
}
"""Sets on scenes of others."""
Problems = list[tuple[str, str]]
Read = TypeVar("Read")


# Files


def set_folder(folder: Path, chosen: CatalogueSet) -> Path:
    """Return where the files of a set lie within a catalogue's folder."""
    return folder if chosen is CatalogueSet.PAPER else folder / chosen.value


def read_catalogue(
    folder: Path, *, scenes_from: Sequence[Path] = ()
) -> tuple[dict[str, Scene], list[codec.CatalogueEntry]]:
    """Return the scenes by name and the scenarios of a folder, each fitting its scene.

    A folder holds `scenes/<name>.json` and `scenarios/<slug>.json`. Of the folders whose scenes
    it shares only those that a scenario names are returned.

    Raises:
        InvalidDocument: The folder holds no catalogue, or files break their format or do not
            fit together; every problem names its file and the path inside it.
    """
    problems: Problems = []
    scenes = _read_files(folder / "scenes", codec.scene_from_document, "name", problems)
    entries = _read_files(folder / "scenarios", codec.entry_from_document, "slug", problems)
    named = {entry.scene for entry in entries.values()}
    for other in scenes_from:
        shared = _read_files(other / "scenes", codec.scene_from_document, "name", problems)
        scenes |= {name: scene for name, scene in shared.items() if name in named}
    if not (scenes or entries or problems):
        problems.append((str(folder), "holds no scenes/*.json and no scenarios/*.json"))
    for entry in entries.values():
        at, scene = f"scenarios/{entry.slug}.json", scenes.get(entry.scene)
        if scene is None:
            text = f"{entry.scene!r} is not in the folder; known: {', '.join(scenes) or 'none'}"
            problems.append((f"{at}: scene", text))
            continue
        try:
            shown = scene if entry.keep_traffic else without_traffic(scene)
            scene_rows.check_reference(shown, entry.reference)
        except (InvalidModification, InvalidDocument) as fault:
            problems.append((f"{at}: reference", str(fault)))
    if problems:
        raise InvalidDocument("catalogue", problems)
    return scenes, list(entries.values())


def _read_files(
    folder: Path, parse: Callable[[object], Read], key: str, problems: Problems
) -> dict[str, Read]:
    """Return the content of a folder's files by name; faults go to the problems."""
    files = {}
    for file in sorted(folder.glob("*.json")):
        at = f"{folder.name}/{file.name}"
        try:
            made = parse(read_json(file, what=folder.name.removesuffix("s")))
            name = getattr(made, key)
            check_slug(name, what="catalogue", key=key)
            if name != file.stem:
                text = f"expected {file.stem!r} as the file is called, got {name!r}"
                raise InvalidDocument("catalogue", [(key, text)])
            files[name] = made
        except InvalidDocument as fault:
            problems += [(f"{at}: {path}" if path else at, text) for path, text in fault.problems]
    return files


# Rows


class CatalogueStep(StrEnum):
    """Result of loading a file that differs from what is stored, or doesn't.

    Of a scenario in use the file becomes a new version beside it (`RENEWED`); of a scene in use
    the stored one stays, with its scenarios (`KEPT`).
    """

    ADDED = "added"
    CHANGED = "changed"
    UNCHANGED = "unchanged"
    RENEWED = "new versions"
    KEPT = "kept"


@dataclass(frozen=True, slots=True, kw_only=True)
class CatalogueReport:
    """Numbers of scenes and scenarios that a loading added, changed and left.

    Attributes:
        kept: Scenarios that stay as they were stored, because their scene has changed and
            something was made from it.
    """

    scenes: Counter[CatalogueStep]
    scenarios: Counter[CatalogueStep]
    kept: tuple[str, ...] = ()


@transaction.atomic
def load_catalogue(
    *,
    folder: Path | None = None,
    actor: User | None = None,
    sets: Sequence[str] = (CatalogueSet.PAPER,),
    with_paraphrases: bool = False,
) -> CatalogueReport:
    """Bring the rows in line with the files, all of them or none; twice changes nothing.

    Rows whose file is gone stay. So does a scenario of which augmentations were made or that a
    benchmark hands out: if its file has changed it is retired, and a new version with a slug of
    its own (`SLUG-v2`) stands beside it. A scene stays with all its scenarios once something was
    made on it, and the report names them.

    Args:
        folder: Holds `scenes` and `scenarios`, and those of the other sets in folders of
            their names; None for what comes with the project.
        actor: Who did it.
        sets: Which parts of it.
        with_paraphrases: Whether every paraphrase becomes a scenario of its own beside the one
            that it says in other words, with the same intent and reference.

    Raises:
        UnknownName: There is no such set.
        InvalidDocument: The folder holds no catalogue, or files break their format or do not
            fit together; every problem names its file and the path inside it.
        Conflict: A slug belongs to a row from elsewhere.
    """
    check_names("set", sets, CatalogueSet)
    scene_steps: dict[str, CatalogueStep] = {}
    steps: dict[str, CatalogueStep] = {}
    for which in map(CatalogueSet, sets):
        place = folder or settings.BASE_DIR / "fixtures"
        sharing = _SHARED.get(which, ())
        scenes, entries = read_catalogue(
            set_folder(place, which),
            scenes_from=[set_folder(place, other_set) for other_set in sharing],
        )
        scene_steps |= {name: _store_scene(scene, actor) for name, scene in scenes.items()}
        for entry in entries:
            if scene_steps[entry.scene] is CatalogueStep.KEPT:
                steps[entry.slug] = CatalogueStep.KEPT
                continue
            steps[entry.slug] = _store_scenario(entry, which, None, actor)
            if not with_paraphrases:
                continue
            original = _find_newest(entry.slug)
            for number, wording in enumerate(entry.paraphrases, start=1):
                slug, text = f"{entry.slug}-p{number}", wording.text
                worded = replace(entry, slug=slug, instruction=text, language=wording.language)
                steps[slug] = _store_scenario(worded, which, original, actor)
    return CatalogueReport(
        scenes=Counter(scene_steps.values()),
        scenarios=Counter(steps.values()),
        kept=tuple(slug for slug, step in steps.items() if step is CatalogueStep.KEPT),
    )


def _store_scene(scene: Scene, actor: User | None) -> CatalogueStep:
    document = codec.scene_to_document(scene)
    wanted = {
        "document": document,
        "provenance": scene.provenance,
        "content_hash": scene_rows.content_hash(document),
    }
    row, is_new = BaseScene.objects.get_or_create(
        slug=scene.name, defaults=wanted | {"source": SOURCE}
    )
    if row.source != SOURCE:
        raise Conflict(
            f"There is a scene called {row.slug!r} already, from the source {row.source!r}; "
            "the catalogue does not replace it."
        )
    if not is_new:
        if row.document == document:
            return CatalogueStep.UNCHANGED
        is_augmented = Augmentation.objects.filter(scenario__base_scene=row).exists()
        if is_augmented or row.scenarios.filter(catalogue_set="").exists():
            return CatalogueStep.KEPT
        BaseScene.objects.filter(pk=row.pk).update(**wanted)
        row.scenarios.update(original_image="")
    after = {"slug": row.slug, "source": SOURCE}
    log_change(row, "add" if is_new else "change", actor, after=after)
    return CatalogueStep.ADDED if is_new else CatalogueStep.CHANGED


def _store_scenario(
    entry: codec.CatalogueEntry, which: CatalogueSet, original: Scenario | None, actor: User | None
) -> CatalogueStep:
    row, slug, before = _find_newest(entry.slug), entry.slug, entry.follows
    follows = (_find_newest(before) or scene_rows.scenario_named(before)) if before else None
    intent = None if entry.intent is None else codec.intent_to_document(entry.intent)
    columns: dict[str, Any] = {
        "type": entry.type.value,
        "instruction": entry.instruction.strip(),
        "reference": codec.modification_to_document(entry.reference),
        "keep_traffic": entry.keep_traffic,
        "intent": intent,
    }
    own: dict[str, Any] = {
        "catalogue_set": which.value,
        "language": entry.language,
        "paraphrase_of": original,
        "type_label": label_for(entry.type),
    }
    if original is not None:
        own["origin"] = original.origin
    if row is not None:
        if row == follows:
            raise Conflict(f"{row.slug!r} can't follow itself.")
        links = {"base_scene": BaseScene.objects.get(slug=entry.scene), "follows": follows}
        wanted_origin = "" if intent is None else IntentOrigin.AUTHORED.value
        wanted = own | columns | links | {"intent_origin": wanted_origin}
        step = _update_scenario(row, wanted, actor)
        if step is not CatalogueStep.RENEWED:
            return step
        taken = set(Scenario.objects.values_list("slug", flat=True))
        slug = next(name for n in count(2) if (name := f"{entry.slug}-v{n}") not in taken)
        own |= {"origin": row.origin, "retired_at": row.retired_at}
        retire(row, actor=actor)
    new = scene_rows.NewScenario(
        scene=entry.scene,
        slug=slug,
        **columns,
        intent_origin=IntentOrigin.AUTHORED,
        follows=follows.slug if follows else "",
    )
    added = scene_rows.add_scenario(new, actor=actor)
    Scenario.objects.filter(pk=added.pk).update(**own)
    return CatalogueStep.ADDED if row is None else CatalogueStep.RENEWED


def _find_newest(slug: str) -> Scenario | None:
    """Return the newest version of a scenario of the catalogue; the first has the bare slug."""
    is_later = Q(slug__regex=rf"^{slug}-v[0-9]+$") & ~Q(catalogue_set="")
    rows = Scenario.objects.filter(Q(slug=slug) | is_later).select_related("base_scene")
    return rows.order_by("pk").last()


def _update_scenario(row: Scenario, wanted: dict[str, Any], actor: User | None) -> CatalogueStep:
    """Store what has changed, unless that takes a new version."""
    if not row.in_catalogue:
        raise Conflict(
            f"There is a scenario called {row.slug!r} already that is not the catalogue's; "
            "the catalogue does not replace it."
        )
    changed = sorted(name for name, value in wanted.items() if getattr(row, name) != value)
    if not changed:
        return CatalogueStep.UNCHANGED
    # An intent where there was none changes nothing that anybody was shown, asked or handed out.
    seen = set(changed) - {"intent", "intent_origin"}
    of_practice = _handed_out(row).filter(split=Split.PRACTICE)
    is_other = row.intent is not None or seen or of_practice.exists()
    # What it follows comes before it, so it is written anew after a new version of that.
    is_before = wanted["follows"] is not None and wanted["follows"].pk > row.pk
    if is_other and (is_before or row.augmentations.exists() or _handed_out(row).exists()):
        return CatalogueStep.RENEWED
    image = {"original_image": ""} if seen else {}
    Scenario.objects.filter(pk=row.pk).update(**wanted, **image)
    log_change(row, "change", actor, after={"slug": row.slug, "changed": changed})
    return CatalogueStep.CHANGED


def _handed_out(row: Scenario) -> QuerySet[BenchmarkItem]:
    return BenchmarkItem.objects.filter(scenario=row, benchmark__retired_at=None)
