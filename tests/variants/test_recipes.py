import pytest

from augment.prompts.calls import Tools
from augment.prompts.vectors import LaneFormat
from augment.variants.recipes import FC, FC_PLUS, TQA, Recipe, find_recipe, spell_variant


@pytest.mark.parametrize("name", ["otm", "OTM", " Otm "])
def test_a_recipe_is_found_in_any_case(name: str) -> None:
    found = find_recipe(name)
    parts = (found.lane_format, found.tools, found.review)
    assert parts == (LaneFormat.POLYLINE, Tools.NONE, None)


@pytest.mark.parametrize(
    ("name", "calling", "tools"),
    [("FC+tQA", FC, Tools.RETRIEVE), ("FC-plus+tQA", FC_PLUS, Tools.POSE_ON_LANE)],
)
def test_a_combination_has_the_parts_of_both(name: str, calling: Recipe, tools: Tools) -> None:
    both = find_recipe(name)
    assert (both.lane_format, both.tools) == (calling.lane_format, tools)
    assert both.review is TQA.review
    assert (calling.tools, spell_variant(both.slug)) == (tools, name)
