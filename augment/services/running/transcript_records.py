"""Where a call was other than its contestant's options say, because of its endpoint or model.

In: a stored request and what it was made with. Out: a sentence for each change, for transcripts.
"""

from __future__ import annotations

import base64
import json
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from decimal import Decimal
from textwrap import indent
from typing import Any

from django.core.files.storage import default_storage
from django.db.models import Prefetch, QuerySet

from augment.llm.cutting import shorten
from augment.llm.fingerprint import IMAGE_SCHEME
from augment.models import Attempt, Augmentation, Contestant, ModelCall, TranscriptNote
from augment.services.endpoints.treatments import left_out_of_each
from augment.services.running.calls import IMAGES
from augment.variants.options import ToolProtocol
from augment.variants.transcript import ModelRole, NoteKind

_OLD_NAME, _NEW_NAME = "max_tokens", "max_completion_tokens"
_SENT = ("temperature", "seed", "reasoning_effort")


def changes_of(
    call: ModelCall,
    *,
    options: Mapping[str, Any] | None,
    before: ModelCall | None,
    notes: Sequence[TranscriptNote],
) -> tuple[str, ...]:
    """What of a call was not as chosen.

    Args:
        call: Which one.
        options: With which its augmentation was made; None where that is not known.
        before: The call before it in its attempt.
        notes: What happened after it and before the next one.
    """
    return (
        *_refused(call, before),
        *_not_sent(call.request, options or {}),
        *_of_length(call.request, options or {}),
        *_of_protocol(call, options or {}, notes),
        *_of_model(call),
    )


# --- Private -----------------------------------------------------------------------------------


def _refused(call: ModelCall, before: ModelCall | None) -> list[str]:
    """What the same request had before it was refused."""
    if before is None or before.role != call.role or not before.fault or before.answer is not None:
        return []
    if before.request.get("messages") != call.request.get("messages"):
        return []
    gone = [name for name in before.request if name not in call.request]
    return [f"Sent again without {name}, which the endpoint refused." for name in gone]


def _not_sent(request: Mapping[str, Any], options: Mapping[str, Any]) -> list[str]:
    found = [
        (
            f"{name} was to be {_written(options[name])} and is not sent: the model does not "
            "take it."
        )
        for name in _SENT
        if name in options and name not in request
    ]
    effort = request.get("reasoning_effort")
    if effort is not None and "reasoning_effort" not in options:
        found.append(
            f"reasoning_effort {effort} is sent because it is entered for the model, "
            "not because it was chosen."
        )
    return found


def _of_length(request: Mapping[str, Any], options: Mapping[str, Any]) -> list[str]:
    found = []
    if _OLD_NAME in request:
        found.append(
            f"The limit of the answer is sent as {_OLD_NAME}: the endpoint refused {_NEW_NAME}."
        )
    wanted, sent = options.get("max_output_tokens"), request.get(_NEW_NAME, request.get(_OLD_NAME))
    if wanted is not None and sent is not None and sent < wanted:
        found.append(
            f"An answer may have {int(sent)} tokens, not {int(wanted)}: more the model does "
            "not give."
        )
    return found


def _of_protocol(
    call: ModelCall, options: Mapping[str, Any], notes: Sequence[TranscriptNote]
) -> list[str]:
    if call.role != ModelRole.MODIFIER:
        return []
    is_offered = bool(call.request.get("tools"))
    if options.get("protocol") == ToolProtocol.NATIVE and not is_offered:
        return ["The function was to be called natively and was not offered so."]
    has_called = any(note.kind == NoteKind.TOOL_CALL for note in notes)
    if is_offered and has_called and not (call.extras or {}).get("tool_calls"):
        return [
            ("The function was offered natively, and the model wrote its call into the answer.")
        ]
    return []


def _of_model(call: ModelCall) -> list[str]:
    asked, answered = str(call.request.get("model", "")), call.model_returned
    if not answered or asked.lower() in answered.lower() or answered.lower() in asked.lower():
        return []
    return [f"{asked} was asked and the endpoint says that {answered} answered."]


