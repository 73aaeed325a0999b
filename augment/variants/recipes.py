"""Variants as values: the paper's table of prompting strategies.

Adding a variant is adding one value here. RECIPES holds what the pipeline can run today.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from augment.errors import UnknownName
from augment.llm.messages import DEFAULT_MAX_TOKENS


class LaneFormat(StrEnum):
    """How a lane is written down: points every 5 m, or four control points of a cubic Bezier."""

    POLYLINE = "polyline"
    BEZIER = "bezier"


class Tools(StrEnum):
    """Which functions the modifier may call."""

    NONE = "none"
    POSE = "pose"


class Review(StrEnum):
    """Who looks at the result before it counts."""

    NONE = "none"
    TEXT = "text"
    VISUAL = "visual"


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What one run of a recipe may use.

    Attributes:
        radius_m: How far around the ego the scene is written down.
        max_tokens: The length limit of one answer; a cut-off answer is asked again with twice it.
        re_asks: How often an answer that can't be read is asked for again.
    """

    radius_m: float = 80.0
    max_tokens: int = DEFAULT_MAX_TOKENS
    re_asks: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Recipe:
    """One variant: lane format x tools x review."""

    slug: str
    title: str
    lane_format: LaneFormat
    tools: Tools
    review: Review
    limits: Limits = Limits()


OTM = Recipe(
    slug="otm",
    title="One-time modifier",
    lane_format=LaneFormat.POLYLINE,
    tools=Tools.NONE,
    review=Review.NONE,
)

RECIPES: dict[str, Recipe] = {recipe.slug: recipe for recipe in (OTM,)}


def recipe(name: str) -> Recipe:
    """The recipe of that name, in any case ("OTM", "otm").

    Raises:
        UnknownName: There is none; the sentence lists those there are.
    """
    try:
        return RECIPES[name.strip().lower()]
    except KeyError:
        raise UnknownName("variant", name, sorted(RECIPES)) from None
