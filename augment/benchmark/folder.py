"""A benchmark set as a folder: what entrants get, and nothing more.

In: a `BenchmarkSet`. Out: its files by name; and back from a folder on disk. References of the
test split are in no file, and the checksum is that of what is handed out.
"""

import hashlib
import json
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields, replace
from importlib import resources
from pathlib import Path, PurePath
from typing import Annotated, Any, TypeVar

from pydantic import Field, TypeAdapter

from augment.benchmark.values import BenchmarkSet, BenchmarkTask, Day, Slug, Split, TaskFacts
from augment.errors import InvalidDocument, InvalidModification
from augment.formats.documents import read_json
from augment.formats.writers import WRITERS, writer_named
from augment.formats.writing import Cell
from augment.scene import codec
from augment.scene.entities import Modification, ScenarioType
from augment.scene.planned_mover import check_motions
from augment.scene.schema import CLOSED, Codec, Text, Whole, path

Read = TypeVar("Read")

WHAT = "benchmark"
MANIFEST, LOSSES, README = "benchmark.json", "losses.json", "README.txt"
SCENE, RECORDING, REFERENCE, INTENT = "scene", "recording", "reference", "intent"
OWN_PARTS = (SCENE, RECORDING, REFERENCE, INTENT)
"""The kinds of our own documents: `scenes/NAME.json`, `recordings/...`, `references/...`."""

FORMATS = tuple(name for name in WRITERS if name != "json")
"""What a scene is written in besides; each has a folder of that name."""

MOST_TASKS = 2_000


_Line = Annotated[Text, Field(min_length=1, max_length=200)]


@dataclass(frozen=True, slots=True, kw_only=True)
class _TaskLine(TaskFacts):
    """A task as `benchmark.json` tells of it.

    Attributes:
        provenance: Of its scene.
        files: Names in the folder, by kind of document and by format.
    """

    provenance: Text
    files: dict[Text, tuple[Text, ...]]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Manifest:
    """`benchmark.json`; `version` of its format, `set_version` of the benchmark."""

    __pydantic_config__ = CLOSED

    name: Slug
    title: _Line
    set_version: Annotated[Whole, Field(ge=1)]
    made_on: Day
    checksum: Annotated[Text, Field(pattern=r"^([0-9a-f]{64})?$")]
    tasks: Annotated[tuple[_TaskLine, ...], Field(min_length=1, max_length=MOST_TASKS)]


def _manifest_problems(manifest: _Manifest) -> Iterator[tuple[str, str]]:
    names = [task.name for task in manifest.tasks]
    for place, task in enumerate(manifest.tasks):
        if task.name in names[:place]:
            yield path("tasks", place, "name"), f"{task.name!r} is there twice"
        if task.paraphrase_of and task.paraphrase_of not in names:
            where = path("tasks", place, "paraphrase_of")
            yield where, f"{task.paraphrase_of!r} is no task of this benchmark"


_CODEC = Codec(WHAT, TypeAdapter(_Manifest), _manifest_problems)


# Out


def checksum(benchmark: BenchmarkSet) -> str:
    """Return the SHA-256 of what entrants get: not the references and intents of the test.

    Files of other tools' formats are made of that and count no further.
    """
    digest = hashlib.sha256(_canonical(_CODEC.dump(_make_manifest(benchmark))))
    for task in benchmark.tasks:
        for kind, document in _task_documents(task).items():
            digest.update(_canonical([task.name, kind, document]))
    return digest.hexdigest()


