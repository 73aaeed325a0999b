"""What the rule placer makes of an intent, for its tests."""

from __future__ import annotations

import pytest

from augment.baselines.rule_placer import place
from augment.errors import CannotPlace
from augment.scene.entities import Scene, TrafficAgent, apply
from augment.scene.intent import Intent


def added(shown: Scene, intent: Intent, *, seed: int = 0) -> tuple[TrafficAgent, ...]:
    modification = place(shown, intent, seed=seed).modification
    apply(shown, modification)  # raises where the ids don't fit
    return modification.added


def refusal(shown: Scene, intent: Intent) -> str:
    with pytest.raises(CannotPlace) as refused:
        place(shown, intent)
    return refused.value.reason
