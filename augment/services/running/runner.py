"""One augmentation from lease to outcome: ask the contestant, keep the answer, draw, settle.

In: the primary key of an `Augmentation` row, which says scenario and contestant. Out: the same row
with its state, modification, notes or reason, and picture, and its calls as `ModelCall` rows.
"""

import logging
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from dataclasses import replace
from functools import partial
from typing import Any

from django.db import Error
from django.db.models import Max, Q, QuerySet, Subquery
from django.db.models.functions import Coalesce, Greatest

from augment import errors
from augment.baselines.registry import PLACERS, RULE_PLACER
from augment.benchmark.values import EntryStatus
from augment.llm.client import ChatClient
from augment.llm.messages import shorten
from augment.models import Attempt, Augmentation, Contestant, Endpoint, GenerationJob
from augment.prompts.fill import Messages, follow_up_messages
from augment.scene.codec import modification_from_document, modification_to_document
from augment.scene.density import fit_boxes
from augment.services import clock, texts, work
from augment.services.benchmarks.submissions import find_entry
from augment.services.endpoints.client import EndpointClient, Queue, wire_to
from augment.services.endpoints.contestants import Treatment, read_respondents, read_treatment
from augment.services.running import budget, jobs, workers
from augment.services.running.calls import RowTranscript, insist_wanted
from augment.services.running.follow_ups import read_conversation_until
from augment.services.scenarios.pictures import draw_picture, load_camera, original_picture, redraw
from augment.services.scenarios.scenes import LoadedScenario, scenario_seed
from augment.variants import pipeline
from augment.variants.options import ToolProtocol, recipe_with
from augment.variants.pipeline import Outcome, OutcomeStatus
from augment.variants.recipes import find_recipe
from augment.variants.respondents import ModelRole, RespondentClient, Respondents

logger = logging.getLogger(__name__)

Kind = Contestant.Kind
State = Augmentation.State
SUBMITTED = {
    EntryStatus.READ: OutcomeStatus.DONE,
    EntryStatus.REFUSED: OutcomeStatus.REFUSED,
    EntryStatus.UNREADABLE: OutcomeStatus.UNREADABLE,
    EntryStatus.MISSING: OutcomeStatus.UNREADABLE,
}
"""What an entry of a submission is as an augmentation."""
Connect = Callable[[Endpoint], AbstractContextManager[ChatClient]]
Held = work.Lease[Augmentation]

CANCELLED = GenerationJob.objects.filter(state=GenerationJob.State.CANCELLED)
CLOSED = GenerationJob.objects.filter(
    state__in=(GenerationJob.State.CANCELLED, *GenerationJob.HELD)
)
"""Jobs in which nothing is started any more, or not for now."""


