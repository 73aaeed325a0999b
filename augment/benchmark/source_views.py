"""The source of a task as other formats show it, and whom a submitted file means by its names.

A format that can be written here is written and read back, so that its losses and its rounding are
known for every agent; of others the source itself is taken.
"""

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from augment.benchmark.difference import SourceView
from augment.benchmark.folder import task_cell
from augment.benchmark.submitted_file import FileContent
from augment.benchmark.values import BenchmarkTask
from augment.formats.commonroad.writer import names_in
from augment.formats.readers import find_reader
from augment.formats.roads import RADIUS_M
from augment.formats.writers import writer_named

COMMONROAD, SCENARIONET = "commonroad", "scenarionet"
_SUFFIXES = {COMMONROAD: ".xml", SCENARIONET: ".pkl"}


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
