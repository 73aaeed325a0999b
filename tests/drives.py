"""Driven rows without a drive of 15 s each: a short one, made once, stands for all."""

import json
import zlib
from collections.abc import Iterable
from functools import cache
from typing import Any

from augment.models import Augmentation, GenerationJob, Simulation
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from augment.services.driving import simulations
from augment.services.driving.simulations import Options
from augment.simulation.drive import find_expert, run
from augment.simulation.pdm_closed import PdmClosed
from augment.simulation.road import Road
from augment.simulation.score import ScoreKind, score_drive
from augment.simulation.trace import make_trace
from augment.simulation.traffic import DriveSetting
from tests.scenes import cone, scene


@cache
def short_drive() -> tuple[bytes, dict[str, Any]]:
    """A packed trace and a document of 1.2 s towards two cones."""
    change = Modification(added=(cone("Agent2", 20.0, 0.5), cone("Agent3", 25.0, -0.5)))
    setting = DriveSetting(scene=scene(), modification=change)
    road = Road(setting.scene)
    drive = run(setting, PdmClosed((0.0, 1.0)), road=road, steps=12)
    score = score_drive(drive, find_expert(setting, road, steps=12))
    document = simulations.drive_document(drive, dict.fromkeys(ScoreKind, score))
    trace = json.dumps(make_trace(setting, drive, score)).encode()
    return zlib.compress(trace), document


def driven(
    job: GenerationJob, *, before: float = 1.0, after: float = 0.25, **how: Any
) -> list[Simulation]:
    """Every outcome of a job as driven, with these scores; the augmentations' rows last."""
    options = Options(**how)
    simulations.plan_job(job=job, options=options)
    trace, document = short_drive()
    rows = list(options.of(Simulation.objects.order_by("augmentation_id", "pk")))
    for row in rows:
        score = before if row.subject == Simulation.Subject.UNMODIFIED else after
        row.state, row.trace, row.document = Simulation.State.DONE, trace, document
        row.nuplan_score = row.interplan_score = score
        row.save()
    return sorted(rows, key=lambda row: (row.augmentation_id is not None, row.pk))


def finished(job: GenerationJob) -> GenerationJob:
    """The job with an outcome in each of its rows."""
    job.augmentations.update(
        state=Augmentation.State.DONE,
        image="bev/x.png",
        modification=modification_to_document(Modification()),
    )
    GenerationJob.objects.filter(pk=job.pk).update(state=GenerationJob.State.FINISHED)
    job.refresh_from_db()
    return job


def drive_pictures(rows: Iterable[Augmentation], **how: object) -> list[Simulation]:
    """A drive of each of these augmentations, in which everything changed is named after it."""
    trace, document = short_drive()
    made = []
    for row in rows:
        own = json.loads(zlib.decompress(trace))
        for one in own["objects"]:
            one["id"] = f"{row.contestant.slug}-{one['id']}"
        columns = {"planner": "pdm-closed", "offsets": "paper", "is_reactive": False} | how
        made.append(
            Simulation.objects.create(
                scenario=row.scenario,
                augmentation=row,
                subject=Simulation.Subject.AUGMENTATION,
                state=Simulation.State.DONE,
                nuplan_score=0.4321,
                interplan_score=0.4321,
                document=document,
                trace=zlib.compress(json.dumps(own).encode()),
                **columns,
            )
        )
    return made