def _written(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


LONGEST_SHOWN = 100_000
"""Of one text of a record on a page, in characters; the document has all of it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SaidMessage:
    """One message of a request, to be read.

    Attributes:
        images: SHA-256 of each.
        rest: Whatever else it carries (calls of tools, the id of one), as JSON; empty mostly.
        length: Of the whole text, in characters.
    """

    role: str
    text: str
    images: tuple[str, ...]
    rest: str
    length: int


@dataclass(frozen=True, slots=True, kw_only=True)
class TranscriptStep:
    """A call or, where that is None, a note.

    Attributes:
        changes: Of a call: where it was other than chosen because of its endpoint or model.
    """

    call: ModelCall | None = None
    note: TranscriptNote | None = None
    changes: tuple[str, ...] = ()

    @property
    def messages(self) -> list[SaidMessage]:
        """What was asked, oldest first."""
        return [] if self.call is None else messages_of(self.call.request)

    @property
    def parameters(self) -> dict[str, Any]:
        """What was asked for beside the messages."""
        asked = {} if self.call is None else self.call.request
        return {name: value for name, value in asked.items() if name not in ("messages", "model")}

    @property
    def answer_text(self) -> str | None:
        """The answer as a page shows it, None where there is none."""
        if self.call is None or self.call.answer is None:
            return None
        return shorten(self.call.answer, LONGEST_SHOWN)

    @property
    def extras_text(self) -> str:
        """What else the answer carried, such as native calls of tools."""
        shown = _pretty(self.call.extras) if self.call and self.call.extras else ""
        return shorten(shown, LONGEST_SHOWN)

    @property
    def note_text(self) -> str:
        """The note's document, to be read: a line for each part, texts as they are."""
        if self.note is None:
            return ""
        lines = (_line(name, part) for name, part in self.note.document.items())
        return shorten("\n".join(lines), LONGEST_SHOWN)


@dataclass(frozen=True, slots=True, kw_only=True)
class Try:
    """One attempt with its steps."""

    attempt: Attempt
    steps: list[TranscriptStep]


@dataclass(frozen=True, slots=True, kw_only=True)
class Totals:
    """What all calls of an augmentation used; None where that is not known of every one.

    Attributes:
        calls: Those that were sent.
        cached: Those that were answered from the store and cost nothing.
        spent_tokens: What counts against caps: the worst case where usage is unknown.
    """

    calls: int
    cached: int
    prompt_tokens: int | None
    completion_tokens: int | None
    spent_tokens: int
    cost_usd: Decimal | None
    is_cost_estimated: bool


def tries_of(augmentation: Augmentation) -> list[Try]:
    """Every attempt, the first one first; four queries."""
    return tries_by_augmentation([augmentation.pk]).get(augmentation.pk, [])


def tries_by_augmentation(augmentations: Collection[int]) -> dict[int, list[Try]]:
    """The attempts of several by the primary key; four queries. Who has none has no entry."""
    calls = Prefetch(
        "calls", ModelCall.objects.select_related("served_from__attempt__augmentation")
    )
    rows = Augmentation.objects.filter(pk__in=augmentations)
    options = dict(rows.values_list("pk", "options"))
    attempts = Attempt.objects.filter(augmentation__in=augmentations)
    found: dict[int, list[Try]] = defaultdict(list)
    for attempt in attempts.prefetch_related(calls, "notes"):
        steps = list(_steps(attempt, options[attempt.augmentation_id]))
        found[attempt.augmentation_id].append(Try(attempt=attempt, steps=steps))
    return dict(found)


def totals_of(tries: list[Try]) -> Totals:
    """The sums over all attempts."""
    calls = [step.call for one in tries for step in one.steps if step.call is not None]
    paid = [call for call in calls if call.sent_at is not None]
    answered = [call for call in paid if call.answer is not None]
    costs = [call.cost_usd for call in paid]
    known = [cost for cost in costs if cost is not None]
    return Totals(
        calls=len(paid),
        cached=sum(call.is_cached for call in calls),
        prompt_tokens=_sum([call.prompt_tokens for call in answered]),
        completion_tokens=_sum([call.completion_tokens for call in answered]),
        spent_tokens=sum(call.spent_tokens or 0 for call in paid),
        cost_usd=sum(known, Decimal(0)) if len(known) == len(costs) else None,
        is_cost_estimated=any(call.is_cost_estimated for call in paid),
    )


def messages_of(request: dict[str, Any]) -> list[SaidMessage]:
    """The messages of a stored request."""
    return [_message(message) for message in request.get("messages", [])]


def images_in(request: dict[str, Any]) -> list[str]:
    """The SHA-256 of every image that a stored request refers to."""
    return [digest for message in messages_of(request) for digest in message.images]


# --- Private -----------------------------------------------------------------------------------


def _steps(attempt: Attempt, options: dict[str, Any] | None) -> Iterator[TranscriptStep]:
    """Each note behind the call after which it was made."""
    notes = list(attempt.notes.all())
    yield from (TranscriptStep(note=note) for note in notes if note.after_call == 0)
    before: ModelCall | None = None
    for call in attempt.calls.all():
        after = [note for note in notes if note.after_call == call.number]
        changes = changes_of(call, options=options, before=before, notes=after)
        yield TranscriptStep(call=call, changes=changes)
        yield from (TranscriptStep(note=note) for note in after)
        before = call


def _message(message: dict[str, Any]) -> SaidMessage:
    content = message.get("content")
    parts: list[dict[str, Any]] = [{"type": "text", "text": content or ""}]
    if isinstance(content, list):
        parts = content
    texts = [part["text"] for part in parts if part.get("type") == "text"]
    urls = [part["image_url"]["url"] for part in parts if part.get("type") == "image_url"]
    rest = {name: value for name, value in message.items() if name not in ("role", "content")}
    text = "\n".join(texts)
    return SaidMessage(
        role=str(message.get("role", "")),
        text=shorten(text, LONGEST_SHOWN),
        images=tuple(url.removeprefix(IMAGE_SCHEME) for url in urls),
        rest=shorten(_pretty(rest), LONGEST_SHOWN) if rest else "",
        length=len(text),
    )


def _sum(counts: list[int | None]) -> int | None:
    known = [count for count in counts if count is not None]
    return sum(known) if len(known) == len(counts) else None


def _line(name: str, part: object) -> str:
    text = part if isinstance(part, str) else _pretty(part)
    return f"{name}:\n{indent(text, '  ')}" if "\n" in text else f"{name}: {text}"


def _pretty(document: object) -> str:
    return json.dumps(document, indent=2, ensure_ascii=False)


FORMAT, VERSION = "scenario-arena/transcript", 3


def transcript_of(augmentation: Augmentation) -> dict[str, Any]:
    """The whole record with its images, ready for JSON. Unknown is null, never zero."""
    record = record_of(augmentation, tries_of(augmentation))
    return record | {"images": {digest: _image(digest) for digest in record["images"]}}


def record_of(augmentation: Augmentation, tries: list[Try]) -> dict[str, Any]:
    """The same with the images' names alone, from attempts that are read already."""
    scenario, job = augmentation.scenario, augmentation.job
    return {
        "format": FORMAT,
        "version": VERSION,
        "augmentation": {
            "code": str(augmentation.code),
            "sample": augmentation.sample,
            "options": _same_order(augmentation.options),
            "state": augmentation.state,
            "reason": augmentation.reason,
            "notes": augmentation.notes,
            "modification": _same_order(augmentation.modification),
            "injected": _same_order(augmentation.injected),
            "created_at": _time(augmentation.created_at),
            "finished_at": _time(augmentation.finished_at),
        },
        "scenario": {
            "slug": scenario.slug,
            "type": scenario.type,
            "instruction": scenario.instruction,
        },
        "contestant": contestant_document(augmentation.contestant),
        "job": {
            "code": str(job.code),
            "name": job.name,
            "is_fresh": job.is_fresh,
            "samples": job.samples,
        },
        "totals": _totals(tries),
        "attempts": [_attempt(one) for one in tries],
        "images": _images(tries),
    }


def contestant_document(contestant: Contestant) -> dict[str, Any]:
    """A contestant in full, ready for JSON: who it is, and how it asks."""
    return contestant_documents([contestant])[0]


def contestant_documents(contestants: Sequence[Contestant]) -> list[dict[str, Any]]:
    """The same of several, with as many queries as for one."""
    omitted = left_out_of_each(contestants)
    return [_contestant(row, omitted[row.pk]) for row in contestants]


# --- Private -----------------------------------------------------------------------------------


def _contestant(contestant: Contestant, omitted: dict[str, list[str]]) -> dict[str, Any]:
    endpoint = contestant.endpoint
    return {
        "slug": contestant.slug,
        "name": contestant.name,
        "kind": contestant.kind,
        "variant": contestant.variant or None,
        "model": contestant.model or None,
        "roles": _same_order(contestant.roles),
        "options": _same_order(contestant.options),
        "frozen_options": _same_order(contestant.frozen_options),
        "left_out": omitted,
        "sends": _same_order(contestant.sends),
        "endpoint": None
        if endpoint is None
        else {
            "label": endpoint.label,
            "base_url": endpoint.base_url,
            "is_simulated": endpoint.is_simulated,
        },
    }


def _totals(tries: list[Try]) -> dict[str, Any]:
    totals = totals_of(tries)
    return {
        "calls": totals.calls,
        "calls_from_store": totals.cached,
        "prompt_tokens": totals.prompt_tokens,
        "completion_tokens": totals.completion_tokens,
        "spent_tokens": totals.spent_tokens,
        "cost_usd": _money(totals.cost_usd),
        "is_cost_estimated": totals.is_cost_estimated,
    }


def _attempt(one: Try) -> dict[str, Any]:
    attempt = one.attempt
    return {
        "number": attempt.number,
        "worker": attempt.worker,
        "started_at": _time(attempt.started_at),
        "finished_at": _time(attempt.finished_at),
        "outcome": attempt.outcome or None,
        "reason": attempt.reason,
        "steps": [_step(step) for step in one.steps],
    }


def _step(step: TranscriptStep) -> dict[str, Any]:
    if step.call is not None:
        return _call(step.call) | {"changes": [str(one) for one in step.changes]}
    assert step.note is not None
    return {"kind": step.note.kind, "document": _same_order(step.note.document)}


def _call(call: ModelCall) -> dict[str, Any]:
    source = call.served_from
    return {
        "kind": "call",
        "code": str(call.code),
        "number": call.number,
        "role": call.role,
        "prompt_version": call.prompt_version,
        "request": _same_order(call.request),
        "request_hash": call.request_hash,
        "served_from": None if source is None else str(source.code),
        "answer": call.answer,
        "refusal": call.refusal,
        "extras": _same_order(call.extras),
        "fault": call.fault or None,
        "model_returned": call.model_returned or None,
        "finish_reason": call.finish_reason or None,
        "prompt_tokens": call.prompt_tokens,
        "completion_tokens": call.completion_tokens,
        "spent_tokens": call.spent_tokens,
        "cost_usd": _money(call.cost_usd),
        "is_cost_estimated": call.is_cost_estimated,
        "started_at": _time(call.started_at),
        "sent_at": _time(call.sent_at),
        "latency_s": call.latency_s,
        **({} if call.removed_at is None else {"removed_at": _time(call.removed_at)}),
    }


def _images(tries: list[Try]) -> list[str]:
    """The SHA-256 of every image that a request refers to."""
    calls = [step.call for one in tries for step in one.steps if step.call is not None]
    return sorted({digest for call in calls for digest in images_in(call.request)})


def _image(digest: str) -> str | None:
    """What is stored under that name; None where the file is gone."""
    name = f"{IMAGES}/{digest}.png"
    if not default_storage.exists(name):
        return None
    with default_storage.open(name) as file:
        return base64.b64encode(file.read()).decode("ascii")


def _same_order(stored: Any) -> Any:
    """A stored document with sorted keys: PostgreSQL keeps them in an order of its own."""
    if isinstance(stored, dict):
        return {name: _same_order(stored[name]) for name in sorted(stored)}
    if isinstance(stored, list):
        return [_same_order(one) for one in stored]
    return stored


def _time(at: datetime | None) -> str | None:
    return None if at is None else at.isoformat()


def _money(amount: Decimal | None) -> str | None:
    """As text, because a JSON number would lose digits."""
    return None if amount is None else f"{amount.normalize():f}"


AT_ONCE = 200


def images_named_by(keys: Sequence[int]) -> set[str]:
    """The SHA-256 of every image that the viewers of these calls were shown."""
    found: set[str] = set()
    for start in range(0, len(keys), AT_ONCE):
        for request in _viewed().filter(pk__in=keys[start : start + AT_ONCE]):
            found.update(images_in(request))
    return found


def delete_unnamed(images: set[str]) -> None:
    """Delete those of these images that no call names any more."""
    unnamed = set(images)
    for request in _viewed().iterator() if unnamed else ():
        unnamed.difference_update(images_in(request))
    for digest in sorted(unnamed):
        default_storage.delete(f"{IMAGES}/{digest}.png")


def _viewed() -> QuerySet[ModelCall, dict[str, object]]:
    """Requests of viewers whose messages are there."""
    rows = ModelCall.objects.filter(role=ModelRole.VIEWER, removed_at__isnull=True)
    return rows.values_list("request", flat=True)
