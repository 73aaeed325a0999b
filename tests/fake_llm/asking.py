"""Asking the stand-in the way the house does: through the wire, along a recipe."""

from __future__ import annotations

import random

from augment.fake_llm.server import FakeServer
from augment.llm.client import Patience
from augment.llm.openai_wire import OpenAIWire
from augment.scene.entities import Scene
from augment.variants.pipeline import Outcome, run
from augment.variants.recipes import find_recipe
from augment.variants.respondents import MemoryTranscript, RespondentClient


def outcome(
    server: FakeServer,
    model: str,
    scene: Scene,
    instruction: str,
    *,
    transcript: MemoryTranscript | None = None,
    key: str | None = None,
    timeout_s: float = 60.0,
) -> Outcome:
    with OpenAIWire(base_url=server.url, api_key=key, timeout_s=timeout_s) as client:
        return run(
            find_recipe("otm"),
            scene=scene,
            instruction=instruction,
            modifier=RespondentClient(client=client, model=model),
            transcript=transcript or MemoryTranscript(),
            patience=Patience(sleep=lambda _: None, rng=random.Random(0)),
        )
