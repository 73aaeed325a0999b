"""Probes that somebody asks for on a page: a row, made by a worker and seen line by line."""

from __future__ import annotations

from dataclasses import asdict
from datetime import timedelta

from django.conf import settings
from django.contrib.auth.models import User
from django.db import IntegrityError, transaction
from django.utils import timezone

from augment.errors import AugmentError, Conflict
from augment.llm.questions import Ability
from augment.models import EndpointModel, Probe
from augment.sentences import sentence
from augment.services.clock import DATABASE_TIME, Moment
from augment.services.endpoints.probe import ProbeFinding, probe
from augment.services.texts import LONGEST_REASON, make_document_storable, make_storable

State = Probe.State
ABILITIES = tuple(ability.value for ability in Ability)
"""What is asked about, in this order."""


def plan_probe(model: EndpointModel, *, actor: User | None = None) -> Probe:
    """The row of a probe that nobody has made yet; the door sends its message.

    Raises:
        Conflict: One is under way at this model.
    """
    try:
        with transaction.atomic():
            return Probe.objects.create(model=model, asked_by=actor)
    except IntegrityError:
        raise Conflict(
            sentence("%(model)s is being probed already; wait for its end.", model=model.model)
        ) from None


def make_probe(probe_pk: int) -> bool:
    """What a worker does: ask, unless somebody has asked for this row already.

    Why nothing could be asked stands in the row.

    Returns:
        Whether it was this call that asked.
    """
    waiting = Probe.objects.filter(pk=probe_pk, state=State.QUEUED)
    if not waiting.update(state=State.RUNNING, started_at=timezone.now()):
        return False
    row = Probe.objects.select_related("model__endpoint", "asked_by").get(pk=probe_pk)
    try:
        probe(
            label=row.model.endpoint.label,
            model=row.model.model,
            actor=row.asked_by,
            on_finding=lambda found: _keep(row, found),
        )
    except AugmentError as fault:
        _end(row, State.FAILED, str(fault))
    except Exception as error:
        _end(row, State.FAILED, f"unexpected: {type(error).__name__}: {error}")
        raise
    else:
        _end(row, State.DONE)
    return True


def give_up_stale(*, now: Moment = DATABASE_TIME) -> int:
    """Fail probes whose worker must be dead, or whose message was lost; returns how many."""
    longest = timedelta(
        seconds=len(ABILITIES) * (settings.LLM_QUEUE_S + 2 * settings.LLM_TIMEOUT_S)
    )
    stale = Probe.objects.filter(state__in=Probe.UNDER_WAY, created_at__lt=now - longest)
    return stale.update(
        state=State.FAILED, finished_at=now, reason="The worker ended, or none ever took it."
    )


# --- Private -----------------------------------------------------------------------------------


def _keep(row: Probe, found: ProbeFinding) -> None:
    row.findings = [*row.findings, make_document_storable(asdict(found))]
    Probe.objects.filter(pk=row.pk, state=State.RUNNING).update(findings=row.findings)


def _end(row: Probe, state: State, reason: str = "") -> None:
    Probe.objects.filter(pk=row.pk, state=State.RUNNING).update(
        state=state, reason=make_storable(reason)[:LONGEST_REASON], finished_at=timezone.now()
    )
