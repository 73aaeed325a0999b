"""Numbering codes anew is what np.unique gives, whichever way it is done."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arena.rating.comparisons import renumber_codes


@given(st.lists(st.integers(0, 50)))
def test_codes_close_together_are_numbered_in_their_order(codes: list[int]) -> None:
    different, places = renumber_codes(np.array(codes, dtype=np.int64))
    assert different.tolist() == sorted(set(codes))
    assert different[places].tolist() == codes


@pytest.mark.parametrize("furthest", [10_000, 2**62])
def test_codes_far_apart_are_numbered_without_a_place_for_each(furthest: int) -> None:
    different, places = renumber_codes(np.array([furthest, 3, furthest, 0]))
    assert different.tolist() == [0, 3, furthest]
    assert places.tolist() == [2, 1, 2, 0]