class Augmentations(work.WorkKind[Augmentation]):
    """Rows of jobs.

    Args:
        connect: How an endpoint is reached; None over the wire.
    """

    model = Augmentation
    queue = "models"
    priority = 6
    lost_limit = 5
    related = ("job", "scenario__base_scene", "contestant__endpoint", "follows")

    def __init__(self, connect: Connect | None = None) -> None:
        self._connect = connect

    def waiting(self) -> QuerySet[Augmentation]:
        """Return waiting rows: not of held or cancelled jobs, nor following an unfinished one."""
        unanswered = self.rows.filter(state__in=Augmentation.UNDER_WAY)
        return super().waiting().exclude(job__in=CLOSED).exclude(follows__in=unanswered)

    def find_unblocked(self, pk: int) -> list[int]:
        """Return the follow-ups that have waited for this row."""
        return list(self.waiting().filter(follows=pk, sent_at=None).values_list("pk", flat=True))

    def columns(self, row: Augmentation) -> dict[str, Any]:
        """Return the options with which its model was asked."""
        return {"options": row.options}

    def run(self, row: Augmentation, held: Held) -> work.Settlement:
        """Ask, keep, draw."""
        try:
            return self._make(row, held)
        except errors.InvalidModification as error:
            raise errors.Conflict(f"The modification does not fit the scene: {error}") from error

    def _make(self, row: Augmentation, held: Held) -> work.Settlement:
        loaded = LoadedScenario(row.scenario)
        if row.modification is not None:  # of an earlier attempt that could not draw it
            outcome = Outcome(
                status=OutcomeStatus.DONE,
                modification=modification_from_document(row.modification),
                notes=row.notes,
            )
        else:
            outcome = _ask(row, loaded, held, self._connect)
        settle = partial(work.Settlement, state=outcome.status.value, reason=outcome.reason)
        if outcome.modification is None:
            return settle(columns={"image": original_picture(row.scenario)})
        modification = fit_boxes(loaded.scene, outcome.modification)
        document = texts.make_document_storable(modification_to_document(modification))
        columns: dict[str, Any] = {"modification": document}
        if outcome.notes:
            columns["notes"] = shorten(texts.make_storable(outcome.notes), texts.LONGEST_NOTES)
        try:
            camera = load_camera(row.scenario, {row.pk: document})
            image = draw_picture(loaded, modification, camera)
        except Exception:
            is_done = outcome.status is OutcomeStatus.DONE
            held.note(**(columns if is_done else {}))  # a second try only has to draw
            raise
        return settle(columns=columns | {"image": image})

    def on_start(self, pk: int, worker: str, now: clock.Moment) -> Attempt:
        """Open the next attempt."""
        tries = Attempt.objects.filter(augmentation_id=pk)
        last = tries.order_by().values("augmentation").annotate(last=Max("number")).values("last")
        number = Coalesce(Subquery(last), 0) + 1
        return tries.create(augmentation_id=pk, number=number, worker=worker, started_at=now)

    def on_finish(self, pk: int, end: str, reason: str, now: clock.Moment) -> None:
        """Close the attempt and settle its calls; one that was lost has no time of its end."""
        if end not in SUBMITTED.values():  # what ends with an answer has seen all of its calls end
            budget.settle_unseen(of=Q(attempt__augmentation=pk), now=now)
        # The clock may have been set back since the start.
        finished = None if end == work.TryEnd.LOST else Greatest("started_at", now)
        Attempt.objects.filter(augmentation_id=pk, finished_at=None, outcome="").update(
            finished_at=finished, outcome=end, reason=reason
        )

    def after_commit(self, row: Augmentation, outcome: work.Settlement | None) -> None:
        """Draw the others anew where a change needs a wider window; finish the job."""
        try:
            if outcome is not None and outcome.columns.get("modification") is not None:
                redraw(row.scenario)
        finally:
            jobs.finish_if_over(job_pk=row.job_id)

    def outcome_of_loss(self, row: Augmentation) -> work.Settlement | None:
        """Cancel a row of a cancelled job."""
        if CANCELLED.filter(pk=row.job_id).exists():
            return work.Settlement(state=State.CANCELLED)
        return super().outcome_of_loss(row)

    def cleanup(self, now: clock.Moment) -> None:
        """Cancel what was given back in a cancelled job; finish the jobs that are over."""
        orphans = self.rows.filter(state=State.QUEUED, job__in=CANCELLED)
        work.change_all(orphans, state=State.CANCELLED, finished_at=now)
        jobs.finish_if_over(now=now)


AUGMENTATIONS = Augmentations()


def open_wire(
    endpoint: Endpoint, held: Held, treatment: Treatment | None = None
) -> AbstractContextManager[ChatClient]:
    """Return a client for the endpoint, with the key that its variable holds right now.

    Its calls wait for a place at the endpoint, and for their answer, as long as the lease is
    held and the job not cancelled.

    Raises:
        KeyNotAllowed: The variable is not meant for keys.
        KeyMissing: The variable is not set here.
        ModelFault: The key can't be sent.
    """

    def insist_before_sending() -> None:
        """A worker that is to stop sends nothing more; what it has sent it waits for."""
        workers.insist_on_going_on()
        insist_wanted(held)

    def insist_in_flight() -> None:
        """A database that can't say whether a call is wanted ends no call that is paid."""
        try:
            insist_wanted(held)
        except Error as error:
            logger.warning("Nobody could say whether a call is still wanted: %s", error)

    queue = Queue(still_wanted=insist_before_sending)
    wire = wire_to(endpoint, still_wanted=insist_in_flight)
    return EndpointClient(wire, endpoint, queue, treatment)


