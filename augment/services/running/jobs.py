"""Generation jobs: launched, paused, resumed, cancelled, retried, finished."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import Case, Exists, F, OuterRef, QuerySet, Value, When

from augment.errors import Conflict, check_names
from augment.models import Augmentation, Contestant, GenerationJob, Scenario
from augment.services import clock, events, texts, work
from augment.services.endpoints.contestants import list_unpriced_models, loosen_unanswered
from augment.services.inputs import InputKind, check_bounds, input_field
from augment.services.running import budget, choosing, progress
from augment.variants.options import MOST_SAMPLES

State = Augmentation.State
JobState = GenerationJob.State

OPEN = (JobState.RUNNING, *GenerationJob.HELD)
"""States of jobs that are not over."""

_MAY_END = (JobState.RUNNING, JobState.PAUSED)
"""A paused job whose last row was in flight has nothing left to resume."""

_Row = TypeVar("_Row", Contestant, Scenario)


@dataclass(frozen=True, kw_only=True)
class JobScope:
    """Scope of a job: contestants x scenarios x samples."""

    contestants: Sequence[str] = input_field(InputKind.NAMES, "Contestants", "Slugs.")
    scenarios: Sequence[str] = input_field(InputKind.NAMES, "Scenarios", "Slugs.")
    samples: int = input_field(
        InputKind.WHOLE,
        "Samples",
        "So often each contestant is asked about each scenario.",
        default=1,
        least=1,
        most=MOST_SAMPLES,
    )
    is_fresh: bool = input_field(
        InputKind.SWITCH, "Ask anew what models answered in other jobs", default=False
    )


@dataclass(frozen=True, kw_only=True)
class JobRequest(JobScope, budget.Caps):
    """A new job.

    Attributes:
        full_plan: Of a job that tries one scenario first: what was chosen for the whole one.
    """

    name: str = input_field(InputKind.TEXT, "Name", "What people call it.", most=120)
    full_plan: dict[str, Any] | None = None


@transaction.atomic
def launch(
    request: JobRequest, actor: User | None = None, *, follows: Augmentation | None = None
) -> GenerationJob:
    """Write a job and its waiting rows; the caller sends the messages.

    A follow-up goes on from its contestant's answer to the scenario before it, in the same job.

    Args:
        request: What it runs; a slug given twice counts once.
        actor: Who launches it, None for the machine.
        follows: The answer, of another job, that its only row goes on from.

    Raises:
        InvalidDocument: The name is empty, too long or not one line; or a number can't be.
        UnknownName: A slug that nobody registered.
        Conflict: Nothing is chosen, a contestant can't be run, the reference is to run on
            scenarios that have none, a submission on what it does not answer, a viewer can't see,
            or a cap in USD meets an unknown price.
    """
    name = texts.one_line("name", request.name, what="job")
    check_bounds(request)
    loosen_unanswered(Contestant.objects.filter(slug__in=request.contestants))
    who = _in_order(Contestant.objects.all(), request.contestants, "contestant")
    where = _in_order(Scenario.objects.all(), request.scenarios, "scenario")
    if follows is None:
        where = with_followed(where)
    choosing.refuse_impossible(who, where, samples=request.samples)
    unpriced = list_unpriced_models(who) if request.cap_usd is not None else []
    job = GenerationJob.objects.create(
        name=name,
        launched_by=actor,
        samples=request.samples,
        is_fresh=request.is_fresh,
        full_plan=request.full_plan,
        **budget.cap_columns(request, unpriced),
    )
    job.contestants.set(who)
    job.scenarios.set(where)
    rows = Augmentation.objects.bulk_create(
        Augmentation(
            job=job, scenario=scenario, contestant=contestant, sample=sample, follows=follows
        )
        for sample in range(1, job.samples + 1)
        for scenario in where
        for contestant in who
    )
    if follows is None:
        _let_follow(rows)
    settings = {"samples": job.samples, "is_fresh": job.is_fresh, "cap": budget.describe_caps(job)}
    slugs = {"contestants": [row.slug for row in who], "scenarios": [row.slug for row in where]}
    _log(job, "launch", actor, after={"name": name, **slugs, **settings})
    return job


def with_followed(scenarios: Iterable[Scenario]) -> list[Scenario]:
    """Return the scenarios, each behind those that it follows."""
    ordered: dict[int, Scenario] = {}
    for scenario in scenarios:
        ordered |= {wish_row.pk: wish_row for wish_row in (*scenario.followed, scenario)}
    return list(ordered.values())


@transaction.atomic
def cancel(job: GenerationJob, actor: User | None = None) -> GenerationJob:
    """Cancel what waits, and what waits for a language model: its calls in flight are given up.

    What is beyond its last call may end and keeps its result.

    Raises:
        Conflict: The job is over already.
    """
    before = job.state
    waiting = Augmentation.objects.filter(job=job, state=State.QUEUED)
    cancelled = work.change_all(waiting, state=State.CANCELLED, finished_at=clock.DATABASE_TIME)
    _move(job, OPEN, JobState.CANCELLED, "cancelled", finished_at=clock.DATABASE_TIME)
    after = {"state": JobState.CANCELLED.value, "cancelled": cancelled}
    _log(job, "cancel", actor, before={"state": before}, after=after)
    return job


@transaction.atomic
def pause(job: GenerationJob, *, actor: User | None = None) -> GenerationJob:
    """Start nothing new; what is in flight ends and keeps its results.

    Raises:
        Conflict: The job is not running.
    """
    _move(job, (JobState.RUNNING,), JobState.PAUSED, "paused")
    counts = progress.count_rows(job)
    after = {"state": JobState.PAUSED, "waiting": counts.queued, "in_flight": counts.running}
    _log(job, "pause", actor, before={"state": JobState.RUNNING.value}, after=after)
    return job


@transaction.atomic
def resume(
    job: GenerationJob, *, higher: budget.Caps = budget.NO_CAPS, actor: User | None = None
) -> GenerationJob:
    """Let a job that is paused or stopped at its cap go on; the caller sends the messages.

    Attempts that were stopped are replayed from the answers that they had, and pay for none twice.

    Args:
        job: Which.
        higher: The caps that are raised first; the others stay.
        actor: Who wants it.

    Raises:
        Conflict: The job is not held, or a cap would not be higher than it is.
    """
    waiting = Augmentation.objects.filter(job=job.pk, state=State.QUEUED)
    queued = work.change_all(waiting, sent_at=None)
    job.refresh_from_db(from_queryset=GenerationJob.objects.select_for_update())
    before = {"state": job.state, "cap": budget.describe_caps(job)}
    budget.raise_caps(job, higher)
    _move(job, GenerationJob.HELD, JobState.RUNNING, "resumed")
    after = {"state": JobState.RUNNING.value, "cap": budget.describe_caps(job), "queued": queued}
    _log(job, "resume", actor, before=before, after=after)
    return job


@transaction.atomic
def retry_failed(job: GenerationJob, actor: User | None = None) -> GenerationJob:
    """Let every failed row wait again; outcomes of the contestants themselves stay.

    In a job that is paused or stopped at its cap they wait, with the others, until it is resumed.

    Raises:
        Conflict: The job was cancelled, or nothing in it failed.
    """
    failed = Augmentation.objects.filter(job=job, state=State.FAILED)
    waiting = {"state": State.QUEUED, "reason": "", "finished_at": None, "sent_at": None}
    queued = work.change_all(failed, **waiting)
    open_again(job)
    if not queued:
        raise Conflict(f"Nothing in job '{job.name}' failed; there is nothing to try again.")
    _log(job, "retry", actor, after={"queued": queued})
    return job


def open_again(job: GenerationJob) -> None:
    """Let a job run on with what is about to wait again; one that is held stays so.

    To be called in the transaction that lets its rows wait, after they were changed.

    Raises:
        Conflict: The job was cancelled.
    """
    state = Case(
        When(state__in=GenerationJob.HELD, then=F("state")), default=Value(JobState.RUNNING)
    )
    not_cancelled = GenerationJob.objects.filter(pk=job.pk).exclude(state=JobState.CANCELLED)
    if not not_cancelled.update(state=state, finished_at=None):
        raise Conflict(f"Job '{job.name}' was cancelled; launch a new one instead.")
    loosen_unanswered(job.contestants.all())


def finish_if_over(*, now: clock.Moment = clock.DATABASE_TIME, job_pk: int | None = None) -> int:
    """Finish the job, or every running or paused job, in which nothing is under way.

    To be called after an outcome is committed, never in its transaction: two workers that end
    the last two rows at once would each still see the other's row under way.

    Returns:
        How many jobs were finished by this call.
    """
    running = GenerationJob.objects.filter(state__in=_MAY_END)
    if job_pk is not None:
        running = running.filter(pk=job_pk)
    # Looked at without the lock first: after nearly every outcome something is still under way,
    # and all workers of a job would wait for its row. Who commits the last outcome sees none.
    rows = Augmentation.objects.filter(job=OuterRef("pk"), state__in=Augmentation.UNDER_WAY)
    over = running.filter(~Exists(rows)).values_list("pk", flat=True)
    return sum(_finish(pk, now) for pk in list(over))


# --- Private -----------------------------------------------------------------------------------


@transaction.atomic
def _finish(job_pk: int, now: clock.Moment) -> int:
    """Finish one job if it is over; 1 when this call did.

    The lock comes first: a retry that is about to commit has changed the job's row, and its rows
    are to be seen as waiting again.
    """
    running = GenerationJob.objects.select_for_update().filter(pk=job_pk, state__in=_MAY_END)
    if not list(running.values_list("pk")):
        return 0
    if Augmentation.objects.filter(job=job_pk, state__in=Augmentation.UNDER_WAY).exists():
        return 0
    return running.update(state=JobState.FINISHED, finished_at=now)


def _let_follow(rows: Sequence[Augmentation]) -> None:
    """Tie each follow-up of a new job to the answer that it goes on from."""
    cells = {(row.scenario_id, row.contestant_id, row.sample): row for row in rows}
    later = [row for row in rows if row.scenario.follows_id is not None]
    for row in later:
        row.follows = cells[row.scenario.follows_id or 0, row.contestant_id, row.sample]
    Augmentation.objects.bulk_update(later, ["follows"])


def _move(
    job: GenerationJob, origins: Sequence[JobState], state: JobState, verb: str, **columns: object
) -> None:
    """Change the state of a job that is in one of these.

    Raises:
        Conflict: It is not.
    """
    rows = GenerationJob.objects.filter(pk=job.pk, state__in=origins)
    if not rows.update(state=state, **columns):
        job.refresh_from_db()
        is_now = job.get_state_display().lower()
        raise Conflict(f"Job '{job.name}' is {is_now}, so it can't be {verb}.")


def _log(job: GenerationJob, verb: str, actor: User | None, **states: dict[str, Any]) -> None:
    """Log a change that is written, and read the job anew."""
    events.log_change(job, verb, actor, **states)
    job.refresh_from_db()


def _in_order(rows: QuerySet[_Row], slugs: Sequence[str], what: str) -> list[_Row]:
    """Return the rows of those slugs in the given order, each once."""
    by_slug = {row.slug: row for row in rows.filter(slug__in=slugs)}
    if not by_slug.keys() >= set(slugs):
        check_names(what, slugs, rows.values_list("slug", flat=True))
    return [by_slug[slug] for slug in dict.fromkeys(slugs)]
