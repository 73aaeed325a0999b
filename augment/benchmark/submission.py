"""From a submission, a folder or zip from outside, to the report on it.

In: a benchmark set and a path with `card.json` and one file a task and sample, `<task>.<ext>` or
`<task>--<sample>.<ext>`: our modification JSON, the changed scene in any format that is read, or
LCTGen's vehicles. Out: what became of each. Files are read in a process of its own
(submitted_file.py); where it dies over one, that one is unreadable and the rest is read on.
A format that can be written here is written and read back, so that its losses and its rounding are
known for every agent of a source; of others the source itself is taken.
"""

import tempfile
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter

from augment.benchmark import submitted_file
from augment.benchmark.difference import SourceView, find_difference, number_added
from augment.benchmark.folder import task_cell
from augment.benchmark.report import CARD
from augment.benchmark.submitted_file import CONTENT, FileContent
from augment.benchmark.values import (
    BenchmarkSet,
    BenchmarkTask,
    EntryStatus,
    Split,
    SubmissionReport,
    SubmittedEntry,
)
from augment.checks import Ground
from augment.errors import InvalidDocument, InvalidModification
from augment.formats import lctgen, sandbox
from augment.formats.commonroad.writer import names_in
from augment.formats.documents import parse_json
from augment.formats.readers import find_reader
from augment.formats.reading import place_on_lanes
from augment.formats.roads import RADIUS_M
from augment.formats.writers import writer_named
from augment.metrics.displacement import displacement, displacement_from_wish
from augment.scene.codec import SCENE
from augment.scene.entities import Modification, apply
from augment.scene.planned_mover import check_motions
from augment.simulation.expected import expect_recording

MOST_DEATHS = 25
"""Files that may end their process; each takes it some seconds."""
MOST_CHANGED = 1_000
"""Agents that a file may have beyond those of the source."""
MOST_TOGETHER = 300_000
"""Agents in all files together: they are held at once, and so is the report with them."""
MOST_REMARKS = 100
COMMONROAD, SCENARIONET = "commonroad", "scenarionet"
_SUFFIXES = {COMMONROAD: ".xml", SCENARIONET: ".pkl"}
_NAMES = TypeAdapter(tuple[str, ...])
Key = tuple[str, int]
"""A task and a sample."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownSource:
    """A source in a format.

    Attributes:
        ids: Of the source's agents, by what the format's file calls them.
        notes: What its reader says of it, which is no news of a submission.
    """

    view: SourceView
    ids: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def show_source(task: BenchmarkTask, format_name: str) -> ShownSource:
    """Return the source of a task as a format shows it."""
    scene = task.scene
    near = [agent for agent in scene.agents if np.hypot(agent.x_m, agent.y_m) <= RADIUS_M]
    plain = SourceView(agents={agent.id: agent for agent in near}, origin=scene.origin)
    suffix = _SUFFIXES.get(format_name)
    if suffix is None:
        return ShownSource(view=plain)
    written = writer_named(format_name)([task_cell(task)]).files
    blocks = [file for name, file in written.items() if name.endswith(f"{task.name}{suffix}")]
    if not blocks:  # the scene can't be said in the format
        return ShownSource(view=plain)
    with tempfile.TemporaryDirectory(prefix="arena-source-") as folder:
        file = Path(folder) / f"{task.name}{suffix}"
        file.write_bytes(blocks[0])
        reading = find_reader(format_name).read(file, item=None, frame=None, name=scene.name)
    ids = {agent.id: agent.id for agent in scene.agents}
    if format_name == COMMONROAD:
        ids = names_in(blocks[0].decode())
    names = file_names(format_name, reading.names)
    shown = {
        ids[names[agent.id]]: agent for agent in reading.scene.agents if names[agent.id] in ids
    }
    named_agents = {agent.id: shown[agent.id] for agent in scene.agents if agent.id in shown}
    view = SourceView(agents=named_agents, origin=reading.scene.origin)
    return ShownSource(view=view, ids=ids, notes=reading.notes)


def file_names(format_name: str, names: Mapping[str, str]) -> Mapping[str, str]:
    """Return the file's own names of its agents."""
    if format_name != COMMONROAD:
        return names
    return {agent: str(int(number)) for agent, number in names.items()}


