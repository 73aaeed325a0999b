"""What the rule placer makes of a sentence, for its tests."""

from __future__ import annotations

import pytest

from augment.baselines.rule_placer import place
from augment.errors import InstructionNotUnderstood
from augment.scene.entities import Scene, TrafficAgent
from augment.scene.modification import apply

PARKED = "add a parked car 21.4 m ahead of the ego"


def added(shown: Scene, text: str, *, seed: int = 0) -> tuple[TrafficAgent, ...]:
    modification = place(shown, text, seed=seed).modification
    apply(shown, modification)  # raises where the ids don't fit
    return modification.added


def refusal(shown: Scene, text: str) -> str:
    with pytest.raises(InstructionNotUnderstood) as refused:
        place(shown, text)
    assert refused.value.understood
    return refused.value.reason
