"""Prompts of a variant's roles and their longest size, before any request. Pure.

Reviewers judge what a modifier made; where nothing is given, they are shown an unchanged scene.
Counted are calls that get an answer. Attempts that break on the wire come on top; a job's cap
counts them too.
"""

import json
import math
from dataclasses import dataclass

from augment.llm.messages import Message
from augment.prompts import fill
from augment.prompts.calls import Tools
from augment.scene.entities import Modification, Scene
from augment.variants.pipeline import modifier_options
from augment.variants.recipes import Recipe
from augment.variants.respondents import ModelRole
from augment.variants.reviews import BlockForm, pictures

CHARACTERS_PER_TOKEN = 2.6
"""Measured on number-heavy text over common vocabularies: an estimate, no bound."""

EXAMPLE_QUESTIONS = (
    "In which lane does each blue object stand?",
    "Which way does each blue object face?",
    "Between which grid lines is the centre of each blue object?",
)
"""Shown to a viewer where no engineer has asked."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownPrompt:
    """A prompt as it would be sent.

    Attributes:
        tools: Descriptions of functions that go beside the messages, as JSON.
    """

    messages: tuple[Message, ...]
    tools: tuple[str, ...] = ()

    @property
    def tokens(self) -> int:
        """An estimate of its tokens, pictures not counted."""
        characters = sum(len(message.text) for message in self.messages)
        characters += sum(len(tool) for tool in self.tools)
        return math.ceil(characters / CHARACTERS_PER_TOKEN)


def build_prompt(
    recipe: Recipe,
    role: ModelRole,
    scene: Scene,
    instruction: str,
    modification: Modification,
    *,
    native_tools: bool = False,
) -> ShownPrompt:
    """Return the first prompt of that role.

    Args:
        recipe: The variant.
        role: Any of the four, also one that this variant does not have.
        scene: The scene before the change.
        instruction: The user's wish.
        modification: What reviewers judge.
        native_tools: Whether the modifier calls natively.
    """
    if role is ModelRole.MODIFIER:
        options = modifier_options(recipe, native_tools=native_tools)
        return ShownPrompt(
            messages=fill.modifier_messages(scene, instruction, options),
            tools=tuple(
                json.dumps(tool.to_document()) for tool in fill.list_native_tools(options)
            ),
        )
    if role is ModelRole.VIEWER:
        images = pictures(scene, modification, width_px=recipe.limits.picture_px)
        return ShownPrompt(messages=fill.viewer_messages(EXAMPLE_QUESTIONS, images))
    radius_m = recipe.limits.radius_m
    return ShownPrompt(
        messages=fill.review_messages(role, scene, instruction, modification, radius_m=radius_m)
    )


def count_calls(recipe: Recipe) -> tuple[int, int, int]:
    """Return the least, the usual and the most calls of all roles in one augmentation.

    The least where nothing goes wrong and no function is called. The usual number is a guess: one
    answer with calls where there is a function, and one round. The most are every round, every
    re-ask, and every call of the function in an answer of its own.
    """
    limits, rounds = recipe.limits, recipe.rounds
    again = 1 + limits.re_asks
    has_tool = recipe.tools is not Tools.NONE
    by_schema = limits.block is BlockForm.SCHEMA
    # The answer with the first call too many, and the one that it is asked for.
    a_round = again + (limits.calls + 1 if has_tool else 0) + by_schema
    reviews = len(recipe.review.asks) if recipe.review else 0
    usual = 1 + has_tool + by_schema
    return 1 + reviews, usual + reviews, rounds * (a_round + reviews * again)
