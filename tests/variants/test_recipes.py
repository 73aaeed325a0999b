from __future__ import annotations

import pytest

from augment.errors import UnknownName
from augment.variants.recipes import (
    FC,
    PAPER,
    RECIPES,
    TQA,
    Keep,
    LaneFormat,
    Recipe,
    Review,
    Tools,
    find_recipe,
)


@pytest.mark.parametrize("name", ["otm", "OTM", " Otm "])
def test_a_recipe_is_found_in_any_case(name: str) -> None:
    found = find_recipe(name)
    assert (found.lane_format, found.tools, found.review) == (
        LaneFormat.POLYLINE,
        Tools.NONE,
        Review.NONE,
    )


def test_an_unknown_recipe_is_refused_with_those_there_are() -> None:
    known = r"fc, fc\+geo, fc\+tqa, fc\+vqa, geo, otm, tqa, vqa\."
    with pytest.raises(UnknownName, match=rf"Unknown variant 'zero-shot'\. Known: {known}"):
        find_recipe("zero-shot")


def test_the_papers_four_are_its_table() -> None:
    assert [(one.slug, one.lane_format.value, one.review.value) for one in PAPER] == [
        ("otm", "polyline", "none"),
        ("fc", "bezier", "none"),
        ("tqa", "polyline", "text"),
        ("vqa", "polyline", "visual"),
    ]
    assert [one.slug for one in PAPER if one.tools is Tools.POSE] == ["fc"]


def test_our_own_review_is_named_ours_and_is_not_among_the_four() -> None:
    ours = [one for one in RECIPES.values() if one.review is Review.GEOMETRIC]
    assert {one.slug for one in ours} == {"geo", "fc+geo"}
    assert all("ours" in one.title for one in ours)
    assert not set(ours) & set(PAPER)


def test_a_combination_has_the_parts_of_both() -> None:
    both = find_recipe("FC+tQA")
    assert (both.lane_format, both.tools) == (FC.lane_format, FC.tools)
    assert (both.review, both.keep) == (TQA.review, Keep.BEST)


def test_bezier_lanes_without_a_tool_are_refused() -> None:
    with pytest.raises(ValueError, match="come with the pose tool"):
        Recipe(slug="bare", title="Bare", lane_format=LaneFormat.BEZIER)
