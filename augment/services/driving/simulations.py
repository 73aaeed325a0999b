"""Drives as rows: planned once, driven, scored, kept."""

import json
import zlib
from collections.abc import Collection
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

from django.conf import settings
from django.db import transaction
from django.db.models import QuerySet

from augment.errors import CannotDrive, Conflict
from augment.models import Augmentation, GenerationJob, Scenario, Simulation
from augment.scene.codec import modification_from_document
from augment.scene.density import fit_boxes
from augment.scene.entities import Modification
from augment.services.clock import Moment
from augment.services.driving.thresholds import conclude, conclude_all, list_allowed_planners
from augment.services.scenarios.choosing import find_type
from augment.services.scenarios.scenes import LoadedScenario
from augment.services.work import Lease, Settlement, WorkKind
from augment.simulation.drive import Drive, find_expert, run
from augment.simulation.planners import PDM_CLOSED, planner_named
from augment.simulation.planning import Planner
from augment.simulation.score import Score, ScoreKind, criticality, score_drive
from augment.simulation.trace import blind_trace, make_trace
from augment.simulation.traffic import VERSION, DriveSetting

State, Subject = Simulation.State, Simulation.Subject
NUPLAN, INTERPLAN = ScoreKind.NUPLAN.value, ScoreKind.INTERPLAN.value
SCORES = {NUPLAN: "nuplan_score", INTERPLAN: "interplan_score"}
"""Which column a score is in."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """Options of a drive."""

    planner: str = PDM_CLOSED
    offsets: str = "paper"
    is_reactive: bool = False
    version: int = VERSION

    @property
    def name(self) -> str:
        """Planner, with its offsets and traffic where they matter."""
        offsets = f", {self.offsets}" if self.planner == PDM_CLOSED else ""
        return f"{self.planner}{offsets}{', reactive' * self.is_reactive}"

    def of(self, rows: QuerySet[Simulation]) -> QuerySet[Simulation]:
        """Return the drives with these options."""
        return rows.filter(**asdict(self))


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
        raise Conflict(f"“{job.name}” has no result yet that could be driven.")
    scenarios = {row.scenario_id: row.scenario for row in rows}
    waiting = [pk for scenario in scenarios.values() for pk in _plan_scenario(scenario, options)]
    for row in rows.defer("modification"):
        waiting += _plan(row.scenario, Subject.AUGMENTATION, options, augmentation=row)
    return waiting


@transaction.atomic
def plan_scenario(
    *, scenario: Scenario, options: Options, also: Collection[str] = ()
) -> list[int]:
    """Have one scenario driven before the change and with its reference; as `plan_job`."""
    load_planner(options, also=also)
    return _plan_scenario(scenario, options)


class Drives(WorkKind[Simulation]):
    """Planned drives.

    Args:
        also: Planners that may be loaded, as `load_planner` takes them.
    """

    model = Simulation
    priority = 9
    lost_limit = 5
    related = ("scenario__base_scene", "augmentation", "swept")

    def __init__(self, also: Collection[str] = ()) -> None:
        self._also = also

    def sendable(self) -> QuerySet[Simulation]:
        """Return the drives that may be sent; planners from a command wait for that command."""
        return super().sendable().filter(planner__in=list_allowed_planners())

    def run(self, row: Simulation, held: Lease[Simulation]) -> Settlement:
        """Drive and score; a planner from outside may raise anything."""
        if row.version != VERSION:
            raise CannotDrive(f"Version {row.version} of drives is no more; simulate it anew.")
        setting = _load_setting(row)
        planner = load_planner(row, also=self._also)
        drove = run(setting, planner, after_step=lambda step: held.insist())
        expert = find_expert(setting, drove.road)
        score = partial(score_drive, drove, expert, modification=setting.modification)
        scenario_type = find_type(row.scenario.type)
        scores = {kind: score(kind=kind, scenario_type=scenario_type) for kind in ScoreKind}
        trace = make_trace(setting, drove, scores[ScoreKind.NUPLAN])
        columns = {
            **{SCORES[kind.value]: score.value for kind, score in scores.items()},
            "document": drive_document(drove, scores),
            "trace": zlib.compress(json.dumps(trace, separators=(",", ":")).encode(), 6),
        }
        return Settlement(state=State.DONE, columns=columns)

    def after_commit(self, row: Simulation, outcome: Settlement | None) -> None:
        """Conclude the sweep of which this was the last drive."""
        if row.swept is not None:
            conclude(row.swept.sweep_id)

    def cleanup(self, now: Moment) -> None:
        """Conclude the sweeps whose workers died before they could."""
        conclude_all()


DRIVES = Drives()


def drive_document(drove: Drive, scores: dict[ScoreKind, Score]) -> dict[str, Any]:
    """Return the parts of the scores, and what else is said of a drive; no series."""
    score = scores[ScoreKind.NUPLAN]
    return {
        "duration_s": round(drove.duration_s, 1),
        "recorded_s": None if drove.recorded_s is None else round(drove.recorded_s, 1),
        "outlasts_recording": drove.outlasts_recording,
        "emergency_brake_steps": sum(plan.braking for plan in drove.plans),
        "expert": {"kind": score.expert.kind.value, "progress_m": score.expert.progress_m},
        "collisions": [
            {"object": contact.object_id, "at_fault": contact.at_fault}
            for contact in score.collisions
        ],
        "criticality": criticality(drove, score.collisions),
        "metrics": {
            kind.value: [asdict(metric) for metric in result.metrics]
            for kind, result in scores.items()
        },
    }


def drive_file(row: Simulation) -> bytes:
    """Return a driven row to look at, as a JSON file."""
    return zlib.decompress(bytes(row.trace or b""))


def blind_drive(row: Simulation) -> dict[str, Any]:
    """Return a driven row without anything that tells who changed the scene."""
    return blind_trace(json.loads(drive_file(row)))


# --- Private -----------------------------------------------------------------------------------


def _plan_scenario(scenario: Scenario, options: Options) -> list[int]:
    waiting = _plan(scenario, Subject.UNMODIFIED, options)
    if scenario.reference is not None:
        waiting += _plan(scenario, Subject.REFERENCE, options)
    return waiting


def _plan(
    scenario: Scenario,
    subject: Simulation.Subject,
    options: Options,
    *,
    augmentation: Augmentation | None = None,
) -> list[int]:
    """Return the key of one drive if it waits now; what failed waits again."""
    row, _ = Simulation.objects.get_or_create(
        scenario=scenario, subject=subject, augmentation=augmentation, **asdict(options)
    )
    if row.state == State.FAILED:
        row.wait_again()
    return [row.pk] if row.state == State.QUEUED else []


def _load_setting(row: Simulation) -> DriveSetting:
    """Return the scene that a row drives; unchanged without a modification."""
    loaded, modification = LoadedScenario(row.scenario), None
    changed = row.augmentation or row.swept
    if row.subject == Subject.REFERENCE:
        modification = loaded.reference
    elif changed is not None and changed.modification is not None:
        modification = modification_from_document(changed.modification)
    return DriveSetting(
        scene=loaded.scene,
        modification=fit_boxes(loaded.scene, modification or Modification()),
        recording=loaded.recording,
        reactive=row.is_reactive,
    )
