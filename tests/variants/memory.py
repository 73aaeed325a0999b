"""A transcript that lives as long as its run."""

from dataclasses import dataclass, field

from augment.errors import ModelFault
from augment.llm.messages import Reply, Request
from augment.variants.respondents import ModelRole, NoteKind


@dataclass(slots=True)
class RecordedCall:
    number: int
    role: ModelRole
    request: Request
    prompt_version: str
    reply: Reply | None = None
    fault: ModelFault | None = None


@dataclass(frozen=True, slots=True)
class RecordedNote:
    kind: NoteKind
    document: dict[str, object]


@dataclass(slots=True)
class MemoryTranscript:
    """Calls are numbered from 1."""

    calls: list[RecordedCall] = field(default_factory=list)
    notes: list[RecordedNote] = field(default_factory=list)

    def cached_reply(self, role: ModelRole, request: Request, prompt_version: str) -> Reply | None:
        return None

    def record_request(self, role: ModelRole, request: Request, prompt_version: str) -> int:
        self.calls.append(RecordedCall(len(self.calls) + 1, role, request, prompt_version))
        return len(self.calls)

    def sending(self, number: int) -> None:
        pass

    def record_reply(self, number: int, reply: Reply, fault: ModelFault | None = None) -> None:
        self.calls[number - 1].reply = reply
        self.calls[number - 1].fault = fault

    def broke(self, number: int, fault: ModelFault) -> None:
        self.calls[number - 1].fault = fault

    def note(self, kind: NoteKind, document: dict[str, object]) -> None:
        self.notes.append(RecordedNote(kind, document))