def write_folder(benchmark: BenchmarkSet) -> dict[str, bytes]:
    """Return the files by their names in the folder.

    Raises:
        InvalidDocument: A task breaks a rule of the format, or a practice task has no reference.
    """
    files: dict[str, bytes] = {}
    named: dict[str, dict[str, tuple[str, ...]]] = {}
    for task in benchmark.tasks:
        documents = _task_documents(task)
        files |= {
            _file_name(kind, task.name): _text(document) for kind, document in documents.items()
        }
        named[task.name] = {kind: (_file_name(kind, task.name),) for kind in documents}
    losses: list[dict[str, Any]] = []
    cells = [replace(task_cell(task), made_on=benchmark.made_on) for task in benchmark.tasks]
    for form in FORMATS:
        written = writer_named(form)(cells)
        files |= {f"{form}/{name}": content for name, content in written.files.items()}
        refused = {loss.cell for loss in written.refused}
        for name, own in _share_out(written.files, [*named.keys() - refused]).items():
            named[name][form] = tuple(f"{form}/{file}" for file in own)
        for is_refused, those in ((False, written.losses), (True, written.refused)):
            kind = {"format": form, "is_refused": is_refused}
            losses += [kind | asdict(loss) for loss in those]
    manifest = _make_manifest(benchmark)
    lines = tuple(replace(line, files=named[line.name]) for line in manifest.tasks)
    manifest = replace(manifest, checksum=checksum(benchmark), tasks=lines)
    files[MANIFEST] = _text(_CODEC.to_document(manifest), indent=1)
    files[LOSSES] = _text(losses, indent=1)
    files[README] = _readme(benchmark, manifest.checksum)
    return files


# Back


def read_folder(folder: Path) -> BenchmarkSet:
    """Return the set that a folder holds, without references of its test split.

    Raises:
        InvalidDocument: A file is missing, a link, too large or breaks its format, a document
            does not fit the others, or the checksum does not; each problem names file and place.
    """
    manifest = _read(folder, MANIFEST, _CODEC.from_document)
    tasks = tuple(_read_task(folder, line) for line in manifest.tasks)
    benchmark = BenchmarkSet(
        name=manifest.name,
        title=manifest.title,
        version=manifest.set_version,
        made_on=manifest.made_on,
        tasks=tasks,
    )
    digest = checksum(benchmark)
    if digest != manifest.checksum:
        text = f"{manifest.checksum!r} is not that of the folder, {digest!r}: get it once more"
        raise InvalidDocument(WHAT, [(f"{MANIFEST}: checksum", text)])
    return benchmark


def _read_task(folder: Path, line: _TaskLine) -> BenchmarkTask:
    at = f"{MANIFEST}: tasks {line.name!r}"
    needed, possible = {SCENE}, {RECORDING}
    if line.split is Split.PRACTICE:
        needed, possible = needed | {REFERENCE}, possible | {INTENT}
    kinds = {kind for kind in OWN_PARTS if kind in line.files}
    if kinds - possible != needed:
        text = f"of a {line.split} task expected {', '.join(sorted(needed))}, and a recording"
        raise InvalidDocument(WHAT, [(f"{at}: files", f"{text} if there is one")])
    documents: dict[str, Any] = {}
    for kind in kinds:
        name = _file_name(kind, line.name)
        if line.files[kind] != (name,):
            raise InvalidDocument(WHAT, [(f"{at}: files.{kind}", f"expected {name!r} alone")])
        documents[kind] = _read(folder, name, _PARSERS[kind])
    if documents[SCENE].provenance != line.provenance:
        raise InvalidDocument(WHAT, [(f"{at}: provenance", "is not that of its scene")])
    try:
        check_motions(documents[SCENE], documents.get(REFERENCE, Modification()))
    except InvalidModification as fault:
        raise InvalidDocument(WHAT, [(f"{at}: reference", str(fault))]) from None
    return BenchmarkTask(
        scene=documents[SCENE],
        recording=documents.get(RECORDING),
        reference=documents.get(REFERENCE),
        intent=documents.get(INTENT),
        **_list_facts(line),
    )


_PARSERS: dict[str, Any] = {
    SCENE: codec.scene_from_document,
    RECORDING: codec.recording_from_document,
    REFERENCE: codec.modification_from_document,
    INTENT: codec.intent_from_document,
}


