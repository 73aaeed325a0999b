"""Studies that are set up over several sittings."""

from collections.abc import Mapping
from dataclasses import asdict
from itertools import count
from typing import Any

from django.contrib.auth.models import User
from django.db import transaction

from arena.models import Study, StudyDraft
from arena.studies.services.opening import open_study
from arena.studies.services.plan import (
    LONGEST_NAME,
    PLAN_INPUTS,
    SWITCHES,
    StudyPlan,
    read_opened_plan,
)
from augment.errors import Conflict
from augment.services import InputKind, log_change, make_storable

Entered = dict[str, str | bool | list[str]]
"""Every field of the form: a text as it was typed, a switch, or names."""

NAMES = tuple(field.name for field in PLAN_INPUTS if field.kind is InputKind.NAMES)


def read_entered(values: Mapping[str, Any]) -> Entered:
    """Return every field of the form as it can be stored, those that are not given empty.

    A number may be no number yet.
    """
    entered: Entered = {}
    for name in (field.name for field in PLAN_INPUTS):
        if name in SWITCHES:
            entered[name] = bool(values.get(name, False))
        elif name in NAMES:
            entered[name] = [make_storable(entry) for entry in dict.fromkeys(values.get(name, ()))]
        else:
            entered[name] = make_storable(str(values.get(name, "")))
    return entered


@transaction.atomic
def keep_draft(
    *,
    entered: Mapping[str, Any],
    draft: StudyDraft | None = None,
    revision: int = 0,
    actor: User | None = None,
) -> StudyDraft:
    """Create a draft or save one anew.

    Args:
        entered: All of it: a field that is not given is empty afterwards.
        draft: Which; None makes a new one.
        revision: Of the draft that the changes were made to.
        actor: Who, for the log.

    Raises:
        Conflict: Somebody else saved or discarded it meanwhile.
    """
    if draft is None:
        row, verb = StudyDraft(), "draft"
    else:
        row, verb = _hold(draft, revision), "change draft"
        row.revision += 1
    row.entered, row.changed_by = read_entered(entered), actor
    row.save()
    log_change(row, verb, actor, after={"name": row.name})
    return row


@transaction.atomic
def discard_draft(*, draft: StudyDraft, actor: User | None = None) -> None:
    """Remove a draft for good; twice changes nothing."""
    if StudyDraft.objects.filter(pk=draft.pk).delete()[0]:
        log_change(draft, "discard draft", actor, before={"name": draft.name})


@transaction.atomic
def open_draft(
    study_plan: StudyPlan, *, draft: StudyDraft | None, revision: int, actor: User | None = None
) -> Study:
    """Open the study that a draft has come to; the draft goes.

    Args:
        study_plan: What the draft has come to.
        draft: Which; None where nothing was saved.
        revision: Of the draft that the plan was made of.
        actor: Who, for the log.

    Raises:
        Conflict: Somebody else saved or discarded the draft meanwhile.
        AugmentError: See `open_study`.
    """
    row = None if draft is None else _hold(draft, revision)
    study = open_study(study_plan, actor=actor)
    if row is not None:
        log_change(row, "open draft", actor, after={"study": str(study.code)})
        row.delete()
    return study


def draft_like(*, study: Study, actor: User | None = None) -> StudyDraft:
    """Create a draft with the settings of a study, under another name.

    Raises:
        Conflict: Its votes came from a file; nobody planned them.
    """
    if "entries" not in study.rules:
        raise Conflict(f"The votes of '{study.name}' came from a file: it has no rules.")
    taken = set(Study.objects.values_list("name", flat=True))
    taken |= {draft.name for draft in StudyDraft.objects.all()}
    names = (study.name[: LONGEST_NAME - 8] + f" ({number})" for number in count(2))
    entered = {
        name: _as_entered(name, value) for name, value in asdict(read_opened_plan(study)).items()
    }
    entered["name"] = next(name for name in names if name not in taken)
    return keep_draft(entered=entered, actor=actor)


def _as_entered(name: str, value: Any) -> Any:
    """Return a value of a plan as somebody enters it."""
    if name in SWITCHES or name in NAMES:
        return value
    if isinstance(value, float):
        return f"{value:g}"
    return "\n".join(value) if isinstance(value, tuple) else str(value)


def _hold(draft: StudyDraft, revision: int) -> StudyDraft:
    rows = StudyDraft.objects.select_for_update().filter(pk=draft.pk, revision=revision)
    if (row := rows.first()) is None:
        raise Conflict("Somebody else saved, opened or discarded this draft meanwhile.")
    return row
