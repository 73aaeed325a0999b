"""A job's modifications as interPlan's file, and interPlan's scenarios on nuPlan's logs.

A folder holds interPlan's modification file and nuPlan's logs and maps, wherever in it. Each base
token becomes a scene, each of its special scenarios a scenario with its human reference; what is
stored already stays.
"""

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from django.contrib.auth.models import User
from pydantic import BaseModel

from augment.errors import AugmentError, Conflict, InvalidDocument, UnknownName
from augment.formats.apart import UntrustedInput
from augment.formats.documents import MAX_CHARACTERS, read_yaml_file
from augment.formats.interplan.file import (
    WHAT,
    Details,
    File,
    InterplanSource,
    SpecialScenario,
    file_of,
    goal_place,
    options_of,
    place_of,
    read_entry,
    traffic_of,
)
from augment.formats.interplan.intent import describe_reference
from augment.formats.interplan.writer import interplan_text
from augment.formats.nuplan_log import NuPlan
from augment.formats.writing import Cell, Loss
from augment.models import Augmentation, BaseScene, GenerationJob, Scenario
from augment.scene.codec import (
    intent_to_document,
    modification_from_document,
    modification_to_document,
)
from augment.scene.entities import Scene, SceneOptions, without_traffic
from augment.scene.intent import IntentOrigin
from augment.scene.recording import Note, SceneNoteKind
from augment.services.scenarios.scene_imports import keep_reading
from augment.services.scenarios.scenes import Circumstances, add_scenario, scene_of, type_of

_MOST_LISTED = 12
_KEY = "modification_details_dictionary"
_COLUMNS = ("id", "instruction")


def job_as_interplan(
    job: GenerationJob, *, contestant: str | None = None, strict: bool = False
) -> tuple[str, tuple[Loss, ...]]:
    """Return all that a job made, in interPlan's YAML, and what the file can't say.

    Args:
        job: Whose modifications are written, ordered by scenario and contestant.
        contestant: The slug of the only contestant to write; None for all.
        strict: Whether nothing is written once a scenario would not be the same there.

    Raises:
        UnknownName: The job has no such contestant.
        Conflict: A scene has more modifications than interPlan can number, or `strict` and
            something would change.
    """
    rows = job.augmentations.select_related("scenario__base_scene", "contestant")
    slugs = sorted(set(rows.values_list("contestant__slug", flat=True)))
    if contestant is not None:
        if contestant not in slugs:
            raise UnknownName("contestant", contestant, slugs)
        rows = rows.filter(contestant__slug=contestant)
    cells, losses = [], []
    for row in rows.order_by("scenario__slug", "contestant__slug", "sample"):
        sample = f", sample {row.sample}" if job.samples > 1 else ""
        name = f"{row.scenario.slug} by {row.contestant.slug}{sample}"
        if row.modification is None:
            text = f"there is no modification: {row.state}"
            losses.append(Loss(cell=name, text=text, changes_scene=True))
        else:
            cells.append(_cell(name, row))
    text, more = interplan_text(cells)
    losses += more
    if strict:
        refuse_changes(losses, where="interPlan")
    return text, tuple(losses)


def refuse_changes(losses: Sequence[Loss], *, where: str) -> None:
    """Raise Conflict once a scenario would not be the same there."""
    changes = [loss for loss in losses if loss.changes_scene]
    if changes:
        shown = "; ".join(str(loss) for loss in changes[:_MOST_LISTED])
        more = len(changes) - _MOST_LISTED
        rest = f"; and {more} more" if more > 0 else ""
        raise Conflict(
            f"{len(changes)} things would not be the same in {where}, and nothing was written: "
            f"{shown}{rest}."
        )


def _cell(name: str, row: Augmentation) -> Cell:
    scenario, scene = row.scenario, row.scenario.base_scene
    source = None
    if scene.source == NuPlan.name and scene.source_item:
        source = InterplanSource(token=scene.source_item, **(scenario.interplan or {}))
    return Cell(
        name=name,
        scene=scene_of(scenario),
        type=type_of(scenario.type),
        modification=modification_from_document(row.modification),
        keeps_traffic=scenario.keep_traffic,
        source=source,
    )


