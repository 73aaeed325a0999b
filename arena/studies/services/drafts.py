"""Studies that are set up over several sittings: kept as they stand, opened by `open_study`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import count
from typing import Any

from django.contrib.auth.models import User
from django.db import transaction

from arena.models import Matchup, Study, StudyDraft
from arena.studies.queries import shared_units
from arena.studies.services.opening import open_study
from arena.studies.services.outlook import StudyEstimate, usual_seconds
from arena.studies.services.plan import LONGEST_NAME, PLAN_INPUTS, StudyPlan, plan_of
from augment.errors import Conflict, InvalidDocument, UnknownName
from augment.services.events import log_event
from augment.services.inputs import InputKind
from augment.services.texts import make_storable

Entered = dict[str, str | bool | list[str]]
"""Every field of the form: a text as it was typed, a switch, or names."""

SWITCHES = tuple(one.name for one in PLAN_INPUTS if one.kind is InputKind.SWITCH)
NAMES = tuple(one.name for one in PLAN_INPUTS if one.kind is InputKind.NAMES)
FIELDS = tuple(one.name for one in PLAN_INPUTS)
TEXTS = tuple(name for name in FIELDS if name not in (*SWITCHES, *NAMES))

LONGEST_TEXT = 60_000
MOST_NAMES = 20_000


def read_entered(given: Mapping[str, object]) -> Entered:
    """What was entered, each field there, those that are not given empty.

    Nothing is asked of it but that it can be stored: a number may be no number yet.

    Args:
        given: By field: texts for TEXTS (a number counts as its text), true or false for SWITCHES,
            lists of texts for NAMES.

    Raises:
        UnknownName: There is no such field.
        InvalidDocument: A field is of the wrong kind, or too long.
    """
    for name in given:
        if name not in FIELDS:
            raise UnknownName("field", name, list(FIELDS))
    problems = [(name, rule) for name, value in given.items() if (rule := _fault(name, value))]
    if problems:
        raise InvalidDocument("study", problems)
    found: Entered = {name: make_storable(str(given.get(name, ""))) for name in TEXTS}
    found |= {name: bool(given.get(name, False)) for name in SWITCHES}
    for name in NAMES:
        chosen = given.get(name, [])
        assert isinstance(chosen, list)
        found[name] = [make_storable(one) for one in dict.fromkeys(chosen)]
    return found


def entered_of(draft: StudyDraft) -> Entered:
    """Return what a draft holds, by the fields as they are named today."""
    kept = dict(draft.entered)
    if "no_measures" in kept:  # what `allow_measures` was called, the other way round
        kept["allow_measures"] = not kept.pop("no_measures")
    return kept


@transaction.atomic
def keep_draft(*, entered: Mapping[str, object], actor: User | None = None) -> StudyDraft:
    """A new draft.

    Raises:
        UnknownName, InvalidDocument: See `read_entered`.
    """
    draft = StudyDraft.objects.create(entered=read_entered(entered), changed_by=actor)
    _log(draft, "draft", actor, after={"name": draft.name})
    return draft


@transaction.atomic
def change_draft(
    *, draft: StudyDraft, entered: Mapping[str, object], revision: int, actor: User | None = None
) -> StudyDraft:
    """Save a draft anew; what is as it was, is not written.

    Args:
        draft: Which.
        entered: All of it: a field that is not given is empty afterwards.
        revision: Of the draft that the changes were made to.
        actor: Who, for the log.

    Raises:
        Conflict: Somebody else saved or discarded it meanwhile.
        UnknownName, InvalidDocument: See `read_entered`.
    """
    found = read_entered(entered)
    held = _hold(draft, revision)
    known = entered_of(held)
    changed = sorted(name for name in FIELDS if known.get(name) != found[name])
    if not changed:
        return held
    held.entered, held.changed_by = found, actor
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
    """A new draft with the settings of a study, under another name.

    Raises:
        Conflict: Its votes came from a file; nobody planned them.
    """
    if "entries" not in study.rules:
        raise Conflict(f"The votes of '{study.name}' came from a file: it has no rules.")
    entered = {name: _as_entered(name, value) for name, value in asdict(plan_of(study)).items()}
    return keep_draft(entered=entered | {"name": _free_name(study.name)}, actor=actor)


def rename_in_drafts(known_as: str, name: str) -> None:
    """An account has another name now: also where drafts choose it."""
    for draft in StudyDraft.objects.select_for_update().order_by("pk"):
        chosen = draft.names_in("experts")
        if known_as in chosen:
            draft.entered["experts"] = [name if one == known_as else one for one in chosen]
            draft.save(update_fields=["entered"])


# --- Private -----------------------------------------------------------------------------------


def _as_entered(name: str, value: Any) -> object:
    """A value of a plan as somebody enters it."""
    if name in SWITCHES:
        return value
    if name in NAMES:
        return list(value)
    if isinstance(value, float):
        return f"{value:g}"
    return "\n".join(value) if isinstance(value, tuple) else str(value)


def _fault(name: str, value: object) -> str:
    """What is wrong with a field, empty where nothing is."""
    if name in SWITCHES:
        return "" if isinstance(value, bool) else "must be true or false"
    if name in NAMES:
        if not isinstance(value, list) or not all(isinstance(one, str) for one in value):
            return "must be a list of texts"
        longest = max(map(len, value), default=0)
        if len(value) > MOST_NAMES or longest > LONGEST_NAME * 2:
            return f"at most {MOST_NAMES} names of {LONGEST_NAME * 2} characters are allowed"
        return ""
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        return "must be a text or a number"
    most = LONGEST_NAME if name == "name" else LONGEST_TEXT
    if len(str(value)) > most:
        return f"at most {most} characters are allowed"
    return "" if name != "name" or not value or str(value).isprintable() else "must be one line"


def _hold(draft: StudyDraft, revision: int) -> StudyDraft:
    held = StudyDraft.objects.select_for_update().filter(pk=draft.pk).first()
    if held is None:
        raise Conflict("Somebody opened or discarded this draft meanwhile.")
    if held.revision != revision:
        raise Conflict("Somebody else saved this draft meanwhile; nothing of yours was kept.")
    return held


def _log(
    draft: StudyDraft,
    verb: str,
    actor: User | None,
    *,
    before: dict[str, Any] | None = None,
    after: dict[str, Any] | None = None,
) -> None:
    log_event(
        actor=actor,
        verb=verb,
        object_kind="study draft",
        object_code=draft.code,
        before=before,
        after=after,
    )


def _free_name(name: str) -> str:
    """The name with the first number that no study or draft has."""
    taken = set(Study.objects.values_list("name", flat=True))
    taken |= {draft.name for draft in StudyDraft.objects.all()}
    for number in count(2):
        end = f" ({number})"
        found = name[: LONGEST_NAME - len(end)] + end
        if found not in taken:
            return found
    raise AssertionError("numbers do not end")


Kind = Matchup.Kind


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyPreview:
    """What a study would be.

    Attributes:
        votes: Of all experts, those that are planned later among them.
        later: So many of them are planned later, by those before.
        repeats, checks: Shown on top of the votes.
        judged: Pairs of a scenario that somebody judges.
        shared: So many of them two experts or more.
        settled: Pairs that are settled as ties and shown to nobody.
        alike: So many of them because they are alike within the limits, identical ones among them.
        seconds: For one pair, from votes that were timed, else a guess.
        minutes: For each expert.
    """

    experts: int
    contestants: int
    scenarios: int
    votes: int
    later: int
    repeats: int
    checks: int
    judged: int
    shared: int
    settled: int
    alike: int
    seconds: float
    minutes: int


def preview_study(study_plan: StudyPlan) -> StudyPreview:
    """What opening this study would make; nothing is kept.

    Raises:
        ArenaError, AugmentError: It can't be opened.
    """
    with transaction.atomic():
        study = open_study(study_plan)
        kinds = Counter(study.matchups.values_list("kind", flat=True))
        later = sum(study.votes_to_plan.values())
        experts = study.experts.count()
        judged, shared = shared_units(study)
        sides = study.contestants.count(), study.scenarios.count()
        settled, alike = len(study.rules["identical"]), len(study.rules["alike"])
        transaction.set_rollback(True)
    seconds = usual_seconds() or StudyEstimate().seconds
    shown = kinds[Kind.MAIN] + later + kinds[Kind.REPEAT] + kinds[Kind.CHECK]
    return StudyPreview(
        experts=experts,
        contestants=sides[0],
        scenarios=sides[1],
        votes=kinds[Kind.MAIN] + later,
        later=later,
        repeats=kinds[Kind.REPEAT],
        checks=kinds[Kind.CHECK],
        judged=judged,
        shared=shared,
        settled=settled,
        alike=alike,
        seconds=float(seconds),
        minutes=round(shown / experts * seconds / 60),
    )
