"""The two callers that the benchmark of calls compares."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal
from typing import Any

import openai
from django.core.management import call_command
from django.utils import timezone

from augment.llm.messages import Message, Request, Speaker
from augment.models import EndpointModel
from augment.services.endpoints.contestants import add_contestant
from augment.services.endpoints.known_endpoints import ensure_endpoint
from augment.services.running import jobs, runner
from augment.services.running.budget import Caps
from augment.services.running.calls import RowTranscript
from augment.services.running.runner import AUGMENTATIONS
from augment.variants.respondents import ModelRole, RespondentClient, Respondents
from tests.jobs.rows import add_scenario, only_row

Call = Callable[[int], object]


def bare_client(base_url: str, model: str) -> Call:
    """What the package needs by itself."""
    client = openai.OpenAI(api_key="none", base_url=base_url, max_retries=0)

    def call(number: int) -> object:
        document: dict[str, Any] = _request(model, f"bare {number}").to_document()
        return client.chat.completions.create(**document)

    return call


def conversation(base_url: str, model: str) -> Call:
    """What a worker does for a call in a job with a cap in USD, calls and tokens."""
    call_command("migrate", verbosity=0)
    endpoint = ensure_endpoint(label="bench", base_url=base_url, is_simulated=True)
    price = {"price_in_usd": "0.1", "price_out_usd": "0.5", "price_as_of": "2026-11-20"}
    EndpointModel.objects.update_or_create(
        endpoint=endpoint, model=model, defaults={**price, "price_source": "made up"}
    )
    add_contestant(slug="bench", variant="otm", endpoint="bench", model=model)
    add_scenario("bench")
    caps = Caps(usd=Decimal(1000), calls=10**6, tokens=10**12)
    job = jobs.launch(name="Bench", contestants=["bench"], scenarios=["bench"], caps=caps)
    row = only_row(job)
    held = AUGMENTATIONS.take(row.pk, now=timezone.now(), worker="bench")
    assert held is not None
    wire = runner.open_wire(endpoint, held).__enter__()
    talk = Respondents(
        clients={ModelRole.MODIFIER: RespondentClient(client=wire, model=model)},
        transcript=RowTranscript(held, row, endpoint),
    )

    def call(number: int) -> object:
        request = _request(model, f"ours {number}")
        return talk.send(ModelRole.MODIFIER, request, "bench")

    return call


def _request(model: str, name: str) -> Request:
    """About 24 kB of numbers, as a scene has them; no two requests are the same."""
    numbers = " ".join(f"({0.37 * step:.2f}, {-1.83 * step:.2f})" for step in range(1400))
    messages = (
        Message(speaker=Speaker.SYSTEM, text="You place agents in a scene."),
        Message(speaker=Speaker.USER, text=f"{name}: {numbers}"),
    )
    return Request(model=model, messages=messages)
