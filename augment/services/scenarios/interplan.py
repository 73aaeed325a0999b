"""A job's modifications as interPlan's file, and such a file as reference modifications."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
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
    ReadFile,
    SpecialScenario,
    file_of,
    left_out_of_details,
    left_out_of_file,
    options_of,
    place_of,
    token_of,
)
from augment.formats.interplan.intent import describe_reference
from augment.formats.interplan.reader import goal_place, read_document, read_entry, traffic_of
from augment.formats.interplan.writer import interplan_text
from augment.formats.nuplan_log import NuPlan
from augment.formats.reading import Reading
from augment.formats.writing import Cell, Loss
from augment.models import Augmentation, BaseScene, GenerationJob, Scenario
from augment.scene.codec import (
    intent_to_document,
    modification_from_document,
    modification_to_document,
    scene_from_document,
)
from augment.scene.entities import Scene, SceneOptions, without_traffic
from augment.scene.intent import IntentOrigin
from augment.scene.recording import Note, SceneNoteKind
from augment.services.scenarios.scene_imports import keep_reading
from augment.services.scenarios.scenes import Circumstances, add_scenario, scene_of, type_of

NUPLAN = NuPlan.name
_MOST_LISTED = 12


def job_as_interplan(
    job: GenerationJob, *, contestant: str | None = None, strict: bool = False
) -> tuple[str, tuple[Loss, ...]]:
    """All that a job made, in interPlan's YAML, and what the file can't say.

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
        name = f"{row.scenario.slug} by {row.contestant.slug}"
        if job.samples > 1:
            name += f", sample {row.sample}"
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


def references_from_interplan(path: Path, *, scenes: Mapping[str, str] | None = None) -> ReadFile:
    """The special scenarios of an interPlan file whose scenes are stored here.

    Args:
        path: The YAML file.
        scenes: Slugs of stored scenes in the file's frame by base token; None for the tokens
            that `job_as_interplan` makes from the scenes' names.

    Raises:
        UnknownName: No such scene, or no such base token in the file.
        InvalidDocument: The file can't be read or breaks its format.
    """
    stored = {row.slug: row for row in BaseScene.objects.defer("recording")}
    given = tuple(scenes or ())
    if scenes is None:
        scenes = {token_of(slug): slug for slug in stored}
        scenes |= {row.source_item: row.slug for row in stored.values() if row.source == NUPLAN}
    for slug in scenes.values():
        if slug not in stored:
            raise UnknownName("scene", slug, sorted(stored))
    document = read_yaml_file(path, what=WHAT)
    known = {
        token: without_traffic(scene_from_document(stored[slug].document))
        for token, slug in scenes.items()
    }
    file = read_document(document, known)
    tokens = [*dict.fromkeys(entry.id.partition("-")[0] for entry in file.entries)]
    there = sorted({*tokens, *file.passed_over})
    for token in given:
        if token not in there:
            raise UnknownName("base token", token, there)
    if not file.entries:
        raise InvalidDocument(
            WHAT,
            [
                (
                    "modification_details_dictionary",
                    f"none of its {len(there)} base tokens has a scene here: "
                    f"{', '.join(there[:_MOST_LISTED])}; name the scenes by --scene TOKEN=SLUG",
                )
            ],
        )
    return file


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
    return Cell(
        name=name,
        scene=scene_of(row.scenario),
        type=type_of(row.scenario.type),
        modification=modification_from_document(row.modification),
        keeps_traffic=row.scenario.keep_traffic,
        source=_source(row.scenario),
    )


def _source(scenario: Scenario) -> InterplanSource | None:
    """Where a scenario comes from in nuPlan, None for a scene of another source."""
    row = scenario.base_scene
    if row.source != NUPLAN or not row.source_item:
        return None
    return InterplanSource(token=row.source_item, **(scenario.interplan or {}))


KEY = b"modification_details_dictionary"
SLUG = "interplan"
LOGS = "nuplan"
COLUMNS = ("id", "instruction")
_MOST_SENTENCES = 10_000


@dataclass(frozen=True, slots=True, kw_only=True)
class LogLooked:
    """A log that was looked through for base tokens.

    Attributes:
        number, of: Which of how many.
        tokens: The base tokens in it.
        fault: Why it could not be read; empty if it could.
    """

    path: Path
    number: int
    of: int
    tokens: tuple[str, ...]
    fault: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenarioDone:
    """A special scenario that is a scenario now.

    Attributes:
        id: interPlan's own name.
        is_new: False where it was there before.
        left_out: What of it changes nothing here; an export says it again.
        same_as: The name of an earlier one that differs from it in nothing; empty for none.
    """

    id: str
    row: Scenario
    is_new: bool
    left_out: tuple[str, ...]
    same_as: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenarioSkipped:
    """A special scenario that is none, and why."""

    id: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FileLeftOut:
    """What the file says besides, which is not kept."""

    text: str


