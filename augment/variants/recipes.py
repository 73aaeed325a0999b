"""Variants as values: the paper's table of prompting strategies, and what it leaves room for.

Adding a variant is adding one value here. OTM, FC, tQA and vQA are the paper's. Their
combinations were not run there, and the geometric review is our own: it is named so and never
counted among the four.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum

from augment.errors import UnknownName
from augment.llm.messages import DEFAULT_MAX_TOKENS
from augment.prompts.vectors import DEFAULT_RADIUS_M, LaneFormat
from augment.render.camera import WIDTH_PX
from augment.variants.pose_call import CallLimits

__all__ = [
    "FC",
    "GEO",
    "OTM",
    "PAPER",
    "RECIPES",
    "SPELLING",
    "TQA",
    "VQA",
    "Keep",
    "LaneFormat",
    "Limits",
    "Recipe",
    "Review",
    "Tools",
    "find_recipe",
    "spell_variant",
]

SPELLING = {"otm": "OTM", "fc": "FC", "tqa": "tQA", "vqa": "vQA", "geo": "geo"}
"""The variants as the paper spells and orders them, then ours."""


class Tools(StrEnum):
    """Which functions the modifier may call."""

    NONE = "none"
    POSE = "pose"


class Review(StrEnum):
    """Who looks at the result before it counts."""

    NONE = "none"
    TEXT = "text"
    VISUAL = "visual"
    GEOMETRIC = "geometric"


class Keep(StrEnum):
    """Which round's modification counts: the best reviewed (of equals the last), or the last.

    A review that is content ends the rounds, so the last is the accepted one if there is one.
    """

    BEST = "best"
    LAST = "last"


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What one run of a recipe may use.

    Attributes:
        radius_m: How far around the ego the scene is written down.
        max_tokens: The length limit of one answer; a cut-off answer is asked again with twice it.
        re_asks: How often an answer that can't be read is asked for again.
        regenerations: How often a review can send the modifier back to work.
        calls: Of tools, in one round.
        accepted_from: The mean rating from which a text review is content.
        picture_px: The width of the picture that a viewer is shown.
    """

    radius_m: float = DEFAULT_RADIUS_M
    max_tokens: int = DEFAULT_MAX_TOKENS
    re_asks: int = 1
    regenerations: int = 2
    calls: CallLimits = field(default_factory=CallLimits)
    accepted_from: float = 4.0
    picture_px: int = WIDTH_PX


@dataclass(frozen=True, slots=True, kw_only=True)
class Recipe:
    """One variant: lane format x tools x review.

    Raises:
        ValueError: Bezier lanes without a tool: nobody should have to walk along control points.
    """

    slug: str
    title: str
    lane_format: LaneFormat = LaneFormat.POLYLINE
    tools: Tools = Tools.NONE
    review: Review = Review.NONE
    keep: Keep = Keep.LAST
    limits: Limits = Limits()

    def __post_init__(self) -> None:
        if self.lane_format is LaneFormat.BEZIER and self.tools is Tools.NONE:
            raise ValueError(f"{self.slug}: Bezier lanes come with the pose tool")


OTM = Recipe(slug="otm", title="One-time modifier")
FC = Recipe(slug="fc", title="Function calling", lane_format=LaneFormat.BEZIER, tools=Tools.POSE)
TQA = Recipe(slug="tqa", title="Text QA", review=Review.TEXT, keep=Keep.BEST)
VQA = Recipe(slug="vqa", title="Visual QA", review=Review.VISUAL)
GEO = Recipe(slug="geo", title="Geometric review (ours)", review=Review.GEOMETRIC, keep=Keep.BEST)

PAPER: tuple[Recipe, ...] = (OTM, FC, TQA, VQA)


def _with_calls(reviewed: Recipe) -> Recipe:
    """Function calling with that review on top."""
    return replace(
        FC,
        slug=f"fc+{reviewed.slug}",
        title=f"Function calling + {reviewed.title[0].lower()}{reviewed.title[1:]}",
        review=reviewed.review,
        keep=reviewed.keep,
    )


RECIPES: dict[str, Recipe] = {
    recipe.slug: recipe
    for recipe in (*PAPER, GEO, _with_calls(TQA), _with_calls(VQA), _with_calls(GEO))
}


def find_recipe(name: str) -> Recipe:
    """The recipe of that name, in any case ("OTM", "otm").

    Raises:
        UnknownName: There is none; the sentence lists those there are.
    """
    try:
        return RECIPES[name.strip().lower()]
    except KeyError:
        raise UnknownName("variant", name, sorted(RECIPES)) from None


def spell_variant(slug: str) -> str:
    """A variant as people read it: "fc+tqa" is FC+tQA; one that is none of ours stays as it is."""
    return "+".join(SPELLING.get(part, part) for part in slug.lower().split("+"))
