"""Studies that are set up over several sittings, and what opening one would make."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict
from itertools import count
from typing import Any

from django.contrib.auth.models import User
from django.db import transaction

from arena.models import Matchup, Study, StudyDraft
from arena.studies.queries import shared_units
from arena.studies.services.opening import open_study
from arena.studies.services.outlook import StudyEstimate, usual_seconds
from arena.studies.services.plan import LONGEST_NAME, PLAN_INPUTS, StudyPlan, plan_of
from augment.errors import Conflict
from augment.services.events import log_event
from augment.services.inputs import InputKind
from augment.services.texts import make_storable

Entered = dict[str, str | bool | list[str]]
"""Every field of the form: a text as it was typed, a switch, or names."""

SWITCHES = tuple(one.name for one in PLAN_INPUTS if one.kind is InputKind.SWITCH)
NAMES = tuple(one.name for one in PLAN_INPUTS if one.kind is InputKind.NAMES)
FIELDS = tuple(one.name for one in PLAN_INPUTS)
TEXTS = tuple(name for name in FIELDS if name not in (*SWITCHES, *NAMES))


def read_entered(given: Mapping[str, Any]) -> Entered:
    """Return every field of the form as it can be stored, those that are not given empty.

    A number may be no number yet.
    """
    entered: Entered = {name: make_storable(str(given.get(name, ""))) for name in TEXTS}
    entered |= {name: bool(given.get(name, False)) for name in SWITCHES}
    chosen = {name: dict.fromkeys(given.get(name, ())) for name in NAMES}
    return entered | {name: [*map(make_storable, chosen[name])] for name in NAMES}


def entered_of(draft: StudyDraft) -> Entered:
    """Return what a draft holds, by the fields as they are named today."""
    kept = dict(draft.entered)
    if "no_measures" in kept:  # what `allow_measures` was called, the other way round
        kept["allow_measures"] = not kept.pop("no_measures")
    return kept


@transaction.atomic
def keep_draft(*, entered: Mapping[str, Any], actor: User | None = None) -> StudyDraft:
    """Create a draft."""
    draft = StudyDraft.objects.create(entered=read_entered(entered), changed_by=actor)
    _log(draft, "draft", actor, after={"name": draft.name})
    return draft


@transaction.atomic
def change_draft(
    *, draft: StudyDraft, entered: Mapping[str, Any], revision: int, actor: User | None = None
) -> StudyDraft:
    """Save a draft anew; what is as it was, is not written.

    Args:
        draft: Which.
        entered: All of it: a field that is not given is empty afterwards.
        revision: Of the draft that the changes were made to.
        actor: Who, for the log.

    Raises:
        Conflict: Somebody else saved or discarded it meanwhile.
    """
    new = read_entered(entered)
    held = _hold(draft, revision)
    known = entered_of(held)
    changed = sorted(name for name in FIELDS if known.get(name) != new[name])
    if changed:
        held.entered, held.changed_by = new, actor
        held.revision += 1
        held.save()
        _log(held, "change draft", actor, after={"name": held.name, "fields": changed})
    return held


@transaction.atomic
def discard_draft(*, draft: StudyDraft, actor: User | None = None) -> None:
    """Remove a draft for good."""
    held = StudyDraft.objects.select_for_update().filter(pk=draft.pk).first()
    if held is None:
        return
    _log(held, "discard draft", actor, before={"name": held.name})
    held.delete()


@transaction.atomic
def open_draft(
    study_plan: StudyPlan, *, draft: StudyDraft, revision: int, actor: User | None = None
) -> Study:
    """Open the study, whose draft goes.

    Args:
        study_plan: What the draft has come to.
        draft: Which.
        revision: Of the draft that the plan was made of.
        actor: Who, for the log.

    Raises:
        Conflict: Somebody else saved or discarded the draft meanwhile.
        ArenaError, AugmentError: See `open_study`.
    """
    held = _hold(draft, revision)
    study = open_study(study_plan, actor=actor)
    _log(held, "open draft", actor, after={"study": str(study.code)})
    held.delete()
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
    entered = {name: _as_entered(name, value) for name, value in asdict(plan_of(study)).items()}
    entered["name"] = next(name for name in names if name not in taken)
    return keep_draft(entered=entered, actor=actor)


def rename_in_drafts(known_as: str, name: str) -> None:
    """Replace the name of an account in the drafts that choose it."""
    for draft in StudyDraft.objects.select_for_update().order_by("pk"):
        chosen = draft.names_in("experts")
        if known_as in chosen:
            draft.entered["experts"] = [name if one == known_as else one for one in chosen]
            draft.save(update_fields=["entered"])


def _as_entered(name: str, value: Any) -> Any:
    """Return a value of a plan as somebody enters it."""
    if name in SWITCHES or name in NAMES:
        return value
    if isinstance(value, float):
        return f"{value:g}"
    return "\n".join(value) if isinstance(value, tuple) else str(value)


def _hold(draft: StudyDraft, revision: int) -> StudyDraft:
    held = StudyDraft.objects.select_for_update().filter(pk=draft.pk).first()
    if held is None:
        raise Conflict("Somebody opened or discarded this draft meanwhile.")
    if held.revision != revision:
        raise Conflict("Somebody else saved this draft meanwhile; nothing of yours was kept.")
    return held


def _log(draft: StudyDraft, verb: str, actor: User | None, **kept: dict[str, Any]) -> None:
    log_event(actor=actor, verb=verb, object_kind="study draft", object_code=draft.code, **kept)


# --- Preview -----------------------------------------------------------------------------------


def preview_study(study_plan: StudyPlan) -> dict[str, float]:
    """Return what opening this study would make, in numbers; nothing is kept.

    `later` of the votes are planned by those before, and repeats and checks come on top of them.
    `judged` counts pairs of a scenario that somebody judges, `shared` those of two experts or
    more; `settled` those that are settled as ties, `alike` the ones among them within the limits.

    Raises:
        ArenaError, AugmentError: It can't be opened.
    """
    with transaction.atomic():
        study = open_study(study_plan)
        kinds = Counter(study.matchups.values_list("kind", flat=True))
        later = sum(study.votes_to_plan.values())
        judged, shared = shared_units(study)
        experts = study.experts.count()
        seconds = usual_seconds() or StudyEstimate().seconds
        preview = {
            "experts": experts,
            "contestants": study.contestants.count(),
            "scenarios": study.scenarios.count(),
            "votes": kinds[Matchup.Kind.MAIN] + later,
            "later": later,
            "repeats": kinds[Matchup.Kind.REPEAT],
            "checks": kinds[Matchup.Kind.CHECK],
            "judged": judged,
            "shared": shared,
            "settled": len(study.rules["identical"]),
            "alike": len(study.rules["alike"]),
            "seconds": float(seconds),
            "minutes": round((kinds.total() + later) / experts * seconds / 60),
        }
        transaction.set_rollback(True)
    return preview
