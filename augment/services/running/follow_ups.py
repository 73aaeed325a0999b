"""Follow-ups: what a language model is told next about its own answer, step by step.

A step is an augmentation of a scenario that follows another one; `follows` leads to the step
before, which stays as it is. Going back is going on from an earlier step.
"""

from contextlib import suppress
from dataclasses import dataclass, fields
from uuid import UUID

from django.contrib.auth.models import User
from django.db import transaction
from django.utils import timezone

from augment.errors import Conflict
from augment.llm.messages import Message, message_from_document
from augment.models import Augmentation, ModelCall, Scenario, TranscriptNote
from augment.prompts.fill import model_message
from augment.services.inputs import InputKind, input_field
from augment.services.running.budget import Caps
from augment.services.running.jobs import JobRequest, launch
from augment.services.scenarios.scenes import INSTRUCTION_LENGTH, NewScenario, add_scenario
from augment.variants.respondents import ModelRole, NoteKind


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
    answer: Augmentation, request: FollowUpRequest, *, actor: User | None = None
) -> Augmentation:
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
    Scenario.objects.filter(pk=scenario.pk).update(
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


def find_augmentation(code: str) -> Augmentation:
    """Return the augmentation with that code.

    Raises:
        Conflict: There is none.
    """
    with suppress(ValueError):
        row = Augmentation.objects.filter(code=UUID(code)).first()
        if row is not None:
            return row
    raise Conflict(f"No augmentation has the code {code!r}; it stands in its page's address.")


def read_conversation_until(answer: Augmentation | None) -> tuple[Message, ...]:
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
    calls = ModelCall.objects.filter(
        attempt__augmentation=answer, role=ModelRole.MODIFIER, answer__isnull=False, fault=""
    ).order_by("attempt__number", "number")
    last = calls.last()
    if last is None:
        raise Conflict("No language model gave this answer: there is nobody to be told more.")
    notes = TranscriptNote.objects.filter(attempt=last.attempt_id)
    note = notes.filter(kind=NoteKind.KEPT).first()
    if note is not None:
        counted = notes.get(kind=NoteKind.ROUND, document__round=note.document["round"])
        last = calls.filter(attempt=last.attempt_id, number__lte=counted.after_call).last()
    if last is None or last.removed_at is not None:
        raise Conflict("Its transcript was removed for its age: nobody can go on from it.")
    messages = (message_from_document(message) for message in last.request["messages"])
    return (*messages, model_message(last.answer or ""))


def steps_to(row: Augmentation) -> list[Augmentation]:
    """Return the steps of a conversation up to this one, the first answer first."""
    steps, before = [row], row.follows
    while before is not None and before not in steps:
        steps.insert(0, before)
        before = before.follows
    return steps
