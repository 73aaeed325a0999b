"""One augmentation from lease to outcome: ask the contestant, keep the answer, draw, settle.

In: the primary key of an `Augmentation` row, which says scenario and contestant. Out: the same row
with its state, modification, notes or reason, and picture, and its calls as `ModelCall` rows.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, replace
from typing import Any

from django.conf import settings
from django.db import Error, OperationalError
from django.db.models import QuerySet

from augment.baselines.registry import PLACERS, RULE_PLACER, PlaceIntent
from augment.errors import (
    AugmentError,
    BudgetSpent,
    CannotPlace,
    DatabaseLocked,
    InvalidModification,
    JobCancelled,
    ModelFault,
    Unwanted,
)
from augment.llm.client import ChatClient
from augment.llm.messages import shorten
from augment.models import Augmentation, Contestant, Endpoint
from augment.scene.codec import modification_from_document, modification_to_document
from augment.scene.entities import Modification, Scene
from augment.services.clock import Moment
from augment.services.endpoints.client import EndpointClient, Queue, wire_to
from augment.services.endpoints.treatments import (
    Respondent,
    Treatment,
    respondents_of,
    treatment_of,
)
from augment.services.running import jobs, workers
from augment.services.running.calls import (
    CANCELLED,
    CLOSED,
    RowTranscript,
    close_attempt,
    insist_wanted,
    open_attempt,
    sentence_of,
)
from augment.services.scenarios.pictures import camera_of, original_picture, picture_of, redraw
from augment.services.scenarios.scenes import intent_of, reference_of, scene_of, seed_of
from augment.services.texts import LONGEST_NOTES, make_document_storable, make_storable
from augment.services.work import Lease, Settlement, WorkKind, change_all
from augment.variants import pipeline
from augment.variants.options import ToolProtocol, recipe_with
from augment.variants.recipes import find_recipe
from augment.variants.respondents import ModelRole, RespondentClient

logger = logging.getLogger(__name__)

Kind = Contestant.Kind
State = Augmentation.State
Connect = Callable[[Endpoint], AbstractContextManager[ChatClient]]
Held = Lease[Augmentation]


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What a contestant made of a scenario, before it is drawn."""

    state: Augmentation.State
    modification: Modification | None = None
    notes: str = ""
    reason: str = ""


def open_wire(
    endpoint: Endpoint, held: Held, treatment: Treatment | None = None
) -> AbstractContextManager[ChatClient]:
    """A client for the endpoint, with the key that its variable holds right now.

    Its calls wait for a place at the endpoint, and for their answer, as long as the lease is
    held and the job not cancelled.

    Raises:
        KeyNotAllowed: The variable is not meant for keys.
        KeyMissing: The variable is not set here.
        ModelFault: The key can't be sent, or the address is forbidden.
    """
    queue = Queue(
        longest_s=settings.LLM_QUEUE_S, still_wanted=lambda: _insist_before_sending(held)
    )
    return EndpointClient(
        wire_to(endpoint, still_wanted=lambda: _insist_if_told(held)), endpoint, queue, treatment
    )


class Augmentations(WorkKind[Augmentation]):
    """Rows of jobs.

    Args:
        connect: How an endpoint is reached; None over the wire.
    """

    model = Augmentation
    queue = "models"
    lost_limit = 5
    related = ("job", "scenario__base_scene", "contestant__endpoint")

    def __init__(self, connect: Connect | None = None) -> None:
        self._connect = connect

    def waiting(self) -> QuerySet[Augmentation]:
        """None of a job that was cancelled, is paused or stopped at its cap."""
        return super().waiting().exclude(job__in=CLOSED)

    def run(self, row: Augmentation, held: Held) -> Settlement:
        """Ask, keep, draw."""
        return run(row, held=held, connect=self._connect)

    def begun(self, pk: int, worker: str, now: Moment) -> None:
        """Open the next attempt."""
        open_attempt(pk, worker, now)

    def ended(self, pk: int, end: str, reason: str, now: Moment) -> None:
        """Close the attempt and settle its calls."""
        close_attempt(pk, end, reason, now)

    def over(self, row: Augmentation, outcome: Settlement | None) -> None:
        """Draw the others anew where a change needs a wider window; finish the job."""
        try:
            if outcome is not None and outcome.columns.get("modification") is not None:
                redraw(row.scenario)
        finally:
            jobs.finish_if_over(job_pk=row.job_id)

    def outcome_of_loss(self, row: Augmentation) -> Settlement | None:
        """A row of a cancelled job is cancelled."""
        if CANCELLED.filter(pk=row.job_id).exists():
            return Settlement(state=State.CANCELLED)
        return super().outcome_of_loss(row)

    def tidy(self, now: Moment) -> None:
        """Cancel what was given back in a cancelled job; finish the jobs that are over."""
        orphans = self.rows.filter(state=State.QUEUED, job__in=CANCELLED)
        change_all(orphans, state=State.CANCELLED, finished_at=now)
        jobs.finish_if_over(now=now)


AUGMENTATIONS = Augmentations()


def work_on(*, augmentation_pk: int, worker: str = "", connect: Connect | None = None) -> bool:
    """Lease a row, run it and write its outcome. Returns whether it could be leased."""
    return Augmentations(connect).perform(augmentation_pk, worker=worker)


