from __future__ import annotations

import pytest

from augment.errors import UnknownName
from augment.variants.recipes import LaneFormat, Review, Tools, recipe


@pytest.mark.parametrize("name", ["otm", "OTM", " Otm "])
def test_a_recipe_is_found_in_any_case(name: str) -> None:
    found = recipe(name)
    assert (found.lane_format, found.tools, found.review) == (
        LaneFormat.POLYLINE,
        Tools.NONE,
        Review.NONE,
    )


def test_an_unknown_recipe_is_refused_with_those_there_are() -> None:
    with pytest.raises(UnknownName, match=r"Unknown variant 'zero-shot'\. Known: otm\."):
        recipe("zero-shot")
