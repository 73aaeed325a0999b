"""What follows an answer, which stays as it is: a follow-up, or a correction by hand.

A follow-up is what a language model is told next about its own answer. Each step is an
augmentation of a scenario that follows another one; `follows` leads to the step before. Going back
is going on from an earlier step. A correction is an augmentation of a contestant of kind human:
written with its modification, it waits for a worker that draws and settles it.
"""

from dataclasses import dataclass, fields

from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import Q
from django.utils import timezone

from augment import models
from augment.errors import Conflict
from augment.llm.messages import Message, message_from_document
from augment.prompts.fill import model_message
from augment.scene.codec import modification_from_document, modification_to_document
from augment.scene.entities import Modification
from augment.services.events import log_change
from augment.services.inputs import InputKind, input_field
from augment.services.running.budget import Caps
from augment.services.running.jobs import JobRequest, launch
from augment.services.scenarios.editing import read_edit
from augment.services.scenarios.scenes import INSTRUCTION_LENGTH, NewScenario, add_scenario
from augment.services.texts import LONGEST_NOTES, check_prose, free_slug, one_line, read_code
from augment.variants.respondents import ModelRole, NoteKind

BY_HAND = "by-hand"


@dataclass(frozen=True, kw_only=True)
class FollowUpRequest(Caps):
    """Change that is asked for in a result, and caps of its calls."""

    instruction: str = input_field(
        InputKind.TEXT,
        "What to change next",
        "Such as: a bit further left, and make it a bus.",
        most=INSTRUCTION_LENGTH,
    )


@transaction.atomic
def ask_follow_up(
    answer: models.Augmentation, request: FollowUpRequest, *, actor: User | None = None
) -> models.Augmentation:
    """Create a waiting row of a job and a scenario of its own; the caller sends its message.

    The scenario is retired: forms offer it once somebody offers it again, perhaps with a
    reference.

    Args:
        answer: What the contestant goes on from; it stays as it is.
        request: What it is told.
        actor: Who says so.

    Raises:
        InvalidDocument: The instruction breaks its format, or a cap is out of its bounds.
        Conflict: No language model gave this answer, it is none, its transcript is gone, or a job
            can't run the contestant.
    """
    read_conversation_until(answer)
    before = answer.scenario
    new = NewScenario(
        scene=before.base_scene.slug,
        type=before.type,
        instruction=request.instruction,
        follows=before.slug,
    )
    scenario = add_scenario(new, actor=actor)
    models.Scenario.objects.filter(pk=scenario.pk).update(
        retired_at=timezone.now(), language=before.language
    )
    job = launch(
        JobRequest(
            name=f"Follow-up: {scenario.slug}, {answer.contestant.name}"[:120],
            contestants=[answer.contestant.slug],
            scenarios=[scenario.slug],
            **{field.name: getattr(request, field.name) for field in fields(Caps)},
        ),
        actor,
        follows=answer,
    )
    return job.augmentations.get()


def find_augmentation(code: str) -> models.Augmentation:
    """Return the augmentation with that code.

    Raises:
        Conflict: There is none.
    """
    row = models.Augmentation.objects.filter(code=read_code(code)).first()
    if row is None:
        raise Conflict(f"No augmentation has the code {code!r}; it stands in its page's address.")
    return row


def read_conversation_until(answer: models.Augmentation | None) -> tuple[Message, ...]:
    """Return the modifier's conversation up to and including the answer that counted.

    Raises:
        Conflict: There is no such answer, or it is not on record.
    """
    if answer is None:
        raise Conflict("The answer that it goes on from was deleted.")
    if not answer.is_answer:
        raise Conflict(
            f"There is no answer to go on from: {answer.contestant.name} on "
            f"{answer.scenario.slug} is {answer.get_state_display().lower()}."
        )
    calls = models.ModelCall.objects.filter(
        attempt__augmentation=answer, role=ModelRole.MODIFIER, answer__isnull=False, fault=""
    ).order_by("attempt__number", "number")
    last = calls.last()
    if last is None:
        raise Conflict("No language model gave this answer: there is nobody to be told more.")
    notes = models.TranscriptNote.objects.filter(attempt=last.attempt_id)
    note = notes.filter(kind=NoteKind.KEPT).first()
    if note is not None:
        counted = notes.get(kind=NoteKind.ROUND, document__round=note.document["round"])
        last = calls.filter(attempt=last.attempt_id, number__lte=counted.after_call).last()
    if last is None or last.removed_at is not None:
        raise Conflict("Its transcript was removed for its age: nobody can go on from it.")
    messages = (message_from_document(message) for message in last.request["messages"])
    return (*messages, model_message(last.answer or ""))


def steps_to(row: models.Augmentation) -> list[models.Augmentation]:
    """Return the steps of a conversation up to this one, the first answer first."""
    steps, before = [row], row.follows
    while before is not None and before not in steps:
        steps.insert(0, before)
        before = before.follows
    return steps


# --- Corrections by hand -----------------------------------------------------------------------


@transaction.atomic
def keep_correction(
    original: models.Augmentation,
    document: object,
    *,
    slug: str = BY_HAND,
    notes: str = "",
    actor: User | None = None,
) -> models.Augmentation:
    """Create a waiting row of a job of its own; the caller sends its message.

    Args:
        original: What is corrected; it stays as it is.
        document: The modification as it should be.
        slug: Of the contestant that it counts for, or a person's name; made if there is none.
        notes: Why it was corrected, or nothing.
        actor: Whose hand it was.

    Raises:
        InvalidDocument: The document, the name or the notes break their format.
        InvalidModification: The modification does not fit the scene.
        Conflict: Nothing was changed, nothing is left, or the slug is that of somebody who is no
            person or retired.
    """
    modification = read_edit(original.scenario, document)
    if modification.is_empty:
        raise Conflict("Nothing is added, moved or removed: there is nothing to keep.")
    before = original.modification
    if before is not None and modification == read_edit(original.scenario, before):
        raise Conflict("Nothing was corrected: it is as it was.")
    if notes:
        check_prose("notes", notes, what="correction", longest=LONGEST_NOTES)
    contestant = _find_or_add_person(slug)
    name = f"By hand: {original.scenario.slug}"
    job = models.GenerationJob.objects.create(name=name, launched_by=actor)
    job.contestants.set([contestant])
    job.scenarios.set([original.scenario])
    row = models.Augmentation.objects.create(
        job=job,
        scenario=original.scenario,
        contestant=contestant,
        modification=modification_to_document(modification),
        notes=notes.strip(),
        corrects=original,
        made_by=actor,
    )
    made = {
        "augmentation": str(row.code),
        "contestant": contestant.slug,
        "modification": row.modification,
    }
    log_change(original, "correct", actor, before={"modification": before}, after=made)
    return row


def starting_document(original: models.Augmentation) -> dict[str, object]:
    """Return the modification that a correction begins with."""
    stored = original.modification
    return modification_to_document(
        modification_from_document(stored) if stored else Modification()
    )


def _find_or_add_person(name: str) -> models.Contestant:
    human = models.Contestant.Kind.HUMAN
    is_meant = Q(slug=name) | Q(name=name, kind=human)
    row = models.Contestant.objects.filter(is_meant).order_by("pk").first()
    if row is None:
        title = (
            "Corrected by hand" if name == BY_HAND else one_line("name", name, what="contestant")
        )
        slug = free_slug(models.Contestant.objects, name, otherwise="person")
        row = models.Contestant.objects.create(slug=slug, name=title, kind=human)
    if row.kind != human or row.retired_at:
        raise Conflict(f"“{row.name}” is no person or is retired; choose another name.")
    return row