def run(row: Augmentation, *, held: Held, connect: Connect | None = None) -> Settlement:
    """How the row ends. Every foreseen fault is a failed outcome with a sentence.

    Raises:
        LeaseLost, WorkerStopping: The row was taken back meanwhile, or this worker stops.
        BudgetSpent: The job has no room for the next call.
    """
    try:
        scene = scene_of(row.scenario)
        unchanged = original_picture(row.scenario)
        answer = _kept(row) or _asked(row, scene, held, connect)
        if answer.state == State.FAILED:
            return _failed(answer.reason)
        if answer.modification is None:
            return Settlement(
                state=answer.state, reason=answer.reason, columns={"image": unchanged}
            )
        columns = _columns(answer, answer.modification)
        held.note(**columns)
        image = picture_of(scene, answer.modification, camera_of(row.scenario))
        return Settlement(state=answer.state, columns=columns | {"image": image})
    except JobCancelled as cancelled:
        return Settlement(state=State.CANCELLED, reason=str(cancelled))
    except (Unwanted, BudgetSpent):
        raise
    except ModelFault as fault:
        return _failed(sentence_of(fault))
    except InvalidModification as error:
        return _failed(f"The modification does not fit the scene: {error}")
    except AugmentError as error:
        return _failed(str(error))
    except OperationalError as error:
        # What was answered is in its rows: a second try pays for none of it.
        return _failed(str(DatabaseLocked(str(error))))


# --- Private -----------------------------------------------------------------------------------


def _insist_before_sending(held: Held) -> None:
    """A worker that is to stop sends nothing more; what it has sent it waits for."""
    workers.insist_on_going_on()
    insist_wanted(held)


def _insist_if_told(held: Held) -> None:
    """The same while a call is in flight: a database that can't say ends no call that is paid."""
    try:
        insist_wanted(held)
    except Error as error:
        logger.warning("Nobody could say whether a call is still wanted: %s", error)


def _kept(row: Augmentation) -> Answer | None:
    """The answer of an earlier attempt that was stored but not drawn any more."""
    if row.modification is None:
        return None
    modification = modification_from_document(row.modification)
    return Answer(state=State.DONE, modification=modification, notes=row.notes)


def _columns(answer: Answer, modification: Modification) -> dict[str, Any]:
    """What is stored before it is drawn, so that a second try only has to draw."""
    notes = {"notes": shorten(make_storable(answer.notes), LONGEST_NOTES)} if answer.notes else {}
    document = make_document_storable(modification_to_document(modification))
    return {"modification": document, **notes}


def _asked(row: Augmentation, scene: Scene, held: Held, connect: Connect | None) -> Answer:
    """What the contestant says now."""
    match row.contestant.kind:
        case Kind.REFERENCE:
            return _from_reference(row)
        case Kind.RULE:
            return _from_placer(row, PLACERS[RULE_PLACER].place, scene)
        case Kind.BASELINE if row.contestant.slug in PLACERS:
            return _from_placer(row, PLACERS[row.contestant.slug].place, scene)
        case Kind.LLM | Kind.SIMULATED if row.contestant.endpoint is not None:
            return _from_model(row, row.contestant.endpoint, scene, held, connect)
    return Answer(
        state=State.FAILED, reason=f"A job can't run contestants of kind {row.contestant.kind!r}."
    )


def _from_reference(row: Augmentation) -> Answer:
    reference = reference_of(row.scenario)
    if reference is None:
        return Answer(state=State.FAILED, reason="The scenario has no reference modification.")
    return Answer(state=State.DONE, modification=reference)


def _from_placer(row: Augmentation, place: PlaceIntent, scene: Scene) -> Answer:
    """What a contestant that asks nobody makes of the intent, or why it refuses."""
    try:
        placed = place(
            scene, intent_of(row.scenario), seed=seed_of(_drawn(row, row.scenario.slug))
        )
    except CannotPlace as refusal:
        return Answer(state=State.REFUSED, reason=refusal.reason)
    return Answer(state=State.DONE, modification=placed.modification, notes=placed.notes)


def _drawn(row: Augmentation, what: str) -> str:
    """What a draw depends on: each sample has one of its own, and the first is as ever."""
    return what if row.sample == 1 else f"{what}#{row.sample}"


def _from_model(
    row: Augmentation, endpoint: Endpoint, scene: Scene, held: Held, connect: Connect | None
) -> Answer:
    respondents = respondents_of(row.contestant)
    treatment = treatment_of(row.contestant, respondents)
    options = treatment.options
    held.note(options=options.to_document())
    sites = {respondent.endpoint.pk: respondent.endpoint for respondent in respondents.values()}
    with ExitStack() as opened:
        clients = {
            pk: opened.enter_context(
                open_wire(site, held, treatment) if connect is None else connect(site)
            )
            for pk, site in sites.items()
        }
        others: dict[ModelRole, RespondentClient] = {
            role: _client_for(respondent, clients)
            for role, respondent in respondents.items()
            if role is not ModelRole.MODIFIER
        }
        outcome = pipeline.run(
            recipe_with(find_recipe(row.contestant.variant), options),
            scene=scene,
            instruction=row.scenario.instruction,
            modifier=replace(
                _client_for(respondents[ModelRole.MODIFIER], clients),
                native_tools=options.protocol is ToolProtocol.NATIVE,
            ),
            transcript=RowTranscript(
                held,
                row,
                endpoint,
                others={role: respondents[role].endpoint for role in others},
                key=options.key(row.sample),
            ),
            others=others,
            intent=intent_of(row.scenario),
            sampling=options.sampling(row.sample),
        )
    return Answer(
        state=State(outcome.status.value),
        modification=outcome.modification,
        notes=outcome.notes,
        reason=outcome.reason,
    )


def _client_for(respondent: Respondent, clients: dict[int, ChatClient]) -> RespondentClient:
    return RespondentClient(
        client=clients[respondent.endpoint.pk],
        model=respondent.model,
        context_tokens=respondent.context_tokens,
    )


def _failed(reason: str) -> Settlement:
    return Settlement(state=State.FAILED, reason=reason)
