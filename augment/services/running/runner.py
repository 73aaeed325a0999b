"""One augmentation from lease to outcome: ask the contestant, keep the answer, draw, settle.

In: the primary key of an `Augmentation` row, which says scenario and contestant. Out: the same row
with its state, modification, notes or reason, and picture, and its calls as `ModelCall` rows.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, replace

from django.conf import settings
from django.db import Error, OperationalError

from augment.baselines import simulated
from augment.baselines.registry import PLACERS, RULE_PLACER, PlaceIntent
from augment.errors import (
    AugmentError,
    BudgetSpent,
    CannotPlace,
    DatabaseLocked,
    InvalidModification,
    JobCancelled,
    LeaseLost,
    ModelFault,
    Unwanted,
)
from augment.llm.client import ChatClient
from augment.models import Augmentation, Contestant, Endpoint
from augment.scene.codec import modification_from_document, modification_to_document
from augment.scene.entities import Scene
from augment.scene.modification import Modification
from augment.services.endpoints.call_limits import Queue
from augment.services.endpoints.client import EndpointClient
from augment.services.endpoints.respondents import Respondent, respondents_of
from augment.services.endpoints.treatments import Treatment, treatment_of
from augment.services.endpoints.wires import wire_to
from augment.services.running import jobs, leases, stopping
from augment.services.running.holding import OutcomeOnCrash, heartbeat
from augment.services.running.transcripts import RowTranscript, sentence_of
from augment.services.scenarios.pictures import camera_of, original_picture, picture_of
from augment.services.scenarios.redrawing import redraw
from augment.services.scenarios.scenes import intent_of, reference_of, scene_of, seed_of
from augment.variants import pipeline
from augment.variants.options import ToolProtocol, recipe_with
from augment.variants.recipes import find_recipe
from augment.variants.respondents import RespondentClient
from augment.variants.transcript import ModelRole

logger = logging.getLogger(__name__)

Kind = Contestant.Kind
State = Augmentation.State
Connect = Callable[[Endpoint], AbstractContextManager[ChatClient]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What a contestant made of a scenario, before it is drawn."""

    state: Augmentation.State
    modification: Modification | None = None
    notes: str = ""
    reason: str = ""


