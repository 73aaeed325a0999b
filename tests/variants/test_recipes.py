import pytest

from augment.prompts.vectors import LaneFormat
from augment.variants.recipes import FC, TQA, Keep, Recipe, Tools, find_recipe


@pytest.mark.parametrize("name", ["otm", "OTM", " Otm "])
def test_a_recipe_is_found_in_any_case(name: str) -> None:
    found = find_recipe(name)
    assert (found.lane_format, found.tools, found.review) == (
        LaneFormat.POLYLINE,
        Tools.NONE,
        None,
    )


def test_a_combination_has_the_parts_of_both() -> None:
    both = find_recipe("FC+tQA")
    assert (both.lane_format, both.tools) == (FC.lane_format, FC.tools)
    assert (both.review, both.keep) == (TQA.review, Keep.BEST)


def test_bezier_lanes_without_a_tool_are_refused() -> None:
    with pytest.raises(ValueError, match="come with the pose tool"):
        Recipe(slug="bare", title="Bare", lane_format=LaneFormat.BEZIER)
