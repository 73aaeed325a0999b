"""The record of every call to a language model, kept as it happens.

A service keeps it in rows; tests and one-off runs keep it in memory.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Protocol

from augment.errors import ModelFault
from augment.llm.messages import Reply, Request


class ModelRole(StrEnum):
    """What a language model is asked to be: the paper's agents, and the reader of intents."""

    MODIFIER = "modifier"
    REVIEWER = "reviewer"
    ENGINEER = "engineer"
    VIEWER = "viewer"
    READER = "reader"


class NoteKind(StrEnum):
    """What a transcript notes between two calls."""

    ROUND = "round"
    TOOL_CALL = "tool_call"
    REVIEW = "review"
    KEPT = "kept"


class Transcript(Protocol):
    """Told of every attempt before it is sent, and of its end before anybody reads it."""

    def known(self, role: ModelRole, request: Request, prompt_version: str) -> Reply | None:
        """An answer that this request had before, recorded as a call that cost nothing.

        None where the request is to be sent.
        """
        ...

    def asked(self, role: ModelRole, request: Request, prompt_version: str) -> int:
        """Note that this request is about to be sent; returns the number of the call."""
        ...

    def sending(self, number: int) -> None:
        """Note that this call leaves the computer now, after every wait.

        Raises:
            LeaseLost: Nobody needs the answer any more; it is not to be sent.
        """
        ...

    def answered(self, number: int, reply: Reply, fault: ModelFault | None = None) -> None:
        """Keep the raw answer to that call, and what shows that it is none to rely on."""
        ...

    def broke(self, number: int, fault: ModelFault) -> None:
        """Note that there was no answer to that call, and why."""
        ...

    def note(self, kind: NoteKind, document: dict[str, object]) -> None:
        """Keep what happened since the last call: ready for JSON, shown as it is."""
        ...


@dataclass(slots=True, kw_only=True)
class RecordedCall:
    """One attempt: a request, and either its reply or its fault (neither while under way)."""

    number: int
    role: ModelRole
    request: Request
    prompt_version: str
    reply: Reply | None = None
    fault: ModelFault | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedNote:
    """What happened after that call (0 before the first)."""

    after_call: int
    kind: NoteKind
    document: dict[str, object]


@dataclass(slots=True)
class MemoryTranscript:
    """A transcript that lives as long as its run; calls are numbered from 1."""

    calls: list[RecordedCall] = field(default_factory=list)
    notes: list[RecordedNote] = field(default_factory=list)

    def known(self, role: ModelRole, request: Request, prompt_version: str) -> Reply | None:
        """None: every request is sent."""
        return None

    def asked(self, role: ModelRole, request: Request, prompt_version: str) -> int:
        """Note a request; returns its number."""
        number = len(self.calls) + 1
        self.calls.append(
            RecordedCall(number=number, role=role, request=request, prompt_version=prompt_version)
        )
        return number

    def sending(self, number: int) -> None:
        """Nothing: whoever keeps this record is alive to see the end of the call."""

    def answered(self, number: int, reply: Reply, fault: ModelFault | None = None) -> None:
        """Keep the answer to that call."""
        self.calls[number - 1].reply = reply
        self.calls[number - 1].fault = fault

    def broke(self, number: int, fault: ModelFault) -> None:
        """Keep the fault of that call."""
        self.calls[number - 1].fault = fault

    def note(self, kind: NoteKind, document: dict[str, object]) -> None:
        """Keep the note behind the last call."""
        self.notes.append(RecordedNote(after_call=len(self.calls), kind=kind, document=document))