def open_wire(
    endpoint: Endpoint, held: leases.Lease, treatment: Treatment | None = None
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


def work_on(*, augmentation_pk: int, worker: str = "", connect: Connect | None = None) -> bool:
    """Lease a row, run it and write its outcome. A row that nobody may lease is left alone.

    Args:
        augmentation_pk: The row.
        worker: Who works, for the attempt's record.
        connect: How an endpoint is reached; None over the wire.

    Returns:
        Whether the row was leased.
    """
    held = leases.take_lease(augmentation_pk=augmentation_pk, worker=worker)
    if held is None:
        return False
    row = _row(held)
    is_new_change = False
    try:
        with heartbeat(held, every_s=settings.HEARTBEAT_S), OutcomeOnCrash(held):
            settlement = run(row, held=held, connect=connect)
            is_settled = leases.settle(held=held, settlement=settlement)
            is_new_change = is_settled and settlement.modification is not None
        if is_new_change:
            redraw(row.scenario)
    finally:
        jobs.finish_if_over(job_pk=row.job_id)
    return True


def run(
    row: Augmentation, *, held: leases.Lease, connect: Connect | None = None
) -> leases.Settlement:
    """How the row ends. Every foreseen fault is a failed outcome with a sentence.

    Raises:
        Unwanted: The row was taken back or its job cancelled meanwhile, or this worker stops.
        BudgetSpent: The job has no room for the next call.
    """
    try:
        scene = scene_of(row.scenario)
        unchanged = original_picture(row.scenario)
        answer = _kept(row) or _asked(row, scene, held, connect)
        if answer.modification is None:
            return _settlement(answer, image=unchanged)
        _keep(held, answer)
        image = picture_of(scene, answer.modification, camera_of(row.scenario))
        return _settlement(answer, image=image)
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


def _insist(held: leases.Lease) -> None:
    if not leases.is_held(held=held):
        raise LeaseLost(f"attempt {held.attempt_number} has lost its row")
    if leases.is_cancelled(held=held):
        raise JobCancelled


def _insist_before_sending(held: leases.Lease) -> None:
    """A worker that is to stop sends nothing more; what it has sent it waits for."""
    stopping.insist_on_going_on()
    _insist(held)


def _insist_if_told(held: leases.Lease) -> None:
    """The same while a call is in flight: a database that can't say ends no call that is paid."""
    try:
        _insist(held)
    except Error as error:
        logger.warning("Nobody could say whether a call is still wanted: %s", error)


def _row(held: leases.Lease) -> Augmentation:
    rows = Augmentation.objects.select_related(
        "job", "scenario__base_scene", "contestant__endpoint"
    )
    return rows.get(pk=held.augmentation_pk)


def _kept(row: Augmentation) -> Answer | None:
    """The answer of an earlier attempt that was stored but not drawn any more."""
    if row.modification is None:
        return None
    modification = modification_from_document(row.modification)
    return Answer(state=State.DONE, modification=modification, notes=row.notes)


def _keep(held: leases.Lease, answer: Answer) -> None:
    assert answer.modification is not None
    document = modification_to_document(answer.modification)
    if not leases.keep_modification(held=held, modification=document, notes=answer.notes):
        raise LeaseLost(f"attempt {held.attempt_number} has lost its row")


def _asked(row: Augmentation, scene: Scene, held: leases.Lease, connect: Connect | None) -> Answer:
    """What the contestant says now."""
    match row.contestant.kind:
        case Kind.REFERENCE:
            return _from_reference(row)
        case Kind.RULE:
            return _from_placer(row, PLACERS[RULE_PLACER].place, scene)
        case Kind.BASELINE if row.contestant.slug in PLACERS:
            return _from_placer(row, PLACERS[row.contestant.slug].place, scene)
        case Kind.SIMULATED if row.contestant.error_rates is not None:
            return _from_errors(row, scene, row.contestant.error_rates, held)
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


def _from_errors(
    row: Augmentation, scene: Scene, rates: dict[str, object], held: leases.Lease
) -> Answer:
    """The reference with the errors of a simulated contestant; their label is kept apart."""
    reference = reference_of(row.scenario)
    if reference is None:
        return Answer(state=State.FAILED, reason="The scenario has no reference modification.")
    made = simulated.simulate(
        scene,
        reference,
        simulated.rates_of(rates),
        seed=seed_of(_drawn(row, f"{row.contestant.slug}/{row.scenario.slug}")),
    )
    label = {"class": made.fault_class, "fault": made.fault}
    if not leases.note_injected(held=held, injected=label):
        raise LeaseLost(f"attempt {held.attempt_number} has lost its row")
    if made.modification is None:
        return Answer(state=State.UNREADABLE, reason=made.reason)
    return Answer(state=State.DONE, modification=made.modification)


def _from_model(
    row: Augmentation,
    endpoint: Endpoint,
    scene: Scene,
    held: leases.Lease,
    connect: Connect | None,
) -> Answer:
    respondents = respondents_of(row.contestant)
    treatment = treatment_of(row.contestant, respondents)
    options = treatment.options
    if not leases.note_options(held=held, options=options.to_document()):
        raise LeaseLost(f"attempt {held.attempt_number} has lost its row")
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


def _settlement(answer: Answer, *, image: str) -> leases.Settlement:
    if answer.state == State.FAILED:
        return _failed(answer.reason)
    document = None
    if answer.modification is not None:
        document = modification_to_document(answer.modification)
    return leases.Settlement(
        state=answer.state,
        reason=answer.reason,
        modification=document,
        notes=answer.notes,
        image=image,
    )


def _failed(reason: str) -> leases.Settlement:
    return leases.Settlement(state=State.FAILED, reason=reason)
