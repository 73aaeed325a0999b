"""Variants as values: the paper's table of prompting strategies, and what it leaves room for.

Adding a variant is adding one value here. OTM, FC, tQA and vQA are the paper's. Their
combinations were not run there; FC-plus, whose function tells more, and the geometric review are
our own: they are named so and never counted among the four.
"""

from dataclasses import dataclass, field, replace

from augment.errors import UnknownName
from augment.prompts.calls import Tools
from augment.prompts.vectors import LaneFormat
from augment.variants.respondents import ModelRole
from augment.variants.reviews import GEOMETRIC_REVIEW, TEXT_REVIEW, VISUAL_REVIEW, Limits, Review

SPELLING = {
    **{"otm": "OTM", "fc": "FC", "tqa": "tQA", "vqa": "vQA"},
    **{"fc-plus": "FC-plus", "geo": "geo"},
}
"""The variants as the paper spells and orders them, then ours."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Recipe:
    """One variant: lane format x tools x review.

    Bezier lanes come with a tool: nobody should have to walk along control points.
    """

    slug: str
    title: str
    lane_format: LaneFormat = LaneFormat.POLYLINE
    tools: Tools = Tools.NONE
    review: Review | None = None
    limits: Limits = field(default_factory=Limits)

    @property
    def roles(self) -> tuple[ModelRole, ...]:
        """The roles that language models play in it."""
        roles_asked = self.review.asks if self.review else ()
        return tuple(dict.fromkeys((ModelRole.MODIFIER, *roles_asked)))

    @property
    def rounds(self) -> int:
        """Largest number of rounds."""
        return 1 if self.review is None else self.limits.rounds


OTM = Recipe(slug="otm", title="One-time modifier")
FC = Recipe(
    slug="fc", title="Function calling", lane_format=LaneFormat.BEZIER, tools=Tools.RETRIEVE
)
FC_PLUS = replace(
    FC, slug="fc-plus", title="Function calling, our function", tools=Tools.POSE_ON_LANE
)
TQA = Recipe(slug="tqa", title="Text QA", review=TEXT_REVIEW)
VQA = Recipe(slug="vqa", title="Visual QA", review=VISUAL_REVIEW)
GEO = Recipe(slug="geo", title="Geometric review (ours)", review=GEOMETRIC_REVIEW)

PAPER: tuple[Recipe, ...] = (OTM, FC, TQA, VQA)
_WITH_CALLS = tuple(
    replace(
        calling,
        slug=f"{calling.slug}+{reviewed.slug}",
        title=f"{calling.title} + {reviewed.title[0].lower()}{reviewed.title[1:]}",
        review=reviewed.review,
    )
    for calling in (FC, FC_PLUS)
    for reviewed in (TQA, VQA, GEO)
)
RECIPES: dict[str, Recipe] = {
    recipe.slug: recipe for recipe in (*PAPER, FC_PLUS, GEO, *_WITH_CALLS)
}


def find_recipe(name: str) -> Recipe:
    """Return the recipe of that name, in any case ("OTM", "otm").

    Raises:
        UnknownName: There is none; the sentence lists those there are.
    """
    try:
        return RECIPES[name.strip().lower()]
    except KeyError:
        raise UnknownName("variant", name, sorted(RECIPES)) from None


def spell_variant(slug: str) -> str:
    """Spell a variant as people read it: "fc+tqa" is FC+tQA; an unknown one stays as it is."""
    return "+".join(SPELLING.get(part, part) for part in slug.lower().split("+"))
