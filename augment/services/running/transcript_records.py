"""The record of an augmentation: attempts with their calls and notes, for pages and as JSON.

The JSON document holds everything that led to an augmentation; see docs/using.md. Unknown is null,
never zero.
"""

import base64
import json
from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from decimal import Decimal
from textwrap import indent
from typing import Any
from uuid import UUID

from django.core.files.storage import default_storage
from django.db import models
from django.db.models import Prefetch

from augment.llm.messages import IMAGE_SCHEME, shorten
from augment.models import Attempt, Augmentation, Contestant, ModelCall, TranscriptNote
from augment.services.endpoints.contestants import list_unsent_options
from augment.services.running.calls import IMAGES

FORMAT, VERSION = "scenario-arena/transcript", 3

LONGEST_SHOWN = 100_000
"""Characters of one text on a page; the document has all of it."""

_AT_ONCE = 200

_AUGMENTATION = (
    *("code", "sample", "options", "state", "reason", "notes", "modification", "injected"),
    *("created_at", "finished_at"),
)
_CONTESTANT = (
    *("slug", "name", "kind", "variant", "model", "roles", "options", "frozen_options", "sends"),
    "endpoint",
)
_ATTEMPT = ("number", "worker", "started_at", "finished_at", "outcome", "reason")
_CALL = (
    *("code", "number", "role", "prompt_version", "request", "request_hash", "served_from"),
    *("answer", "refusal", "extras", "fault", "model_returned", "finish_reason"),
    *("prompt_tokens", "completion_tokens", "spent_tokens", "cost_usd", "is_cost_estimated"),
    *("started_at", "sent_at", "latency_s", "cached_tokens"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SaidMessage:
    """One message of a request, cut to what a page shows.

    Attributes:
        images: SHA-256 of each.
        rest: Whatever else it carries (tool calls and their ids) as JSON; mostly empty.
        length: Of the whole text, in characters.
    """

    role: str
    text: str
    images: tuple[str, ...]
    rest: str
    length: int


@dataclass(frozen=True, slots=True, kw_only=True)
class TranscriptStep:
    """A call or, where that is None, a note."""

    call: ModelCall | None = None
    note: TranscriptNote | None = None

    @property
    def messages(self) -> list[SaidMessage]:
        """Messages of the request, oldest first."""
        return [] if self.call is None else read_messages(self.call.request)

    @property
    def parameters(self) -> dict[str, Any]:
        """Parameters of the request beside the messages."""
        request = {} if self.call is None else self.call.request
        return {name: request[name] for name in request if name not in ("messages", "model")}

    @property
    def answer_text(self) -> str | None:
        """The answer as a page shows it, None where there is none."""
        answer = None if self.call is None else self.call.answer
        return None if answer is None else shorten(answer, LONGEST_SHOWN)

    @property
    def extras_text(self) -> str:
        """Rest of the answer, such as native tool calls."""
        extras = None if self.call is None else self.call.extras
        return shorten(_pretty(extras), LONGEST_SHOWN) if extras else ""

    @property
    def note_text(self) -> str:
        """The note's document with one line for each part."""
        parts = {} if self.note is None else self.note.document
        texts = {n: part if isinstance(part, str) else _pretty(part) for n, part in parts.items()}
        lines = [
            f"{name}:\n{indent(text, '  ')}" if "\n" in text else f"{name}: {text}"
            for name, text in texts.items()
        ]
        return shorten("\n".join(lines), LONGEST_SHOWN)


@dataclass(frozen=True, slots=True, kw_only=True)
class Try:
    """One attempt with its steps."""

    attempt: Attempt
    steps: list[TranscriptStep]


@dataclass(frozen=True, slots=True, kw_only=True)
class Totals:
    """Totals of an augmentation's calls; None if a call has no number.

    Attributes:
        calls: Calls that were sent.
        calls_from_store: Calls that were answered from the store and cost nothing.
        spent_tokens: What counts against caps: the worst case where usage is unknown.
    """

    calls: int
    calls_from_store: int
    prompt_tokens: int | None
    completion_tokens: int | None
    spent_tokens: int
    cost_usd: Decimal | None
    is_cost_estimated: bool


def list_tries(augmentation: Augmentation) -> list[Try]:
    """Return every attempt, the first one first; four queries."""
    return tries_by_augmentation([augmentation.pk]).get(augmentation.pk, [])


def tries_by_augmentation(augmentations: Collection[int]) -> dict[int, list[Try]]:
    """Return the attempts of several rows by primary key; a row without any has no entry."""
    calls = Prefetch(
        "calls", ModelCall.objects.select_related("served_from__attempt__augmentation")
    )
    attempts = Attempt.objects.filter(augmentation__in=augmentations)
    tries: dict[int, list[Try]] = defaultdict(list)
    for attempt in attempts.prefetch_related(calls, "notes"):
        tries[attempt.augmentation_id].append(Try(attempt=attempt, steps=list(_steps(attempt))))
    return dict(tries)


def sum_totals(tries: list[Try]) -> Totals:
    """Return the sums over all attempts."""
    calls = _calls(tries)
    paid = [call for call in calls if call.sent_at is not None]
    answered = [call for call in paid if call.answer is not None]
    return Totals(
        calls=len(paid),
        calls_from_store=sum(call.is_cached for call in calls),
        prompt_tokens=_sum([call.prompt_tokens for call in answered], 0),
        completion_tokens=_sum([call.completion_tokens for call in answered], 0),
        spent_tokens=sum(call.spent_tokens or 0 for call in paid),
        cost_usd=_sum([call.cost_usd for call in paid], Decimal(0)),
        is_cost_estimated=any(call.is_cost_estimated for call in paid),
    )


def read_messages(request: dict[str, Any]) -> list[SaidMessage]:
    """Return the messages of a stored request."""
    return [_message(message) for message in request.get("messages", [])]


def images_in(request: dict[str, Any]) -> list[str]:
    """Return the SHA-256 of every image that a stored request refers to."""
    return [digest for message in read_messages(request) for digest in message.images]


def full_transcript(augmentation: Augmentation) -> dict[str, Any]:
    """Return the whole record with its images, ready for JSON."""
    record = make_record(augmentation, list_tries(augmentation))
    return record | {"images": {digest: _image(digest) for digest in record["images"]}}


def make_record(augmentation: Augmentation, tries: list[Try]) -> dict[str, Any]:
    """Return the record with the names of its images alone, from attempts that were read."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "augmentation": _columns(augmentation, _AUGMENTATION),
        "scenario": _columns(augmentation.scenario, ("slug", "type", "instruction")),
        "contestant": contestant_documents([augmentation.contestant])[0],
        "job": _columns(augmentation.job, ("code", "name", "is_fresh", "samples")),
        "totals": {name: _json(value) for name, value in asdict(sum_totals(tries)).items()},
        "attempts": [
            _columns(attempt_record.attempt, _ATTEMPT)
            | {"outcome": attempt_record.attempt.outcome or None}
            | {"steps": [_step(step) for step in attempt_record.steps]}
            for attempt_record in tries
        ],
        "images": sorted({name for call in _calls(tries) for name in images_in(call.request)}),
    }


def contestant_documents(contestants: Sequence[Contestant]) -> list[dict[str, Any]]:
    """Return contestants in full, ready for JSON: who each is, and how it asks."""
    endpoint = ("label", "base_url", "is_simulated")
    return [
        _columns(row, _CONTESTANT)
        | {
            "variant": row.variant or None,
            "model": row.model or None,
            "left_out": list_unsent_options(row),
            "endpoint": None if row.endpoint is None else _columns(row.endpoint, endpoint),
        }
        for row in contestants
    ]


# --- Private -----------------------------------------------------------------------------------


def _steps(attempt: Attempt) -> Iterator[TranscriptStep]:
    """Yield the calls, each followed by the notes that were made after it."""
    notes: dict[int, list[TranscriptStep]] = defaultdict(list)
    for note in attempt.notes.all():
        notes[note.after_call].append(TranscriptStep(note=note))
    yield from notes[0]
    for call in attempt.calls.all():
        yield TranscriptStep(call=call)
        yield from notes[call.number]


def _calls(tries: list[Try]) -> list[ModelCall]:
    return [
        step.call
        for attempt_record in tries
        for step in attempt_record.steps
        if step.call is not None
    ]


def _message(message: dict[str, Any]) -> SaidMessage:
    content = message.get("content")
    parts: list[dict[str, Any]] = [{"type": "text", "text": content or ""}]
    if isinstance(content, list):
        parts = content
    text = "\n".join(part["text"] for part in parts if part.get("type") == "text")
    urls = [part["image_url"]["url"] for part in parts if part.get("type") == "image_url"]
    rest = {name: value for name, value in message.items() if name not in ("role", "content")}
    return SaidMessage(
        role=str(message.get("role", "")),
        text=shorten(text, LONGEST_SHOWN),
        images=tuple(url.removeprefix(IMAGE_SCHEME) for url in urls),
        rest=shorten(_pretty(rest), LONGEST_SHOWN) if rest else "",
        length=len(text),
    )


def _step(step: TranscriptStep) -> dict[str, Any]:
    call = step.call
    if call is None:
        assert step.note is not None
        return _columns(step.note, ("kind", "document"))
    removed = {} if call.removed_at is None else {"removed_at": _json(call.removed_at)}
    return {
        "kind": "call",
        **_columns(call, _CALL),
        "served_from": None if call.served_from is None else str(call.served_from.code),
        "fault": call.fault or None,
        "model_returned": call.model_returned or None,
        "finish_reason": call.finish_reason or None,
        **removed,
    }


def _image(digest: str) -> str | None:
    """Return the stored image in base 64, None where the file is gone."""
    name = f"{IMAGES}/{digest}.png"
    if not default_storage.exists(name):
        return None
    with default_storage.open(name) as file:
        return base64.b64encode(file.read()).decode("ascii")


def _columns(row: models.Model, names: Sequence[str]) -> dict[str, Any]:
    return {name: _json(getattr(row, name)) for name in names}


def _json(value: Any) -> Any:
    """Return a value for JSON, keys sorted as PostgreSQL keeps an order of its own."""
    match value:
        case datetime():
            return value.isoformat()
        case Decimal():  # as text, because a JSON number would lose digits
            return f"{value.normalize():f}"
        case UUID():
            return str(value)
        case dict():
            return {name: _json(value[name]) for name in sorted(value)}
        case list():
            return [_json(item) for item in value]
    return value


def _sum(counts: Sequence[Any], zero: Any) -> Any:
    return None if None in counts else sum(counts, zero)


def _pretty(document: object) -> str:
    return json.dumps(document, indent=2, ensure_ascii=False)
