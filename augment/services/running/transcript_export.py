"""One JSON document with everything that led to an augmentation: see docs/using.md."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from datetime import datetime
from decimal import Decimal
from typing import Any

from django.core.files.storage import default_storage

from augment.models import Augmentation, Contestant, ModelCall
from augment.services.endpoints.treatments import left_out_of_each
from augment.services.running.calls import IMAGES
from augment.services.running.transcript_records import (
    TranscriptStep,
    Try,
    images_in,
    totals_of,
    tries_of,
)

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