Step = LogLooked | ScenarioDone | ScenarioSkipped | FileLeftOut


def import_interplan(
    *,
    folder: Path,
    data: Path | None = None,
    instructions: Path | None = None,
    actor: User | None = None,
) -> Iterator[Step]:
    """Keep every special scenario whose base token lies in a log, one by one.

    Args:
        folder: Holds interPlan's YAML somewhere.
        data: Holds nuPlan's logs and maps somewhere; None for the same folder.
        instructions: A CSV file of ids and sentences, for those that have one of somebody's own.
        actor: Who did it.

    Yields:
        What was looked at, kept or skipped, as it happens.

    Raises:
        InvalidDocument: There is not exactly one modification file, it breaks its format, or the
            sentences do.
    """
    file = file_of(read_yaml_file(modification_file_in(folder), what=WHAT))
    wanted = _wanted(file)
    sentences = {} if instructions is None else _sentences(instructions, wanted)
    yield from (FileLeftOut(text=text) for text in left_out_of_file(file))
    for token in file.modification_details_dictionary:
        if token not in wanted:
            yield FileLeftOut(text=f"base token {token}, which has no special scenario")
    logs: dict[str, Path] = {}
    for looked in _look_through(data or folder, wanted):
        logs |= {token: looked.path for token in looked.tokens if token not in logs}
        yield looked
    for token, details in wanted.items():
        if token in logs:
            yield from _keep_token(token, file, logs[token], sentences, actor)
        else:
            reason = "none of the logs has a frame of its base token"
            yield from _skip_all(token, details, reason)


def modification_file_in(folder: Path) -> Path:
    """The one modification file in a folder, whatever it is called.

    Raises:
        InvalidDocument: There is none, or several.
    """
    if folder.is_file():
        return folder
    if not folder.is_dir():
        raise InvalidDocument(WHAT, [(str(folder), "is not a folder")])
    files = [
        file
        for ending in ("*.yaml", "*.yml")
        for file in sorted(folder.rglob(ending))
        if file.is_file() and file.stat().st_size <= MAX_CHARACTERS and KEY in file.read_bytes()
    ]
    if len(files) != 1:
        named = ", ".join(str(file.relative_to(folder)) for file in files[:5])
        text = f"holds {len(files)} YAML files with {KEY.decode()}, there must be one: {named}"
        raise InvalidDocument(WHAT, [(str(folder), text.rstrip(": "))])
    return files[0]


# Private


def _wanted(file: File) -> dict[str, Details]:
    by_token = file.modification_details_dictionary
    wanted = {token: one for token, one in by_token.items() if one.special_scenario}
    if not wanted:
        raise InvalidDocument(WHAT, [("", "holds no special scenario")])
    return wanted


def _entries(token: str, details: Details) -> Iterator[tuple[str, str, SpecialScenario]]:
    """Each special scenario with interPlan's name of it and its index."""
    for index, entry in (details.special_scenario or {}).items():
        yield f"{token}-s{index}", str(index), entry


def _skip_all(token: str, details: Details, reason: str) -> Iterator[ScenarioSkipped]:
    for name, _, _ in _entries(token, details):
        yield ScenarioSkipped(id=name, reason=reason)


def _look_through(data: Path, wanted: Mapping[str, Details]) -> Iterator[LogLooked]:
    paths = sorted(data.rglob("*.db"))
    for number, path in enumerate(paths, start=1):
        tokens: tuple[str, ...] = ()
        fault = ""
        try:
            tokens = UntrustedInput(path=path, format=LOGS).tokens(list(wanted))
        except InvalidDocument as raised:
            fault = str(raised)
        yield LogLooked(path=path, number=number, of=len(paths), tokens=tokens, fault=fault)


