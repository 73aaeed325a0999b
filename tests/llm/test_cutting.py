from __future__ import annotations

import pytest

from augment.llm.cutting import shorten


@pytest.mark.parametrize("length", [0, 39, 40])
def test_a_text_that_fits_stays_as_it_is(length: int) -> None:
    assert shorten("x" * length, 40) == "x" * length


@pytest.mark.parametrize("length", [41, 1000, 10_000_000])
def test_a_text_that_is_too_long_says_how_long_it_was(length: int) -> None:
    shown = shorten("x" * length, 40)
    assert len(shown) == 40
    assert shown.startswith("xx")
    assert shown.endswith(f"x… [cut: {length} characters]")


def test_there_has_to_be_room_for_the_mark() -> None:
    mark = "… [cut: 100 characters]"
    with pytest.raises(ValueError, match="leave no room"):
        shorten("x" * 100, len(mark))
    assert shorten("x" * 100, len(mark) + 1) == f"x{mark}"
