"""What a job made as scenarios in a standard format, with what is lost and where it comes from."""

import re
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from augment.errors import Conflict, UnknownName
from augment.formats.interplan.file import InterplanSource
from augment.formats.nuplan_log import NuPlan
from augment.formats.writers import WRITERS, writer_named
from augment.formats.writing import Cell, Loss, Written
from augment.models import Augmentation, BaseScene, GenerationJob, Simulation
from augment.scene.codec import modification_from_document, recording_from_document
from augment.scene.entities import AgentType, TrafficAgent
from augment.scene.motion import Motion, MotionSource, Movement
from augment.services.judging.simulations import trace_document
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
        by_licence: dict[bool | None, list[str]] = defaultdict(list)
        for source in self.sources:
            by_licence[source.is_non_commercial].append(source.scene)
        texts = {
            True: "Made from data that must not be used commercially: %s; so must these files.",
            None: "The licence of these sources is not known: %s.",
        }
        return tuple(
            text % ", ".join(by_licence[bound])
            for bound, text in texts.items()
            if bound in by_licence
        )


def export_job(
    job: GenerationJob, *, file_format: str, contestant: str | None = None, motion: str = RECORDED
) -> Exported:
    """Return all that a job made, as scenarios of that format.

    Args:
        job: Whose modifications are written, ordered by scenario and contestant.
        file_format: One of `FORMATS`.
        contestant: The slug of the only contestant to write; None for all.
        motion: `RECORDED`, or the name of a planner whose finished drives say what everybody does.

    Raises:
        UnknownName: No such format or contestant, or nothing was driven by that planner.
        Conflict: Nothing is there to write.
    """
    writer_named(file_format)  # what nobody can write is refused before anything is read
    rows = job.augmentations.select_related("scenario__base_scene", "contestant")
    slugs = sorted(set(rows.values_list("contestant__slug", flat=True)))
    if contestant is not None and contestant not in slugs:
        raise UnknownName("contestant", contestant, slugs)
    rows = rows.filter(contestant__slug__in=slugs if contestant is None else [contestant])
    return export_rows(
        rows.order_by("scenario__slug", "contestant__slug", "sample"),
        ExportOrigin(kind="job", name=job.name, code=str(job.code)),
        file_format,
        many=job.samples > 1,
        drives=None if motion == RECORDED else _drives(job, motion),
    )


def export_rows(
    rows: Iterable[Augmentation],
    origin: ExportOrigin,
    file_format: str,
    *,
    many: bool = False,
    drives: Mapping[int, Simulation] | None = None,
) -> Exported:
    """Return augmentations as scenarios of that format.

    Args:
        rows: In their order, with scenario, its scene, and contestant.
        origin: What they were taken from.
        file_format: One of `FORMATS`.
        many: Whether cells have several samples, which the names then say.
        drives: By the key of an augmentation the drive that says what everybody does; None where
            what was recorded does.

    Raises:
        UnknownName: No such format.
        Conflict: Nothing is there to write.
    """
    writer = writer_named(file_format)
    cells, missing, undriven = [], [], []
    scenes: dict[str, BaseScene] = {}
    for row in rows:
        name = f"{row.scenario.slug} by {row.contestant.slug}"
        name += f", sample {row.sample}" if many else ""
        if row.modification is None:
            text = f"there is no modification: {row.state}"
            missing.append(Loss(cell=name, text=text, changes_scene=True))
            continue
        cell = _cell(name, row, many=many)
        if drives is not None and row.pk in drives:
            cell = replace(cell, drive=_motion(cell, trace_document(drives[row.pk])))
        elif drives is not None:
            undriven.append(Loss(cell=name, text="not driven; written as recorded"))
        cells.append(cell)
        scenes[row.scenario.base_scene.slug] = row.scenario.base_scene
    if not cells:
        raise Conflict(f"{origin.name} has no modification that could be written.")
    written = writer(cells)
    return Exported(
        origin=origin,
        format=file_format,
        written=replace(written, losses=(*undriven, *written.losses)),
        missing=tuple(missing),
        sources=tuple(_source(scenes[slug]) for slug in sorted(scenes)),
    )


# --- Private -----------------------------------------------------------------------------------


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
    scenario, scene = row.scenario, row.scenario.base_scene
    source = None
    if scene.source == NuPlan.name and scene.source_item:
        source = InterplanSource(token=scene.source_item, **(scenario.interplan or {}))
    return Cell(
        name=name,
        stem=f"{scenario.slug}--{row.contestant.slug}" + (f"--{row.sample}" if many else ""),
        scene=scene_of(scenario),
        type=type_of(scenario.type),
        modification=modification_from_document(row.modification),
        keeps_traffic=scenario.keep_traffic,
        made_on=(row.finished_at or row.created_at).date(),
        recording=None if scene.recording is None else recording_from_document(scene.recording),
        source=source,
    )


def _source(row: BaseScene) -> Source:
    bound = bool(_NON_COMMERCIAL.search(row.provenance))
    is_known = bound or row.provenance.lower().startswith(_OWN)
    return Source(
        scene=row.slug,
        format=row.source,
        provenance=row.provenance,
        is_non_commercial=bound if is_known else None,
    )


def _motion(cell: Cell, trace: dict[str, Any]) -> Motion:
    """Return what everybody did in a drive; agents that are not in the drive stand."""
    steps = int(trace["steps"])
    driven = {one["id"]: one for one in trace["objects"]}
    agents = {agent.id: agent for agent in cell.after.agents}
    for one in trace["objects"]:
        if one["id"] not in agents:  # it came later
            pose = next(pose for pose in one["poses"] if pose)
            agents[one["id"]] = TrafficAgent(
                id=one["id"],
                type=AgentType(one["type"]),
                **dict(zip(("x_m", "y_m", "heading_rad", "speed_mps"), pose, strict=True)),
                width_m=one["width_m"],
                length_m=one["length_m"],
            )
    states = np.array(trace["ego"]["poses"], dtype=np.float64)
    return Motion(
        times_s=np.arange(steps, dtype=np.float64) * float(trace["step_s"]),
        ego=Movement(agent=cell.after.ego, source=MotionSource.SIMULATED, states=states),
        others=tuple(_movement(agent, driven.get(name), steps) for name, agent in agents.items()),
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