def _keep_token(
    token: str, file: File, log: Path, sentences: Mapping[str, str], actor: User | None
) -> Iterator[Step]:
    details = file.modification_details_dictionary[token]
    recorded = UntrustedInput(path=log, format=LOGS)
    try:
        source, reading = recorded.read(item=token, frame=None, name=f"{SLUG}-{token}")
        row, _ = keep_reading(
            _with_notes(reading, token, details), source=source, path=log, actor=actor
        )
    except AugmentError as fault:
        yield from _skip_all(token, details, str(fault))
        return
    scene = without_traffic(reading.scene)
    kept: dict[str, str] = {}
    for name, index, entry in _entries(token, details):
        try:
            place = _Place(file=file, token=token, index=index, entry=entry)
            done = _keep_entry(row, scene, place, sentences.get(name), actor)
        except AugmentError as fault:
            yield ScenarioSkipped(id=name, reason=str(fault))
            continue
        same = kept.setdefault(_asks(done.row), name)
        yield replace(done, same_as="" if same == name else same)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Place:
    """A special scenario in its file."""

    file: File
    token: str
    index: str
    entry: SpecialScenario

    @property
    def details(self) -> Details:
        return self.file.modification_details_dictionary[self.token]

    def to_document(self) -> dict[str, Any]:
        """What is kept verbatim: all that an export has to say again.

        Raises:
            InvalidDocument: An unknown key holds what JSON can't.
        """
        document = {
            "index": self.index,
            "entry": _plain(self.entry),
            "details": _plain(self.details, "special_scenario"),
            "file": _plain(self.file, "modification_details_dictionary"),
        }
        try:
            json.dumps(document, allow_nan=False)
        except ValueError:
            where = place_of(self.token, self.index)
            raise InvalidDocument(WHAT, [(where, "holds a number that is not finite")]) from None
        return document


def _plain(part: BaseModel, *left_out: str) -> dict[str, Any]:
    return part.model_dump(mode="json", exclude_unset=True, exclude=set(left_out))


def _asks(row: Scenario) -> str:
    """What makes two scenarios of one scene the same: all but name and words."""
    asked = [row.type, row.reference, row.traffic_density, row.goal, row.spawned]
    return json.dumps(asked, sort_keys=True)


def _keep_entry(
    row: BaseScene, scene: Scene, place: _Place, sentence: str | None, actor: User | None
) -> ScenarioDone:
    entry, details = place.entry, place.details
    found = read_entry(place.token, place.index, entry, scene)
    slug = f"{row.slug}-s{place.index}"
    before = Scenario.objects.filter(slug=slug, base_scene=row, type=found.type.value).first()
    if before is not None:
        return ScenarioDone(id=found.id, row=before, is_new=False, left_out=found.left_out)
    density, goal = options_of(entry.config)
    source = place.to_document()
    traffic = traffic_of(
        entry, details, scene, seed=place.token, clear_of=found.modification.added
    )
    options = SceneOptions(
        density=density, goal=goal, goal_m=goal_place(source, goal or "", scene)
    )
    driven = replace(scene, agents=traffic, options=options)
    generated, intent = describe_reference(found.type, found.modification, driven)
    made = add_scenario(
        scene=row.slug,
        type=found.type.value,
        instruction=sentence or generated,
        slug=slug,
        reference=modification_to_document(found.modification),
        intent=None if intent is None else intent_to_document(intent),
        intent_origin=IntentOrigin.DERIVED,
        circumstances=Circumstances(
            density=density,
            goal=goal,
            traffic=traffic,
            interplan=source,
            instruction_is_generated=not sentence,
        ),
        actor=actor,
    )
    return ScenarioDone(id=found.id, row=made, is_new=True, left_out=found.left_out)


def _with_notes(reading: Reading, token: str, details: Details) -> Reading:
    """With what interPlan says of the base token and a scenario here can't."""
    left_out = [*left_out_of_details(details)]
    if not left_out:
        return reading
    note = Note(kind=SceneNoteKind.INTERPLAN_LEFT_OUT, names=tuple(left_out))
    return replace(reading, notes=(*reading.notes, note))


def _sentences(file: Path, wanted: Mapping[str, Details]) -> dict[str, str]:
    known = {name for token, one in wanted.items() for name, _, _ in _entries(token, one)}
    what = "instructions"
    try:
        with file.open(encoding="utf-8-sig", newline="") as lines:
            rows = csv.DictReader(lines)
            if rows.fieldnames is None or not set(COLUMNS) <= set(rows.fieldnames):
                raise InvalidDocument(what, [(file.name, f"needs the columns {COLUMNS}")])
            found = {}
            for number, row in zip(range(2, _MOST_SENTENCES), rows, strict=False):
                name = str(row["id"]).strip()
                if name not in known:
                    text = f"{name[:40]!r} is no special scenario of the file"
                    raise InvalidDocument(what, [(f"{file.name}, line {number}", text)])
                found[name] = str(row["instruction"] or "").strip()
            return found
    except (OSError, UnicodeDecodeError, csv.Error) as fault:
        raise InvalidDocument(what, [(str(file), f"can't be read: {fault}")]) from None
