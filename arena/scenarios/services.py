"""Changes of scenarios and scenes that nothing depends on yet, and redrawing."""

from collections.abc import Iterator, Mapping

from django.contrib.auth.models import User
from django.db import transaction

from arena.models import LabelTask, Study
from augment.errors import AugmentError, Conflict
from augment.models import BaseScene, Scenario
from augment.services import log_change
from augment.services.benchmarks import refuse_handed_out
from augment.services.scenarios import editing, redraw, scenes

MOST_NAMED = 8
FILE_TOO_LARGE = "arena.file_too_large"
"""In the META of a request one of whose files was skipped unread."""


def was_too_large(meta: Mapping[str, object]) -> bool:
    """Return whether a file was larger than any may be; it is not among the files then."""
    return bool(meta.get(FILE_TOO_LARGE))


# --- Redrawing ---------------------------------------------------------------------------------


def redraw_pictures() -> Iterator[tuple[str, int | AugmentError]]:
    """Draw every scenario's pictures in today's window; yield how many, or why that can't be.

    Open studies go on showing those that they were opened with.
    """
    drawn = Scenario.objects.filter(augmentations__image__gt="").distinct().order_by("slug")
    for pk, slug in list(drawn.values_list("pk", "slug")):
        try:
            number = redraw(Scenario.objects.select_related("base_scene").get(pk=pk))
        except AugmentError as error:
            yield slug, error
        else:
            if number:
                yield slug, number


# --- Changing and deleting ---------------------------------------------------------------------


def why_not_editable(scenario: Scenario) -> str:
    """Return why nothing of a scenario can be changed now, empty where its drawing can."""
    try:
        editing.refuse_catalogue(scenario)
        refuse_handed_out(scenario.slug)
        _refuse_judged(scenario)
    except Conflict as conflict:
        return str(conflict)
    return ""


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


@transaction.atomic
def change_scenario(
    scenario: Scenario, content: scenes.ScenarioContent, *, actor: User | None = None
) -> Scenario:
    """Set what a scenario says and draws.

    Its drawing can be changed until an open study shows it, all else until something needs it;
    nothing while a benchmark hands it out.

    Raises:
        InvalidDocument: One of these breaks its format.
        InvalidModification: The reference does not fit the changed scene.
        Conflict: The scenario is the catalogue's, or something needs it; the text names it.
    """
    # Locked as an opening study locks it: none opens between the check and the change.
    row = Scenario.objects.select_for_update(of=("self",)).get(pk=scenario.pk)
    editing.refuse_catalogue(row, "text")
    refuse_handed_out(row.slug)
    before, drawn = _state(row), row.reference
    row.reference = content.reference if isinstance(content.reference, dict) else None
    scenes.change_surroundings(
        row, keep_traffic=content.keep_traffic, density=content.density, goal=content.goal
    )
    row.reference = editing.reference_document(row, content.reference)
    if row.reference != drawn:
        _refuse_judged(row)
    type, instruction = content.type, content.instruction
    if content.derives:
        type, instruction = scenes.derive_intent(row, type, instruction)
    scenes.set_wording(row, instruction, type)
    if _state(row) != before:
        _refuse_needed(row, "changed")
    row.save()
    after = _state(row) | {"reference": row.reference}
    log_change(row, "change", actor, before=before | {"reference": drawn}, after=after)
    return row


@transaction.atomic
def delete(row: Scenario | BaseScene, *, actor: User | None = None) -> None:
    """Delete a scenario that no job, study, drive or other wording needs, or such a scene.

    Raises:
        Conflict: Something needs it; the text names it.
    """
    type(row).objects.select_for_update(of=("self",)).only("pk").get(pk=row.pk)
    _refuse_needed(row, "deleted")
    log_change(row, "delete", actor, before={"slug": row.slug})
    row.delete()


def _refuse_needed(row: Scenario | BaseScene, what: str) -> None:
    if isinstance(row, BaseScene):
        needed_by = [
            f"the scenario “{scenario.slug}”" for scenario in row.scenarios.order_by("slug")
        ]
    else:
        needed_by = [
            *(f"the job “{job.name}”" for job in row.jobs.order_by("pk")),
            *(f"the study “{study.name}”" for study in row.studies.order_by("pk")),
            *(f"its follow-up “{other.slug}”" for other in row.follow_ups.order_by("slug")),
            *(f"its other wording “{other.slug}”" for other in row.paraphrases.order_by("slug")),
            *(f"the benchmark {item.benchmark}" for item in row.benchmark_items.order_by("pk")),
            *(["drives"] if row.simulations.exists() else []),
        ]
    if needed_by:
        named = ", ".join(needed_by[:MOST_NAMED])
        raise Conflict(f"“{row.slug}” can’t be {what}; it is needed by {named}.")


def _state(row: Scenario) -> dict[str, object]:
    names = ("instruction", "type", "keep_traffic", "traffic_density", "goal")
    return {name: getattr(row, name) for name in names}