# --- Private -----------------------------------------------------------------------------------


def _ask(
    row: Augmentation, loaded: LoadedScenario, held: Held, connect: Connect | None
) -> Outcome:
    contestant = row.contestant
    if contestant.kind == Kind.REFERENCE:
        if loaded.reference is None:
            raise errors.Conflict("The scenario has no reference modification.")
        return Outcome(status=OutcomeStatus.DONE, modification=loaded.reference)
    if contestant.kind == Kind.SUBMISSION:
        entry = find_entry(contestant, row.scenario.slug, row.sample)
        status, notes = SUBMITTED[entry.status], "\n".join(entry.notes)
        return Outcome(
            status=status, modification=entry.modification, reason=entry.reason, notes=notes
        )
    if contestant.endpoint is not None:
        before = row.follows
        if before is not None and before.state in row.MISSES and not before.is_answer:
            reason = f"It would go on from an answer that is none: {before.reason}"
            return Outcome(status=OutcomeStatus(before.state), reason=reason)
        outcome = _ask_model(row, loaded, held, connect)
        if before is None or outcome.status is not OutcomeStatus.REFUSED:
            return outcome
        # A refused wish changes nothing: the answer before stays.
        return replace(outcome, modification=modification_from_document(before.modification))
    placer = RULE_PLACER if contestant.kind == Kind.RULE else contestant.slug
    if contestant.kind not in (Kind.RULE, Kind.BASELINE) or placer not in PLACERS:
        raise errors.Conflict(f"A job can't run {contestant.slug} any more.")
    slug = row.scenario.slug
    # Each sample has a seed of its own; the first keeps that of jobs without samples.
    seed = scenario_seed(slug if row.sample == 1 else f"{slug}#{row.sample}")
    try:
        placed = PLACERS[placer].place(loaded.scene, loaded.intent, seed=seed)
    except errors.CannotPlace as refusal:
        return Outcome(status=OutcomeStatus.REFUSED, reason=str(refusal))
    return Outcome(status=OutcomeStatus.DONE, modification=placed.modification, notes=placed.notes)


def _ask_model(
    row: Augmentation, loaded: LoadedScenario, held: Held, connect: Connect | None
) -> Outcome:
    conversation: Messages = ()
    if row.scenario.follows_id is not None:
        conversation = follow_up_messages(
            read_conversation_until(row.follows), row.scenario.instruction
        )
    respondents = read_respondents(row.contestant)
    treatment = read_treatment(row.contestant, respondents)
    options = treatment.options
    row.options = options.to_document()
    open_client = connect or partial(open_wire, held=held, treatment=treatment)
    with ExitStack() as opened:
        clients = {
            site: opened.enter_context(open_client(site))
            for site in {respondent.endpoint for respondent in respondents.values()}
        }
        playing = {
            role: RespondentClient(
                client=clients[respondent.endpoint],
                model=respondent.model,
                context_tokens=respondent.facts.context_tokens,
                native_tools=role is ModelRole.MODIFIER
                and options.protocol is ToolProtocol.NATIVE,
            )
            for role, respondent in respondents.items()
        }
        return pipeline.run(
            recipe_with(find_recipe(row.contestant.variant), options),
            pipeline.EditTask(
                scene=loaded.scene,
                instruction=row.scenario.wording,
                intent=loaded.intent,
                conversation=conversation,
            ),
            Respondents(
                clients=playing,
                transcript=RowTranscript(held, row, respondents, key=options.key(row.sample)),
                sampling=options.sampling(row.sample),
            ),
        )
