"""Every call to a language model as a row.

The request is stored before it is sent, the answer before it is read, each in a transaction of
its own: a crash in between loses nothing that was paid for.
"""

from __future__ import annotations

from django.db.models import QuerySet
from django.utils import timezone

from augment.errors import ClaimLost, ModelFault
from augment.llm.messages import Reply, Request
from augment.models import ModelCall, TranscriptNote
from augment.services import claims
from augment.services.texts import storable, storable_document
from augment.variants.transcript import ModelRole, NoteKind


class RowTranscript:
    """A transcript that writes rows of one attempt.

    Nothing more is asked for an attempt whose claim was taken back: its result would be dropped.
    """

    def __init__(self, held: claims.Claim) -> None:
        self._held = held
        self._numbers = 0
        self._notes = 0

    def known(self, role: ModelRole, request: Request, prompt_version: str) -> Reply | None:
        """None: every request is sent."""
        return None

    def asked(self, role: ModelRole, request: Request, prompt_version: str) -> int:
        """Store a request; returns its number, from 1.

        Raises:
            ClaimLost: The row is somebody else's now.
        """
        if not claims.is_held(held=self._held):
            raise ClaimLost(f"attempt {self._held.attempt_number} has lost its row")
        self._numbers += 1
        ModelCall.objects.create(
            attempt_id=self._held.attempt_pk,
            number=self._numbers,
            role=role,
            request=storable_document(request.to_document()),
            prompt_version=prompt_version,
            started_at=timezone.now(),
        )
        return self._numbers

    def answered(self, number: int, reply: Reply) -> None:
        """Store the raw answer to that call; a refusal that says nothing else is the answer."""
        self._call(number).update(
            answer=storable(reply.text or reply.refusal or ""),
            model_returned=storable(reply.model)[:120],
            finish_reason=storable(reply.finish_reason)[:40],
            prompt_tokens=reply.prompt_tokens,
            completion_tokens=reply.completion_tokens,
            latency_s=reply.latency_s,
        )

    def broke(self, number: int, fault: ModelFault) -> None:
        """Store why there was no answer to that call."""
        self._call(number).update(fault=storable(sentence_of(fault)))

    def note(self, kind: NoteKind, document: dict[str, object]) -> None:
        """Store what happened since the last call."""
        self._notes += 1
        TranscriptNote.objects.create(
            attempt_id=self._held.attempt_pk,
            number=self._notes,
            after_call=self._numbers,
            kind=kind,
            document=storable_document(document),
        )

    def _call(self, number: int) -> QuerySet[ModelCall]:
        return ModelCall.objects.filter(attempt_id=self._held.attempt_pk, number=number)


def sentence_of(fault: ModelFault) -> str:
    """What broke, with the HTTP status where there was one."""
    text = str(fault)
    if fault.status is None or str(fault.status) in text:
        return text
    return f"HTTP {fault.status}: {text}"