class StepKind(StrEnum):
    """What a step of an import was."""

    LEFT_OUT = "left out"  # something of the file is not kept
    LOG = "log"  # a log was looked through
    NEW = "new"  # a scenario was added
    OLD = "old"  # a scenario was there already
    SKIPPED = "skipped"  # a special scenario is none here


@dataclass(frozen=True, slots=True)
class ImportStep:
    """What was looked at, kept or skipped, and the sentence that says so."""

    kind: StepKind
    text: str


def import_interplan(
    *,
    folder: Path,
    data: Path | None = None,
    instructions: Path | None = None,
    actor: User | None = None,
) -> Iterator[ImportStep]:
    """Keep every special scenario whose base token lies in a log, one by one.

    Args:
        folder: Holds interPlan's YAML somewhere.
        data: Holds nuPlan's logs and maps somewhere; None for the same folder.
        instructions: A CSV file of ids and sentences, for those that have one of somebody's own.
        actor: Who did it.

    Yields:
        Each step as it happens.

    Raises:
        InvalidDocument: There is not exactly one modification file, it breaks its format, or the
            sentences do.
    """
    file = file_of(read_yaml_file(_modification_file_in(folder), what=WHAT))
    by_token = file.modification_details_dictionary
    wanted = {token: one for token, one in by_token.items() if one.special_scenario}
    sentences = {} if instructions is None else _sentences(instructions, wanted)
    for text in file.left_out:
        yield ImportStep(StepKind.LEFT_OUT, f"Left out: {text}.")
    for token in by_token.keys() - wanted.keys():
        text = f"Left out: base token {token}, which has no special scenario."
        yield ImportStep(StepKind.LEFT_OUT, text)
    logs: dict[str, Path] = {}
    paths = sorted((data or folder).rglob("*.db"))
    for number, path in enumerate(paths, start=1):
        tokens: tuple[str, ...] = ()
        try:
            tokens = UntrustedInput(path=path, format=NuPlan.name).tokens(list(wanted))
            found = f"{len(tokens)} base tokens"
        except InvalidDocument as fault:
            found = str(fault)
        logs = dict.fromkeys(tokens, path) | logs
        yield ImportStep(StepKind.LOG, f"Log {number} of {len(paths)}, {path.name}: {found}")
    for token, details in wanted.items():
        if token in logs:
            yield from _keep_token(token, file, logs[token], sentences, actor)
        else:
            yield from _skip_all(token, details, "none of the logs has a frame of its base token")


def _modification_file_in(folder: Path) -> Path:
    """The one modification file in a folder, whatever it is called."""
    if folder.is_file():
        return folder
    if not folder.is_dir():
        raise InvalidDocument(WHAT, [(str(folder), "is not a folder")])
    candidates = [*sorted(folder.rglob("*.yaml")), *sorted(folder.rglob("*.yml"))]
    files = [
        file
        for file in candidates
        if file.is_file()
        and file.stat().st_size <= MAX_CHARACTERS
        and _KEY.encode() in file.read_bytes()
    ]
    if len(files) != 1:
        named = ", ".join(str(file.relative_to(folder)) for file in files[:5])
        text = f"holds {len(files)} YAML files with {_KEY}, there must be one: {named}"
        raise InvalidDocument(WHAT, [(str(folder), text.rstrip(": "))])
    return files[0]


def _skip_all(token: str, details: Details, reason: str) -> Iterator[ImportStep]:
    for index in details.special_scenario or {}:
        yield ImportStep(StepKind.SKIPPED, f"{token}-s{index}: skipped. {reason}")