def identify(shown: ShownSource, content: FileContent) -> SourceView:
    """Return the view with the identities that a submitted file gives.

    ScenarioNet's tracks carry our ids; CommonRoad's numbers are ours where a comment of our writer
    says so, else they count for boxes of one size alone.
    """
    ids = content.own_names or shown.ids
    names = file_names(content.format, content.names or {})
    named = {agent: ids[name] for agent, name in names.items() if name in ids}
    known_names = {agent: name for agent, name in named.items() if name in shown.view.agents}
    is_certain = bool(content.own_names) or (content.format == SCENARIONET and bool(known_names))
    return replace(shown.view, names=known_names, is_certain=is_certain)


def check_submission(benchmark: BenchmarkSet, path: Path, *, checksum: str) -> SubmissionReport:
    """Return the result of every task and sample of a submission.

    Only tasks of the practice split are scored, whoever computes it.

    Args:
        benchmark: With as many references as are known here.
        path: A folder, or a zip of one.
        checksum: Of the benchmark set.

    Raises:
        InvalidDocument: It can't be taken as a whole: there is no card or a wrong one, the zip is
            broken, or it holds too much.
    """
    path = path.resolve()
    if not path.exists():
        raise InvalidDocument("submission", [(str(path), "is not there")])
    with tempfile.TemporaryDirectory(prefix="arena-submission-") as scratch:
        folder = Path(scratch) / "unpacked"
        folder.mkdir()
        request = {"what": "open", "path": str(path), "folder": str(folder)}
        opened = sandbox.run(submitted_file.__name__, request, name=path.name)
        card = CARD.from_parts(opened["card"])
        keys = [(task.name, n) for task in benchmark.tasks for n in range(1, card.samples + 1)]
        by_key, strangers = _sort_files(_NAMES.validate_python(opened["files"]), keys)
        alone = [names[0] for names in by_key.values() if len(names) == 1]
        contents = _read_files(Path(opened["root"]), alone, Path(scratch) / "told")
    checker = _Checker(contents=contents)
    tasks = {task.name: task for task in benchmark.tasks}
    return SubmissionReport(
        benchmark=benchmark.name,
        version=benchmark.version,
        checksum=checksum,
        card=card,
        entries=tuple(checker.check(tasks[key[0]], key[1], by_key.get(key, ())) for key in keys),
        remarks=_remarks_on(strangers),
    )


# Private


def _sort_files(
    names: Sequence[str], keys: Sequence[Key]
) -> tuple[dict[Key, list[str]], list[str]]:
    """Names by what they belong to, and those that belong to nothing."""
    stems = {f"{task}--{sample}": (task, sample) for task, sample in keys}
    stems |= {task: (task, sample) for task, sample in keys if sample == 1}
    by_key: dict[Key, list[str]] = defaultdict(list)
    strangers: list[str] = []
    for name in names:
        key = stems.get(name.partition(".")[0])
        (strangers if key is None else by_key[key]).append(name)
    return dict(by_key), strangers


def _read_files(root: Path, names: Sequence[str], progress: Path) -> dict[str, FileContent]:
    """Return each file's content; a process reads in order, the next one goes on after it.

    Raises:
        InvalidDocument: Too many end their process, or they hold too many agents together.
    """
    by_name: dict[str, FileContent] = {}
    deaths = agents = 0
    while rest := names[len(by_name) :]:
        problem = "was not read"
        request = {"what": "read", "root": str(root), "files": list(rest), "told": str(progress)}
        progress.write_bytes(b"")
        try:
            sandbox.run(submitted_file.__name__, request, name=rest[0])
        except InvalidDocument as fault:
            problem = "; ".join(text for _, text in fault.problems)
        except RuntimeError as fault:  # a fault of ours, which must not cost the other files
            problem = f"makes its reader fail: {str(fault).splitlines()[-1][:200]}"
        lines = progress.read_bytes().split(b"\n")[:-1]
        contents = [_content_in(line) for line in lines]
        agents += sum(map(_count_agents, contents))
        if agents > MOST_TOGETHER:
            text = f"more than {MOST_TOGETHER} agents in all files together"
            raise InvalidDocument("submission", [("", text)])
        if not contents:  # it died over the first, which had all of its limits for itself
            contents = [FileContent(problem=problem)]
            deaths += 1
        if deaths > MOST_DEATHS:
            text = f"more than {MOST_DEATHS} files break the limits of their reader, the last"
            raise InvalidDocument("submission", [("", f"{text} {rest[0]}: {problem}")])
        by_name.update(zip(rest, contents, strict=False))
    return by_name


