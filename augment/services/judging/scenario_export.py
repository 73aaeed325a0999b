"""Export of a job's scenarios in a standard format, with losses and sources."""

import re
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass

from augment.errors import Conflict, UnknownName
from augment.formats import nuplan_log, writers, writing
from augment.formats.interplan.file import InterplanSource
from augment.models import Augmentation, BaseScene, GenerationJob
from augment.scene.codec import modification_from_document
from augment.services.scenarios.choosing import find_type
from augment.services.scenarios.scenes import LoadedScenario

FORMATS = tuple(writers.WRITERS)

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
    """Origin of exported scenarios: its kind ("job", "study"), name and code."""

    kind: str
    name: str
    code: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Archive:
    """The files of scenarios and what is to be said with them.

    Attributes:
        missing: Scenarios without a modification, which have no file.
    """

    origin: ExportOrigin
    format: str
    written: writing.Output
    missing: tuple[writing.Loss, ...]
    sources: tuple[Source, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings for whoever passes the files on."""
        return list_warnings(self.sources)


def list_warnings(sources: Iterable[Source]) -> tuple[str, ...]:
    """Return the warnings for whoever passes on files that were made from these."""
    by_licence: dict[bool | None, list[str]] = defaultdict(list)
    for source in sources:
        by_licence[source.is_non_commercial].append(source.scene)
    texts = {
        True: "Made from data that must not be used commercially: %s; so must these files.",
        None: "The licence of these sources is not known: %s.",
    }
    return tuple(
        text % ", ".join(by_licence[bound]) for bound, text in texts.items() if bound in by_licence
    )


def scene_source(row: BaseScene) -> Source:
    """Return a scene with what its provenance says of its licence."""
    bound = bool(_NON_COMMERCIAL.search(row.provenance))
    is_known = bound or row.provenance.lower().startswith(_OWN)
    return Source(
        scene=row.slug,
        format=row.source,
        provenance=row.provenance,
        is_non_commercial=bound if is_known else None,
    )


def export_job(job: GenerationJob, *, file_format: str, contestant: str | None = None) -> Archive:
    """Return all that a job made, as scenarios of that format.

    Args:
        job: Whose modifications are written, ordered by scenario and contestant.
        file_format: One of `FORMATS`.
        contestant: The slug of the only contestant to write; None for all.

    Raises:
        UnknownName: No such format or contestant.
        Conflict: Nothing is there to write.
    """
    writers.writer_named(file_format)  # what nobody can write is refused before anything is read
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
    )


def export_rows(
    rows: Iterable[Augmentation], origin: ExportOrigin, file_format: str, *, many: bool = False
) -> Archive:
    """Return augmentations as scenarios of that format.

    Args:
        rows: In their order, with scenario, its scene, and contestant.
        origin: What they were taken from.
        file_format: One of `FORMATS`.
        many: Whether cells have several samples, which the names then say.

    Raises:
        UnknownName: No such format.
        Conflict: Nothing is there to write.
    """
    writer = writers.writer_named(file_format)
    cells, missing = [], []
    scenes: dict[str, BaseScene] = {}
    for row in rows:
        name = f"{row.scenario.slug} by {row.contestant.slug}"
        name += f", sample {row.sample}" if many else ""
        if row.modification is None:
            text = f"there is no modification: {row.state}"
            missing.append(writing.Loss(cell=name, text=text, changes_scene=True))
            continue
        # interPlan's format has no motion, and our own only what was recorded.
        moves = file_format not in ("interplan", "json")
        cells.append(_cell(name, row, many=many, moves=moves))
        scenes[row.scenario.base_scene.slug] = row.scenario.base_scene
    if not cells:
        raise Conflict(f"{origin.name} has no modification that could be written.")
    return Archive(
        origin=origin,
        format=file_format,
        written=writer(cells),
        missing=tuple(missing),
        sources=tuple(scene_source(scenes[slug]) for slug in sorted(scenes)),
    )


# --- Private -----------------------------------------------------------------------------------


def _cell(name: str, row: Augmentation, *, many: bool, moves: bool) -> writing.Cell:
    scenario, scene = row.scenario, row.scenario.base_scene
    loaded, modification = LoadedScenario(scenario), modification_from_document(row.modification)
    # Who drives by interPlan's rules goes as they expect it.
    is_ruled = moves and loaded.scene.options.interplan is not None
    source = None
    if scene.source == nuplan_log.NuPlan.name and scene.source_item:
        source = InterplanSource(token=scene.source_item, **(scenario.interplan or {}))
    return writing.Cell(
        name=name,
        stem=f"{scenario.slug}--{row.contestant.slug}" + (f"--{row.sample}" if many else ""),
        scene=loaded.scene,
        type=find_type(scenario.type),
        modification=modification,
        keeps_traffic=scenario.keep_traffic,
        made_on=(row.finished_at or row.created_at).date(),
        recording=loaded.recording,
        expected=loaded.expect(loaded.scene, modification) if is_ruled else None,
        augmentation=str(row.code),
        contestant=row.contestant.slug,
        source=source,
    )
