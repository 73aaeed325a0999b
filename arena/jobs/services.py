"""Labelling faults: a round is planned before the first label, and a label is never changed."""

import random
from collections.abc import Sequence
from uuid import UUID

from django.contrib.auth.models import User
from django.db import transaction
from django.utils import timezone

from arena.errors import AlreadyLabelled, LabellingClosed, NothingToPlan, NotYours
from arena.exports.written_files import ask_for
from arena.models import FaultLabel, LabellingRound, LabelTask, ScenarioFile
from arena.people.queries import experts as expert_accounts
from augment.errors import Conflict, check_names
from augment.models import Augmentation, GenerationJob
from augment.services import log_change, make_storable, one_line
from augment.services.judging import FaultClass, guess_faults
from augment.services.judging.scenario_export import FORMATS

NOTE_LENGTH = 2000


@transaction.atomic
def open_labelling(
    *, name: str, job: GenerationJob, experts: Sequence[str], seed: int, actor: User | None = None
) -> LabellingRound:
    """Plan that each expert looks at every finished augmentation of a job, in an order of its own.

    What an expert was planned to label before is left out.

    Args:
        name: Experts see it.
        job: Whose augmentations with a modification are labelled.
        experts: Usernames of accounts with the role expert.
        seed: The orders are a pure function of it.
        actor: Who opens it.

    Raises:
        UnknownName: There is no such expert.
        Conflict: The name is taken, or an expert is simulated.
        NothingToPlan: Nothing of the job is left to label for these experts.
    """
    name = one_line("name", name, what="labelling")
    people = _experts(experts)
    # Held, so that of two that are opened at once the second sees what the first has planned.
    GenerationJob.objects.select_for_update(no_key=True).get(pk=job.pk)
    labelling, is_new = LabellingRound.objects.get_or_create(
        name=name, defaults={"job": job, "seed": seed}
    )
    if not is_new:
        raise Conflict(f"There is a labelling called '{name}' already; choose another name.")
    labelling.experts.set(people)
    tasks = [task for expert in people for task in _plan_tasks(labelling, expert)]
    if not tasks:
        raise NothingToPlan("These experts have nothing left to label in this job.")
    LabelTask.objects.bulk_create(tasks)
    after = {
        "name": name,
        "job": str(job.code),
        "experts": [expert.username for expert in people],
        "seed": seed,
        "tasks": len(tasks),
    }
    log_change(labelling, "open", actor, after=after)
    return labelling


@transaction.atomic
def close_labelling(*, labelling: LabellingRound, actor: User | None = None) -> LabellingRound:
    """Take no more labels; those that are there stay, and what is left is nobody's duty.

    Raises:
        LabellingClosed: It is closed already.
    """
    now = timezone.now()
    if not LabellingRound.objects.filter(pk=labelling.pk, closed_at=None).update(closed_at=now):
        raise LabellingClosed(f"The labelling '{labelling.name}' is closed already.")
    labelling.closed_at = now
    labels = FaultLabel.objects.filter(task__labelling=labelling).count()
    log_change(labelling, "close", actor, after={"labels": labels})
    return labelling


@transaction.atomic
def save_label(
    *, expert: User, task_code: UUID, faults: frozenset[FaultClass], note: str = ""
) -> FaultLabel:
    """Store what an expert sees in one augmentation; the same again is the same label.

    Raises:
        NotYours: The task is somebody else's or does not exist.
        AlreadyLabelled: It has another label.
        LabellingClosed: It has no label, and its labelling takes none any more.
    """
    # Held, so that a replay finds the label, and nobody closes the labelling meanwhile.
    tasks = LabelTask.objects.select_for_update(of=("self", "labelling"), no_key=True)
    rows = tasks.select_related("labelling", "augmentation__scenario__base_scene")
    task = rows.filter(code=task_code, expert=expert).first()
    if task is None:
        raise NotYours("This picture is not yours to label.")
    seen = {fault.value: fault in faults for fault in FaultClass}
    label = FaultLabel.objects.filter(task=task).first()
    if label is not None:
        if any(getattr(label, name) != value for name, value in seen.items()):
            raise AlreadyLabelled("You had labelled that picture before; your first label counts.")
        return label
    if task.labelling.closed_at is not None:
        raise LabellingClosed(f"The labelling '{task.labelling.name}' is closed.")
    return FaultLabel.objects.create(
        augmentation=task.augmentation,
        expert=expert,
        task=task,
        note=make_storable(note.strip())[:NOTE_LENGTH],
        **seen,
        **guessed_columns(task.augmentation),
    )


def guessed_columns(row: Augmentation) -> dict[str, bool | None]:
    """Return what the checks guess of an augmentation, as a label keeps it."""
    guess = guess_faults(row)
    return {
        f"guessed_{fault.value}": None if guess is None else fault in guess for fault in FaultClass
    }


def _experts(usernames: Sequence[str]) -> list[User]:
    by_username = {user.username: user for user in expert_accounts()}
    check_names("expert", usernames, sorted(by_username))
    experts = [by_username[username] for username in sorted(set(usernames))]
    simulated = [user.username for user in experts if user.person.is_simulated]
    if simulated:
        raise Conflict(f"Simulated experts label nothing: {', '.join(simulated)}.")
    return experts


def _plan_tasks(labelling: LabellingRound, expert: User) -> list[LabelTask]:
    rows = Augmentation.objects.filter(job=labelling.job, state=Augmentation.State.DONE)
    left = rows.exclude(label_tasks__expert=expert).order_by("scenario__slug", "contestant__slug")
    order = list(left.values_list("pk", flat=True))
    random.Random(f"{labelling.seed}/{expert.username}").shuffle(order)
    return [
        LabelTask(labelling=labelling, expert=expert, position=n, augmentation_id=pk)
        for n, pk in enumerate(order, start=1)
    ]


def ask_for_file(
    *, job: GenerationJob, file_format: str, actor: User | None = None
) -> ScenarioFile:
    """Return a row for a worker to write; one that waits already is asked for once more.

    Raises:
        UnknownName: No such format.
    """
    check_names("format", [file_format], FORMATS)
    row = ScenarioFile(job=job, format=file_format, asked_by=actor)
    return ask_for(row, job, format=file_format)
