"""Probes that somebody asks for on a page: a row, made by a worker and seen line by line."""

from __future__ import annotations

from dataclasses import asdict

from django.contrib.auth.models import User
from django.db import IntegrityError, transaction

from augment.errors import Conflict
from augment.llm.questions import Ability
from augment.models import EndpointModel, Probe
from augment.services.endpoints.probing import ProbeFinding, probe
from augment.services.texts import make_document_storable
from augment.services.work import Lease, Settlement, WorkKind

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
        raise Conflict(f"{model.model} is being probed already; wait for its end.") from None


class Probes(WorkKind[Probe]):
    """Probes that somebody asked for; what each question showed stands in the row at once."""

    model = Probe
    queue = "models"
    lost_limit = 1  # it may have been paid for
    related = ("model__endpoint", "asked_by")

    def run(self, row: Probe, held: Lease[Probe]) -> Settlement:
        """Ask every question."""

        def keep(found: ProbeFinding) -> None:
            row.findings.append(make_document_storable(asdict(found)))
            held.note(findings=row.findings)

        row.findings = []
        probe(
            label=row.model.endpoint.label,
            model=row.model.model,
            actor=row.asked_by,
            on_finding=keep,
        )
        return Settlement(state=State.DONE)


PROBES = Probes()
