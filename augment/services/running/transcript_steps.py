"""The record of an augmentation as steps in their order: calls, and what happened between them."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from decimal import Decimal
from textwrap import indent
from typing import Any

from django.db.models import Prefetch

from augment.llm.cutting import shorten
from augment.llm.fingerprint import IMAGE_SCHEME
from augment.models import Attempt, Augmentation, ModelCall, TranscriptNote
from augment.services.running.transcript_records import changes_of

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