def _keep_token(
    token: str, file: File, log: Path, sentences: Mapping[str, str], actor: User | None
) -> Iterator[ImportStep]:
    details = file.modification_details_dictionary[token]
    try:
        recorded = UntrustedInput(path=log, format=NuPlan.name)
        source, reading = recorded.read(item=token, frame=None, name=f"interplan-{token}")
        if details.left_out:
            note = Note(kind=SceneNoteKind.INTERPLAN_LEFT_OUT, names=details.left_out)
            reading = replace(reading, notes=(*reading.notes, note))
        row, _ = keep_reading(reading, source=source, path=log, actor=actor)
    except AugmentError as fault:
        yield from _skip_all(token, details, str(fault))
        return
    scene = without_traffic(reading.scene)
    for index, entry in (details.special_scenario or {}).items():
        name = f"{token}-s{index}"
        try:
            kept = _documents(file, token, str(index), entry)
            yield _keep_entry(row, scene, entry, details, kept, sentences.get(name), actor)
        except AugmentError as fault:
            yield ImportStep(StepKind.SKIPPED, f"{name}: skipped. {fault}")


def _documents(file: File, token: str, index: str, entry: SpecialScenario) -> dict[str, Any]:
    """What is kept verbatim: all that an export has to say again."""

    def plain(part: BaseModel, *left_out: str) -> dict[str, Any]:
        return part.model_dump(mode="json", exclude_unset=True, exclude=set(left_out))

    document = {
        "index": index,
        "entry": plain(entry),
        "details": plain(file.modification_details_dictionary[token], "special_scenario"),
        "file": plain(file, _KEY),
    }
    try:
        json.dumps(document, allow_nan=False)
    except ValueError:
        where = place_of(token, index)
        raise InvalidDocument(WHAT, [(where, "holds a number that is not finite")]) from None
    return document


def _keep_entry(
    row: BaseScene,
    scene: Scene,
    entry: SpecialScenario,
    details: Details,
    kept: dict[str, Any],
    sentence: str | None,
    actor: User | None,
) -> ImportStep:
    token, slug = row.source_item, f"{row.slug}-s{kept['index']}"
    read = read_entry(token, kept["index"], entry, scene)
    left_out = f"; left out: {', '.join(read.left_out)}" if read.left_out else ""
    if Scenario.objects.filter(slug=slug, base_scene=row, type=read.type.value).exists():
        return ImportStep(StepKind.OLD, f"{read.id}: {slug} was there already{left_out}")
    density, goal = options_of(entry.config)
    added = read.modification.added
    traffic = traffic_of(entry, details, scene, seed=token, clear_of=added)
    goal_m = goal_place(kept, goal or "", scene)
    options = SceneOptions(density=density, goal=goal, goal_m=goal_m)
    driven = replace(scene, agents=traffic, options=options)
    generated, intent = describe_reference(read.type, read.modification, driven)
    add_scenario(
        scene=row.slug,
        type=read.type.value,
        instruction=sentence or generated,
        slug=slug,
        reference=modification_to_document(read.modification),
        intent=None if intent is None else intent_to_document(intent),
        intent_origin=IntentOrigin.DERIVED,
        circumstances=Circumstances(
            density=density,
            goal=goal,
            traffic=traffic,
            interplan=kept,
            instruction_is_generated=not sentence,
        ),
        actor=actor,
    )
    return ImportStep(StepKind.NEW, f"{read.id}: {slug}{left_out}")


def _sentences(file: Path, wanted: Mapping[str, Details]) -> dict[str, str]:
    known = {f"{token}-s{n}" for token, one in wanted.items() for n in one.special_scenario or {}}
    try:
        with file.open(encoding="utf-8-sig", newline="") as lines:
            rows = csv.DictReader(lines)
            if not set(_COLUMNS) <= set(rows.fieldnames or ()):
                raise InvalidDocument(
                    "instructions", [(file.name, f"needs the columns {_COLUMNS}")]
                )
            found = {str(row["id"]).strip(): str(row["instruction"] or "").strip() for row in rows}
    except (OSError, UnicodeDecodeError, csv.Error) as fault:
        problem = (str(file), f"can't be read: {fault}")
        raise InvalidDocument("instructions", [problem]) from None
    for name in found.keys() - known:
        text = f"{name[:40]!r} is no special scenario of the file"
        raise InvalidDocument("instructions", [(file.name, text)])
    return found
