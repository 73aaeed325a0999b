from __future__ import annotations

import pytest

from augment.llm.messages import shorten


@pytest.mark.parametrize("length", [0, 39, 40])
def test_a_text_that_fits_stays_as_it_is(length: int) -> None:
    assert shorten("x" * length, 40) == "x" * length


@pytest.mark.parametrize("length", [41, 1000, 10_000_000])
def test_a_text_that_is_too_long_says_how_long_it_was(length: int) -> None:
    shown = shorten("x" * length, 40)
    assert len(shown) == 40
    assert shown.startswith("xx")
    assert shown.endswith(f"x… [cut: {length} characters]")
