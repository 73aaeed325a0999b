"""Changes of scenarios and scenes that nothing depends on yet, references, and redrawing."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from django.contrib.auth.models import User
from django.db import transaction

from arena.models import LabelTask, Study
from augment.errors import AugmentError, Conflict
from augment.models import BaseScene, Scenario
from augment.services.events import log_event
from augment.services.scenarios import editing
from augment.services.scenarios.pictures import redraw
from augment.services.scenarios.scenes import change_surroundings, set_wording

MOST_NAMED = 8
FILE_TOO_LARGE = "arena.file_too_large"
"""In the META of a request one of whose files was skipped unread."""


def was_too_large(meta: Mapping[str, object]) -> bool:
    """Return whether a file was larger than any may be; it is not among the files then."""
    return bool(meta.get(FILE_TOO_LARGE))


# --- Redrawing ---------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Redrawn:
    """What was done about one scenario.

    Attributes:
        pictures: How many have been drawn anew.
        fault: Why they could not be drawn, empty where they could.
    """

    scenario: str
    pictures: int = 0
    fault: str = ""

    @property
    def says(self) -> str:
        """One line about it."""
        if self.fault:
            return f"{self.scenario}: kept as they are. {self.fault}"
        return f"{self.scenario}: {self.pictures} drawn anew"


def redraw_pictures() -> Iterator[Redrawn]:
    """Draw every scenario's pictures in today's window, one scenario after the other.

    Open studies go on showing those that they were opened with. What can't be drawn is reported
    and does not stop the others.
    """
    drawn = Scenario.objects.filter(augmentations__image__gt="").distinct().order_by("slug")
    for pk, slug in list(drawn.values_list("pk", "slug")):
        scenario = Scenario.objects.select_related("base_scene").get(pk=pk)
        try:
            if pictures := redraw(scenario):
                yield Redrawn(scenario=slug, pictures=pictures)
        except AugmentError as error:
            yield Redrawn(scenario=slug, fault=str(error))


# --- References --------------------------------------------------------------------------------


@transaction.atomic
def set_reference(scenario: Scenario, document: object, *, actor: User | None = None) -> Scenario:
    """Give a scenario this reference; the window of its pictures may become another one.

    Raises:
        InvalidDocument: The document breaks its format.
        InvalidModification: It does not fit the scene.
        Conflict: The scenario is the catalogue's, an open study or labelling shows it, or nothing
            changes.
    """
    _hold_unjudged(scenario)
    return editing.set_reference(scenario, document, actor=actor)


def why_not_editable(scenario: Scenario) -> str:
    """Return why the reference of a scenario can't be changed now, empty where it can."""
    try:
        editing.refuse_catalogue(scenario)
        _refuse_judged(scenario)
    except Conflict as conflict:
        return str(conflict)
    return ""


def _hold_unjudged(scenario: Scenario) -> None:
    """Lock it, as an opening study does: none opens between the check and the change."""
    Scenario.objects.select_for_update(of=("self",)).get(pk=scenario.pk)
    _refuse_judged(scenario)


def _refuse_judged(scenario: Scenario) -> None:
    studies = Study.objects.filter(state=Study.State.OPEN, scenarios=scenario).order_by("pk")
    tasks = LabelTask.objects.filter(
        augmentation__scenario=scenario, label=None, labelling__closed_at=None
    ).order_by("labelling")
    needed_by = (
        studies.values_list("name", flat=True).first()
        or tasks.values_list("labelling__name", flat=True).first()
    )
    if needed_by:
        raise Conflict(
            f"“{needed_by}” is open and shows this scenario: its reference stays until that "
            "is over."
        )


# --- Changing and deleting ---------------------------------------------------------------------


@transaction.atomic
def change_scenario(
    scenario: Scenario,
    *,
    instruction: str,
    type: str,
    keep_traffic: bool,
    density: str,
    goal: str,
    actor: User | None = None,
) -> Scenario:
    """Set the instruction, type and circumstances of a scenario that was not worked on yet.

    Raises:
        InvalidDocument: The type or the instruction breaks its format.
        InvalidModification: The reference does not fit the changed scene.
        Conflict: The scenario is the catalogue's, or something needs it; the text names it.
    """
    row = Scenario.objects.select_for_update(of=("self",)).get(pk=scenario.pk)
    if row.in_catalogue:
        raise Conflict(f"“{row.slug}” is the catalogue’s own; change it in its file.")
    _refuse_needed(row, "changed")
    before = _state(row)
    set_wording(row, instruction, type)
    change_surroundings(row, keep_traffic=keep_traffic, density=density, goal=goal)
    row.save()
    log_event(
        actor=actor,
        verb="change",
        object_kind="scenario",
        object_code=row.code,
        before=before,
        after=_state(row),
    )
    return row


@transaction.atomic
def delete(row: Scenario | BaseScene, *, actor: User | None = None) -> None:
    """Delete a scenario that no job, study, drive or other wording needs, or such a scene.

    Raises:
        Conflict: Something needs it; the text names it.
    """
    type(row).objects.select_for_update(of=("self",)).only("pk").get(pk=row.pk)
    _refuse_needed(row, "deleted")
    log_event(
        actor=actor,
        verb="delete",
        object_kind="scenario" if isinstance(row, Scenario) else "scene",
        object_code=row.code,
        before={"slug": row.slug},
    )
    row.delete()


def _refuse_needed(row: Scenario | BaseScene, what: str) -> None:
    if isinstance(row, BaseScene):
        slugs = row.scenarios.order_by("slug").values_list("slug", flat=True)
        needed_by = [f"the scenario “{slug}”" for slug in slugs]
    else:
        drives = row.simulations.count()
        needed_by = [
            *(f"the job “{job.name}”" for job in row.jobs.order_by("pk")),
            *(f"the study “{study.name}”" for study in row.studies.order_by("pk")),
            *(f"its other wording “{other.slug}”" for other in row.paraphrases.order_by("slug")),
            *([f"{drives} drives"] if drives else []),
        ]
    if not needed_by:
        return
    more = len(needed_by) - MOST_NAMED
    *first, last = [*needed_by[:MOST_NAMED], *([f"{more} more"] if more > 0 else [])]
    named = f"{', '.join(first)} and {last}" if first else last
    raise Conflict(f"“{row.slug}” can’t be {what}; it is needed by {named}.")


def _state(row: Scenario) -> dict[str, object]:
    return {
        "instruction": row.instruction,
        "type": row.type,
        "keep_traffic": row.keep_traffic,
        "density": row.traffic_density,
        "goal": row.goal,
    }
