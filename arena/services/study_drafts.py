"""Studies that are set up over several sittings: kept as they stand, opened by `open_study`."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import count
from typing import Any

from django.contrib.auth.models import User
from django.db import transaction

from arena.models import Study, StudyDraft
from arena.services.hypotheses import hypotheses_of
from arena.services.studies import open_study
from augment.errors import Conflict, InvalidDocument, UnknownName
from augment.services.events import log_event
from augment.services.texts import make_storable

Entered = dict[str, str | bool | list[str]]
"""Every field of the form: a text as it was typed, a switch, or names."""

TEXTS = (
    *("name", "votes_per_expert", "seed", "repeats", "checks", "overlap", "adaptive", "targets"),
    *("hypotheses", "samples"),
)
SWITCHES = (
    *("allow_both_miss", "show_alike", "allow_text", "allow_replay", "practice"),
    *("no_measures", "allow_simulated"),
)
NAMES = ("contestants", "scenarios", "experts", "jobs")
FIELDS = (*TEXTS, *SWITCHES, *NAMES)

LONGEST_NAME = 120
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
    changed = sorted(name for name in FIELDS if held.entered.get(name) != found[name])
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
    *, draft: StudyDraft, revision: int, actor: User | None = None, **rules: Any
) -> Study:
    """Open the study, whose draft goes.

    Args:
        draft: Which.
        revision: Of the draft that the rules were made of.
        actor: Who, for the log.
        rules: As `open_study` takes them.

    Raises:
        Conflict: Somebody else saved or discarded the draft meanwhile.
        ArenaError, AugmentError: See `open_study`.
    """
    held = _hold(draft, revision)
    study = open_study(**rules, actor=actor)
    _log(held, "open draft", actor, after={"study": str(study.code)})
    held.delete()
    return study


def draft_like(*, study: Study, actor: User | None = None) -> StudyDraft:
    """A new draft with the settings of a study, under another name.

    Raises:
        Conflict: Its votes came from a file; nobody planned them.
    """
    return keep_draft(entered=settings_of(study), actor=actor)


def settings_of(study: Study) -> Entered:
    """What somebody would have entered to open this study, but for a name that is free.

    Who joined by a link for everybody, and hidden pairs handed over, are no settings.

    Raises:
        Conflict: Its votes came from a file; nobody planned them.
    """
    rules = study.rules
    if "entries" not in rules:
        raise Conflict(f"The votes of '{study.name}' came from a file: it has no rules.")
    shares = ("repeat_share", "check_share", "overlap_share", "adaptive_share")
    names = ("repeats", "checks", "overlap", "adaptive")
    given: dict[str, object] = {
        name: f"{round(100 * rules.get(share, 0), 6):g}"
        for name, share in zip(names, shares, strict=True)
    }
    given |= {
        "name": _free_name(study.name),
        "votes_per_expert": study.votes_per_expert,
        "seed": study.seed,
        "targets": "\n".join(_target_lines(rules)),
        "hypotheses": "\n".join(one.text for one in hypotheses_of(study)),
        "samples": rules.get("samples", "one"),
        "show_alike": bool(rules.get("show_alike")),
        "no_measures": not study.allow_measures,
        **{
            name: getattr(study, name)
            for name in SWITCHES
            if name not in ("show_alike", "no_measures")
        },
        "contestants": list(study.contestants.order_by("slug").values_list("slug", flat=True)),
        "scenarios": list(study.scenarios.order_by("slug").values_list("slug", flat=True)),
        "experts": list(rules["experts"]),
        "jobs": [job["code"] for job in rules.get("jobs", ())],
    }
    return read_entered(given)


def rename_in_drafts(known_as: str, name: str) -> None:
    """An account has another name now: also where drafts choose it."""
    for draft in StudyDraft.objects.select_for_update().order_by("pk"):
        chosen = draft.names_in("experts")
        if known_as in chosen:
            draft.entered["experts"] = [name if one == known_as else one for one in chosen]
            draft.save(update_fields=["entered"])


# --- Private -----------------------------------------------------------------------------------


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


def _target_lines(rules: Mapping[str, Any]) -> list[str]:
    by_pair = [f"{one} vs {other} {votes}" for one, other, votes in rules.get("pair_votes", ())]
    return [f"{slug} {votes}" for slug, votes in rules.get("appearances", ())] + by_pair
