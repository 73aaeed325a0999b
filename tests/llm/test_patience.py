from __future__ import annotations

import random

import pytest

from augment.errors import ModelFault
from augment.llm.client import Patience


def fault(*, retryable: bool = True, retry_after_s: float | None = None) -> ModelFault:
    return ModelFault("broken", retryable=retryable, retry_after_s=retry_after_s)


def patience(**changes: float) -> Patience:
    return Patience(rng=random.Random(1), **changes)  # type: ignore[arg-type]


def test_the_wait_doubles_within_its_jitter_and_its_bound() -> None:
    patient = patience(attempts=9, first_wait_s=1.0, longest_wait_s=5.0)
    for attempt, full_s in [(1, 1.0), (2, 2.0), (3, 4.0), (4, 5.0), (5, 5.0)]:
        wait_s = patient.wait_s(fault(), attempt=attempt)
        assert wait_s is not None
        assert full_s / 2.0 <= wait_s <= full_s


def test_what_the_endpoint_asked_for_is_not_undercut() -> None:
    assert patience().wait_s(fault(retry_after_s=12.0), attempt=1) == 12.0


@pytest.mark.parametrize("asked_s", [30.1, 600.0, float("inf")])
def test_who_asks_for_too_long_a_wait_is_left_for_later(asked_s: float) -> None:
    assert patience().wait_s(fault(retry_after_s=asked_s), attempt=1) is None
