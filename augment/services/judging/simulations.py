"""Drives as rows: planned once, claimed by one worker, driven, scored, kept."""

from __future__ import annotations

import json
import logging
import time
import zlib
from collections.abc import Callable, Collection, Iterable
from dataclasses import asdict, dataclass
from datetime import timedelta
from types import TracebackType
from typing import Any
from uuid import UUID, uuid4

from django.conf import settings
from django.db import transaction
from django.db.models import Q, QuerySet
from django.utils import timezone

from augment.errors import AugmentError, Conflict, LeaseLost
from augment.models import Augmentation, GenerationJob, Scenario, Simulation
from augment.scene.codec import modification_from_document
from augment.scene.modification import Modification
from augment.scene.recording_codec import recording_from_document
from augment.sentences import sentence
from augment.services.clock import DATABASE_TIME, Moment
from augment.services.scenarios.scenes import reference_of, scene_of
from augment.services.scenarios.types import type_of
from augment.simulation.criticality import criticality
from augment.simulation.drive import Drive, run
from augment.simulation.expert import expert_of
from augment.simulation.planners import NAMED, PDM_CLOSED, planner_named
from augment.simulation.planning import Planner
from augment.simulation.progress import red_lights
from augment.simulation.road import Road
from augment.simulation.score import Score, ScoreKind, score_drive
from augment.simulation.setting import DriveSetting
from augment.simulation.trace import trace_of

logger = logging.getLogger(__name__)