def _read(folder: Path, name: str, parse: Callable[[object], Read]) -> Read:
    """Return the content of a plain file in the folder itself."""
    file = folder / name
    is_inside = file.parent.resolve() == folder.resolve() / Path(name).parent
    if not is_inside or file.is_symlink() or not file.is_file():
        problem = "is missing, or is a link or special; only plain files are read"
        raise InvalidDocument(WHAT, [(name, problem)])
    try:
        return parse(read_json(file, what=WHAT))
    except InvalidDocument as fault:
        problems = [(place.removeprefix(file.name), text) for place, text in fault.problems]
        raise InvalidDocument(
            WHAT, [(f"{name}: {place}" if place else name, text) for place, text in problems]
        ) from None


# What both share


def _file_name(kind: str, name: str) -> str:
    return f"{kind}s/{name}.json"


def _task_documents(task: BenchmarkTask) -> dict[str, Any]:
    """Return the own documents of a task that are handed out, by their kinds."""
    documents = {SCENE: codec.scene_to_document(task.scene)}
    if task.recording is not None:
        documents[RECORDING] = codec.recording_to_document(task.recording)
    if task.split is Split.PRACTICE:
        if task.reference is None:
            problem = "is for practice and has no reference to hand out"
            raise InvalidDocument(WHAT, [(task.name, problem)])
        documents[REFERENCE] = codec.modification_to_document(task.reference)
        if task.intent is not None:
            documents[INTENT] = codec.intent_to_document(task.intent)
    return documents


def _make_manifest(benchmark: BenchmarkSet) -> _Manifest:
    """Return `benchmark.json` without the names of files and without the checksum."""
    return _Manifest(
        name=benchmark.name,
        title=benchmark.title,
        set_version=benchmark.version,
        made_on=benchmark.made_on,
        checksum="",
        tasks=tuple(
            _TaskLine(provenance=task.scene.provenance, files={}, **_list_facts(task))
            for task in benchmark.tasks
        ),
    )


def _list_facts(task: TaskFacts) -> dict[str, Any]:
    """Return the fields that a task shares with its line in `benchmark.json`."""
    return {field.name: getattr(task, field.name) for field in fields(TaskFacts)}


def task_cell(task: BenchmarkTask) -> Cell:
    """Return the scene of a task as writers take it, before anybody changes it."""
    return Cell(
        name=task.name,
        stem=task.name,
        scene=task.scene,
        type=ScenarioType(task.type) if task.type in list(ScenarioType) else None,
        modification=Modification(),
        keeps_traffic=task.keeps_traffic,
        recording=task.recording,
    )


def _share_out(files: Iterable[str], tasks: Sequence[str]) -> dict[str, list[str]]:
    """Return the files of each task: those that end with its name, and those of all tasks."""
    by_length = sorted(tasks, key=len, reverse=True)
    shared: dict[str, list[str]] = {name: [] for name in tasks}
    for file in sorted(files):
        stem = PurePath(file).stem
        owner = next((name for name in by_length if stem.endswith(name)), None)
        for name in tasks if owner is None else [owner]:
            shared[name].append(file)
    return shared


def _readme(benchmark: BenchmarkSet, digest: str) -> bytes:
    text = resources.files(__package__).joinpath("readme.txt").read_text("utf-8")
    practice = sum(task.split is Split.PRACTICE for task in benchmark.tasks)
    counts = {"practice": practice, "test": len(benchmark.tasks) - practice}
    formats = ", ".join(FORMATS)
    return text.format(of=benchmark, checksum=digest, formats=formats, **counts).encode()


def _canonical(document: Any) -> bytes:
    """Return the bytes that count; without the sign of zero, which PostgreSQL's JSON drops."""
    text = json.dumps(document, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return re.sub(r"-0\.0(?=[],}])", "0.0", text).encode() + b"\n"


def _text(document: Any, indent: int | None = None) -> bytes:
    text = json.dumps(document, indent=indent, ensure_ascii=False, allow_nan=False)
    return f"{text}\n".encode()
