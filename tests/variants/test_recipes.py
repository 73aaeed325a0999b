import pytest

from augment.prompts.vectors import LaneFormat
from augment.variants.recipes import FC, PAPER, TQA, Keep, Recipe, Tools, find_recipe


@pytest.mark.parametrize("name", ["otm", "OTM", " Otm "])
def test_a_recipe_is_found_in_any_case(name: str) -> None:
    found = find_recipe(name)
    assert (found.lane_format, found.tools, found.review) == (
        LaneFormat.POLYLINE,
        Tools.NONE,
        None,
    )


def test_the_papers_four_are_its_table() -> None:
    assert [
        (one.slug, one.lane_format.value, one.review and one.review.name) for one in PAPER
    ] == [
        ("otm", "polyline", None),
        ("fc", "bezier", None),
        ("tqa", "polyline", "text"),
        ("vqa", "polyline", "visual"),
    ]
    assert [one.slug for one in PAPER if one.tools is Tools.POSE] == ["fc"]


def test_a_combination_has_the_parts_of_both() -> None:
    both = find_recipe("FC+tQA")
    assert (both.lane_format, both.tools) == (FC.lane_format, FC.tools)
    assert (both.review, both.keep) == (TQA.review, Keep.BEST)


def test_bezier_lanes_without_a_tool_are_refused() -> None:
    with pytest.raises(ValueError, match="come with the pose tool"):
        Recipe(slug="bare", title="Bare", lane_format=LaneFormat.BEZIER)