State, Subject = Simulation.State, Simulation.Subject
BEAT_EVERY_S = 5.0
NUPLAN, INTERPLAN = ScoreKind.NUPLAN.value, ScoreKind.INTERPLAN.value
SCORES = {NUPLAN: "nuplan_score", INTERPLAN: "interplan_score"}
"""Which column a score is in."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """How to drive."""

    planner: str = PDM_CLOSED
    offsets: str = "paper"
    is_reactive: bool = False

    def of(self, rows: QuerySet[Simulation]) -> QuerySet[Simulation]:
        """Those driven so."""
        return rows.filter(**self.columns)

    @property
    def columns(self) -> dict[str, Any]:
        """As a row has them."""
        return asdict(self)


def allowed_planners() -> tuple[str, ...]:
    """Return the planners that workers of this installation may load."""
    return (*NAMED, *settings.PLANNERS)


def load_planner(how: Options | Simulation, *, also: Collection[str] = ()) -> Planner:
    """Return the planner that options or a row name, if this process may load it.

    Args:
        how: What names it.
        also: Allowed in this process, beside the built-in planners and the setting PLANNERS.

    Raises:
        UnknownName, CannotDrive: There is no such planner, or it is not allowed.
    """
    allowed = (*settings.PLANNERS, *also)
    return planner_named(how.planner, offsets=how.offsets, allowed=allowed)


@transaction.atomic
def plan_job(*, job: GenerationJob, options: Options, also: Collection[str] = ()) -> list[int]:
    """Have every outcome of a job driven, with its scenes before the change and as referred to.

    What was driven so already stays; what failed waits again.

    Returns:
        The keys of all rows that wait.

    Raises:
        UnknownName, CannotDrive: As `load_planner`.
        Conflict: The job has nothing to drive yet.
    """
    load_planner(options, also=also)
    rows = job.augmentations.filter(state__in=Augmentation.SHOWABLE).select_related("scenario")
    if not rows:
        raise Conflict(
            sentence("“%(name)s” has no result yet that could be driven.", name=job.name)
        )
    made: list[Simulation] = []
    for scenario in {row.scenario_id: row.scenario for row in rows}.values():
        made += _of_scenario(scenario, options)
    made += [
        _row(row.scenario, Subject.AUGMENTATION, options, augmentation=row)
        for row in rows.defer("modification")
    ]
    return [row.pk for row in made if row.state == State.QUEUED]


@transaction.atomic
def plan_scenario(
    *, scenario: Scenario, options: Options, also: Collection[str] = ()
) -> list[int]:
    """Have one scenario driven before the change and with its reference; as `plan_job`."""
    load_planner(options, also=also)
    return [row.pk for row in _of_scenario(scenario, options) if row.state == State.QUEUED]


def drive(*, simulation_pk: int, also: Collection[str] = ()) -> bool:
    """Claim a row, drive it and write its outcome. A row that nobody may claim is left alone.

    Args:
        simulation_pk: Which.
        also: Planners that may be loaded, as `load_planner` takes them.

    Returns:
        Whether the row was claimed.
    """
    claim = uuid4()
    mine = Simulation.objects.filter(pk=simulation_pk, state=State.QUEUED)
    if not mine.update(state=State.RUNNING, claim=claim, heartbeat_at=DATABASE_TIME):
        return False
    rows = Simulation.objects.select_related("scenario__base_scene", "augmentation")
    row = rows.get(pk=simulation_pk)
    with _Settling(row, claim) as settling:
        settling.outcome = _driven(row, _Beating(simulation_pk, claim), also)
    return True


def requeue_stale(*, older_than: timedelta, now: Moment = DATABASE_TIME) -> int:
    """Let drives wait again whose worker gave no sign of life for so long."""
    silent = Simulation.objects.filter(state=State.RUNNING, heartbeat_at__lt=now - older_than)
    return silent.update(state=State.QUEUED, claim=None, heartbeat_at=None, sent_at=None)


def find_unsent(*, older_than: timedelta, now: Moment = DATABASE_TIME) -> list[int]:
    """Return the keys of waiting rows without a message, or with one sent so long ago.

    Rows of a planner that no worker may load wait for the command that named it.
    """
    waiting = Simulation.objects.filter(state=State.QUEUED, planner__in=allowed_planners())
    old = Q(sent_at=None) | Q(sent_at__lt=now - older_than)
    return list(waiting.filter(old).order_by("pk").values_list("pk", flat=True))


def mark_sent(ids: Iterable[int]) -> None:
    """Remember that a message was sent for these."""
    Simulation.objects.filter(pk__in=list(ids)).update(sent_at=DATABASE_TIME)


def document_of(drove: Drive, scores: dict[ScoreKind, Score]) -> dict[str, Any]:
    """The parts of the scores, and what else is said of a drive; no series."""
    score = scores[ScoreKind.NUPLAN]
    return {
        "duration_s": round(drove.duration_s, 1),
        "at_map_end": drove.at_map_end,
        "recorded_s": None if drove.recorded_s is None else round(drove.recorded_s, 1),
        "outlasts_recording": drove.outlasts_recording,
        "emergency_brake_steps": sum(plan.braking for plan in drove.plans),
        "red_light_compliance": red_lights(drove).value,
        "expert": {"kind": score.expert.kind.value, "progress_m": score.expert.progress_m},
        "collisions": [
            {
                "time_s": round(collision.moment * 0.1, 1),
                "object": collision.object_id,
                "contact": collision.contact.name.lower(),
                "at_fault": collision.at_fault,
            }
            for collision in score.collisions
        ],
        "criticality": asdict(criticality(drove, score.collisions)),
        "metrics": {
            kind.value: [
                {
                    "name": metric.name,
                    "value": metric.value,
                    "weight": metric.weight,
                    "parts": metric.parts,
                }
                for metric in found.metrics
            ]
            for kind, found in scores.items()
        },
    }


def trace_document(row: Simulation) -> dict[str, Any]:
    """The drive to look at."""
    document: dict[str, Any] = json.loads(zlib.decompress(bytes(row.trace or b"")))
    return document


# Private


class _Settling:
    """Writes the outcome of a claimed drive, whatever becomes of it.

    A planner from outside may raise anything: that is an outcome of its drive, and is logged. A
    worker that is told to stop gives the row back. A lost lease ends quietly.
    """

    def __init__(self, row: Simulation, claim: UUID) -> None:
        self._row = row
        self._held = Simulation.objects.filter(pk=row.pk, claim=claim)
        self.outcome: dict[str, Any] = {"state": State.QUEUED}

    def __enter__(self) -> _Settling:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> bool:
        if isinstance(error, LeaseLost):
            return True
        if isinstance(error, AugmentError):
            self.outcome = {"state": State.FAILED, "reason": str(error)}
        elif isinstance(error, Exception):
            logger.error("Drive %s failed", self._row.code, exc_info=error)
            said = f"{type(error).__name__}: {error}"[:500]
            self.outcome = {"state": State.FAILED, "reason": said}
        is_over = self.outcome["state"] != State.QUEUED
        ended = {"finished_at": timezone.now()} if is_over else {}
        self._held.update(claim=None, heartbeat_at=None, **ended, **self.outcome)
        return isinstance(error, Exception)


class _Beating:
    """Told after each step; now and then it shows that the drive is alive, and asks if it may."""

    def __init__(self, pk: int, claim: UUID) -> None:
        self._rows = Simulation.objects.filter(pk=pk, claim=claim)
        self._last = time.monotonic()

    def __call__(self, step: int) -> None:
        if time.monotonic() - self._last < BEAT_EVERY_S:
            return
        self._last = time.monotonic()
        if not self._rows.update(heartbeat_at=DATABASE_TIME):
            raise LeaseLost


def _of_scenario(scenario: Scenario, options: Options) -> list[Simulation]:
    made = [_row(scenario, Subject.UNMODIFIED, options)]
    if scenario.reference is not None:
        made.append(_row(scenario, Subject.REFERENCE, options))
    return made


def _row(
    scenario: Scenario,
    subject: Simulation.Subject,
    options: Options,
    *,
    augmentation: Augmentation | None = None,
) -> Simulation:
    row, _ = Simulation.objects.get_or_create(
        scenario=scenario, subject=subject, augmentation=augmentation, **options.columns
    )
    if row.state == State.FAILED:
        row.state, row.reason, row.sent_at = State.QUEUED, "", None
        row.save(update_fields=["state", "reason", "sent_at"])
    return row


def _driven(
    row: Simulation, beating: Callable[[int], None], also: Collection[str]
) -> dict[str, Any]:
    """The columns of a row's outcome."""
    setting = setting_of(row)
    road = Road(setting.scene, setting.recording)
    planner = load_planner(row, also=also)
    drove = run(setting, planner, road=road, after_step=beating)
    expert = expert_of(setting, road)
    kind = type_of(row.scenario.type)
    scores = {
        name: score_drive(
            drove,
            expert,
            kind=name,
            scenario_type=kind,
            modification=setting.modification,
        )
        for name in ScoreKind
    }
    trace = json.dumps(trace_of(setting, drove, scores[ScoreKind.NUPLAN]), separators=(",", ":"))
    return {
        "state": State.DONE,
        "reason": "",
        "nuplan_score": scores[ScoreKind.NUPLAN].value,
        "interplan_score": scores[ScoreKind.INTERPLAN].value,
        "document": document_of(drove, scores),
        "trace": zlib.compress(trace.encode(), 6),
    }


def setting_of(row: Simulation) -> DriveSetting:
    """What a row drives.

    Raises:
        InvalidDocument: Something stored can't be read.
    """
    scenario = row.scenario
    recording = scenario.base_scene.recording
    return DriveSetting(
        scene=scene_of(scenario),
        modification=_modification(row),
        recording=None if recording is None else recording_from_document(recording),
        replay=scenario.keep_traffic,
        reactive=row.is_reactive,
    )


def _modification(row: Simulation) -> Modification:
    """What changes; an answer that was unreadable or refused leaves the scene as it was."""
    if row.subject == Subject.REFERENCE:
        return reference_of(row.scenario) or Modification()
    if row.augmentation is None or row.augmentation.modification is None:
        return Modification()
    return modification_from_document(row.augmentation.modification)
