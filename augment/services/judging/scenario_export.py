"""What a job made as scenarios in a standard format, with what is lost and where it comes from."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from augment.errors import Conflict, UnknownName
from augment.formats.writers import WRITERS, writer_named
from augment.formats.writing import Cell, Loss, Written
from augment.models import Augmentation, BaseScene, GenerationJob, Simulation
from augment.scene.codec import modification_from_document, recording_from_document
from augment.scene.entities import AgentType, TrafficAgent
from augment.scene.motion import Motion, MotionSource, Movement
from augment.scene.recording import Recording
from augment.services.judging.simulations import trace_document
from augment.services.scenarios.interplan import refuse_changes
from augment.services.scenarios.scenes import scene_of, type_of

FORMATS = tuple(WRITERS)
RECORDED = "recorded"

_NON_COMMERCIAL = re.compile(r"\bNC\b|non-?commercial", re.IGNORECASE)
_OWN = "authored by this project"


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """A scene that scenarios were made from.

    Attributes:
        provenance: Where it comes from, with its licence.
        is_non_commercial: None where the provenance names no licence that is known.
    """

    scene: str
    format: str
    provenance: str
    is_non_commercial: bool | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportOrigin:
    """What scenarios were taken from: its kind ("job", "study"), name and code."""

    kind: str
    name: str
    code: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Exported:
    """The files of scenarios and what is to be said with them.

    Attributes:
        missing: Scenarios without a modification, which have no file.
    """

    origin: ExportOrigin
    format: str
    written: Written
    missing: tuple[Loss, ...]
    sources: tuple[Source, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """What anyone who passes the files on has to know."""
        bound = [source.scene for source in self.sources if source.is_non_commercial]
        unknown = [source.scene for source in self.sources if source.is_non_commercial is None]
        lines = []
        if bound:
            lines.append(
                f"Made from data that must not be used commercially: {', '.join(bound)}; its "
                "licence holds for these files too."
            )
        if unknown:
            lines.append(f"The licence of these sources is not known: {', '.join(unknown)}.")
        return tuple(lines)


def export_job(
    job: GenerationJob,
    *,
    file_format: str,
    contestant: str | None = None,
    motion: str = RECORDED,
    strict: bool = False,
) -> Exported:
    """Return all that a job made, as scenarios of that format.

    Args:
        job: Whose modifications are written, ordered by scenario and contestant.
        file_format: One of `FORMATS`.
        contestant: The slug of the only contestant to write; None for all.
        motion: `RECORDED`, or the name of a planner whose finished drives say what everybody does.
        strict: Whether nothing is written once a scenario would not be the same there.

    Raises:
        UnknownName: No such format or contestant, or nothing was driven by that planner.
        Conflict: Nothing is there to write, or `strict` and something would change.
    """
    writer_named(file_format)  # what nobody can write is refused before anything is read
    rows = _rows(job, contestant)
    drives = {} if motion == RECORDED else _drives(job, motion)
    origin = ExportOrigin(kind="job", name=job.name, code=str(job.code))
    driven_by = None if motion == RECORDED else motion
    return export_rows(
        *(rows, origin, file_format),
        many=job.samples > 1,
        drives=drives,
        driven_by=driven_by,
        strict=strict,
    )


def export_rows(
    rows: Sequence[Augmentation],
    origin: ExportOrigin,
    file_format: str,
    *,
    many: bool = False,
    drives: Mapping[int, Simulation] | None = None,
    driven_by: str | None = None,
    strict: bool = False,
) -> Exported:
    """Return augmentations as scenarios of that format.

    Args:
        rows: In their order, with scenario, its scene, and contestant.
        origin: What they were taken from.
        file_format: One of `FORMATS`.
        many: Whether cells have several samples, which the names then say.
        drives: By the key of an augmentation the drive that says what everybody does.
        driven_by: The planner of the drives; None where what was recorded is written.
        strict: Whether nothing is written once a scenario would not be the same there.

    Raises:
        UnknownName: No such format.
        Conflict: Nothing is there to write, or `strict` and something would change.
    """
    writer, found = writer_named(file_format), drives or {}
    cells, missing, extra = [], [], []
    scenes: dict[str, BaseScene] = {}
    for row in rows:
        cell_name = f"{row.scenario.slug} by {row.contestant.slug}"
        if many:
            cell_name += f", sample {row.sample}"
        if row.modification is None:
            text = f"there is no modification: {row.state}"
            missing.append(Loss(cell=cell_name, text=text, changes_scene=True))
            continue
        cell = _cell(cell_name, row, many=many)
        if row.pk in found:
            cell = replace(cell, drive=_motion(cell, trace_document(found[row.pk])))
        elif driven_by is not None:
            text = f"{driven_by} has not driven it; not as driven"
            extra.append(Loss(cell=cell_name, text=text))
        cells.append(cell)
        scenes[row.scenario.base_scene.slug] = row.scenario.base_scene
    if not cells:
        raise Conflict(f"{origin.name} has no modification that could be written.")
    written = writer(cells)
    written = replace(written, losses=(*extra, *written.losses))
    if strict:
        refuse_changes([*missing, *written.refused, *written.losses], where=file_format)
    return Exported(
        origin=origin,
        format=file_format,
        written=written,
        missing=tuple(missing),
        sources=tuple(_source(scenes[slug]) for slug in sorted(scenes)),
    )


# --- Private -----------------------------------------------------------------------------------


def _rows(job: GenerationJob, contestant: str | None) -> Sequence[Augmentation]:
    rows = job.augmentations.select_related("scenario__base_scene", "contestant")
    slugs = sorted(set(rows.values_list("contestant__slug", flat=True)))
    if contestant is not None:
        if contestant not in slugs:
            raise UnknownName("contestant", contestant, slugs)
        rows = rows.filter(contestant__slug=contestant)
    return list(rows.order_by("scenario__slug", "contestant__slug", "sample"))


def _drives(job: GenerationJob, planner: str) -> dict[int, Simulation]:
    """Return the newest finished drive of each augmentation by its key."""
    done = Simulation.objects.filter(augmentation__job=job, state=Simulation.State.DONE)
    drives = {
        row.augmentation_id: row
        for row in done.filter(planner=planner).order_by("finished_at", "pk")
        if row.augmentation_id is not None
    }
    if not drives:
        known = sorted(set(done.values_list("planner", flat=True)))
        raise UnknownName("motion", planner, [RECORDED, *known])
    return drives


def _cell(name: str, row: Augmentation, *, many: bool) -> Cell:
    scenario = row.scenario
    assert row.modification is not None
    return Cell(
        name=name,
        stem=f"{scenario.slug}--{row.contestant.slug}" + (f"--{row.sample}" if many else ""),
        scene=scene_of(scenario),
        type=type_of(scenario.type),
        modification=modification_from_document(row.modification),
        keeps_traffic=scenario.keep_traffic,
        made_on=(row.finished_at or row.created_at).date(),
        recording=_recording(scenario.base_scene),
    )


def _recording(base_scene: BaseScene) -> Recording | None:
    if base_scene.recording is None:
        return None
    return recording_from_document(base_scene.recording)


def _source(row: BaseScene) -> Source:
    bound: bool | None = None
    if _NON_COMMERCIAL.search(row.provenance):
        bound = True
    elif row.provenance.lower().startswith(_OWN):
        bound = False
    return Source(
        scene=row.slug, format=row.source, provenance=row.provenance, is_non_commercial=bound
    )


def _motion(cell: Cell, trace: dict[str, Any]) -> Motion:
    """Return what everybody did in a drive; agents that are not in the drive stand."""
    steps = int(trace["steps"])
    driven = {one["id"]: one for one in trace["objects"]}
    agents = [(agent, driven.pop(agent.id, None)) for agent in cell.after.agents]
    for one in driven.values():  # they came later
        pose = next(pose for pose in one["poses"] if pose)
        later = TrafficAgent(
            id=one["id"],
            type=AgentType(one["type"]),
            **dict(zip(("x_m", "y_m", "heading_rad", "speed_mps"), pose, strict=True)),
            width_m=one["width_m"],
            length_m=one["length_m"],
        )
        agents.append((later, one))
    ego = Movement(
        agent=cell.after.ego,
        source=MotionSource.SIMULATED,
        states=np.array(trace["ego"]["poses"], dtype=np.float64),
    )
    return Motion(
        times_s=np.arange(steps, dtype=np.float64) * float(trace["step_s"]),
        ego=ego,
        others=tuple(_movement(agent, one, steps) for agent, one in agents),
    )


def _movement(agent: TrafficAgent, one: dict[str, Any] | None, steps: int) -> Movement:
    """Return the states of an agent; a trace holds one pose for standing, none for gaps."""
    if one is None or (one["first"] == 0 and len(one["poses"]) == 1):
        here = [agent.x_m, agent.y_m, agent.heading_rad, 0.0]
        return Movement(
            agent=agent, source=MotionSource.STANDING, states=np.tile(here, (steps, 1))
        )
    states = np.full((steps, 4), np.nan)
    for step, pose in enumerate(one["poses"], start=one["first"]):
        if pose is not None:
            states[step] = pose
    return Movement(agent=agent, source=MotionSource.SIMULATED, states=states)