def _remarks_on(strangers: Sequence[str]) -> tuple[str, ...]:
    remarks = [f"{name} belongs to no task and sample: not read." for name in strangers]
    more = len(remarks) - MOST_REMARKS
    return (
        *remarks[:MOST_REMARKS],
        *([f"{more} others belong to none either."] if more > 0 else []),
    )


def _count_agents(content: FileContent) -> int:
    changed = content.modification.changed if content.modification else ()
    return len(changed) + (len(content.scene.agents) if content.scene else 0)


def _content_in(line: bytes) -> FileContent:
    try:
        return CONTENT.from_parts(parse_json(line, what="file", place=""))
    except InvalidDocument as fault:
        return FileContent(problem=str(fault))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Checker:
    """Holds what files say against their tasks."""

    contents: Mapping[str, FileContent]
    sources: dict[tuple[str, str], ShownSource] = field(default_factory=dict)

    def check(self, task: BenchmarkTask, sample: int, files: Sequence[str]) -> SubmittedEntry:
        """Return the result of a task and sample, with its distances."""
        entry = self._read(task, sample, files)
        if task.split is not Split.PRACTICE or task.reference is None:
            return entry
        ground = Ground.of(task.scene, lambda *change: expect_recording(*change, task.replayed))
        distance = displacement(entry.modification, task.reference, ground)
        entry = replace(entry, displacement=distance)
        if task.intent is None:
            return entry
        wish = displacement_from_wish(entry.modification, task.intent, ground)
        return replace(entry, wish=wish)

    def _read(self, task: BenchmarkTask, sample: int, files: Sequence[str]) -> SubmittedEntry:
        entry = SubmittedEntry(
            task=task.name, sample=sample, status=EntryStatus.UNREADABLE, file=", ".join(files)
        )
        if not files:
            return replace(entry, status=EntryStatus.MISSING, reason="there is no file for it")
        if len(files) > 1:
            return replace(entry, reason=f"{len(files)} files are for it; one is needed")
        content = self.contents[files[0]]
        if content.problem:
            return replace(entry, reason=content.problem)
        try:
            modification, notes = self._change(task, content)
            check_motions(task.scene, modification)
            if problems := list(SCENE.problems(apply(task.scene, modification))):
                raise InvalidDocument("modification", problems)
        except InvalidModification as fault:
            return replace(entry, reason=f"does not fit its scene: {fault}")
        except InvalidDocument as fault:
            return replace(entry, reason=str(fault))
        if modification.is_empty and content.scene is None:
            text = "an empty modification: the system declines"
            return replace(entry, status=EntryStatus.REFUSED, reason=text)
        return replace(
            entry,
            status=EntryStatus.READ,
            notes=notes,
            modification=number_added(task.scene, modification),
        )

    def _change(
        self, task: BenchmarkTask, content: FileContent
    ) -> tuple[Modification, tuple[str, ...]]:
        modification = content.modification or Modification()
        agents = modification.changed if content.scene is None else content.scene.agents
        most = MOST_CHANGED + len(task.scene.agents)
        if len(agents) > most:
            raise InvalidDocument(
                "file", [("", f"{len(agents)} agents; at most {most} are taken")]
            )
        if content.scene is None:
            if content.format == lctgen.NAME:
                placed = place_on_lanes(replace(task.scene, agents=modification.added))
                modification = replace(modification, added=placed.agents)
            return modification, content.notes
        if content.format == "json":
            return find_difference(task.scene, content.scene)
        key = task.name, content.format
        if key not in self.sources:
            self.sources[key] = show_source(task, content.format)
        shown = self.sources[key]
        change, notes = find_difference(task.scene, content.scene, identify(shown, content))
        return change, (*(note for note in content.notes if note not in shown.notes), *notes)
