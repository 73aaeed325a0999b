"""The exact messages that a role of a variant gets for a scene, without asking anybody.

Reviewers judge what a modifier made; where nothing is given, they are shown an unchanged scene.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass

from augment.llm.messages import Message
from augment.prompts import fill, fill_review
from augment.prompts.lane_curves import lane_curves
from augment.prompts.names import short_names
from augment.prompts.vectors import LaneFormat
from augment.scene.entities import Modification, Scene
from augment.variants.modifier import form_of
from augment.variants.recipes import Recipe
from augment.variants.transcript import ModelRole
from augment.variants.visual_qa import pictures

CHARACTERS_PER_TOKEN = 2.6
"""Measured on number-heavy text over common vocabularies: an estimate, no bound."""

EXAMPLE_QUESTIONS = (
    "In which lane does each blue object stand?",
    "Which way does each blue object face?",
    "Between which grid lines is the centre of each blue object?",
)
"""Shown to a viewer where no engineer has asked."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LaneFit:
    """How far the Bezier pieces of a prompt are from the lanes that they stand for.

    Attributes:
        pieces: Over all lanes and connectors.
        position_m, heading_deg: The worst of all; worst_lane has the worst position.
    """

    lanes: int
    pieces: int
    position_m: float
    heading_deg: float
    worst_lane: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """A prompt as it would be sent.

    Attributes:
        tools: Descriptions of functions that go beside the messages, as JSON.
        fit: None where the lanes are polylines.
    """

    messages: tuple[Message, ...]
    tools: tuple[str, ...]
    fit: LaneFit | None

    @property
    def tokens(self) -> int:
        """About so many tokens, pictures not counted."""
        characters = sum(len(message.text) for message in self.messages)
        characters += sum(len(tool) for tool in self.tools)
        return math.ceil(characters / CHARACTERS_PER_TOKEN)


def shown_prompt(
    recipe: Recipe,
    role: ModelRole,
    scene: Scene,
    instruction: str,
    modification: Modification,
    *,
    native_tools: bool = False,
    questions: Sequence[str] = EXAMPLE_QUESTIONS,
    images: tuple[bytes, ...] | None = None,
) -> Shown:
    """What that role is asked first.

    Args:
        recipe: The variant.
        role: Any of the four, also one that this variant does not have.
        scene: The scene before the change.
        instruction: The user's wish.
        modification: What reviewers judge.
        native_tools: Whether the modifier calls natively.
        questions: What the viewer is asked.
        images: What the viewer is shown, as `pictures` drew it before; None to draw it.
    """
    radius_m = recipe.limits.radius_m
    if role is ModelRole.MODIFIER:
        form = form_of(recipe, native_tools=native_tools)
        native = form.calling is fill.Calling.NATIVE
        return Shown(
            messages=fill.modifier_messages(scene, instruction, form),
            tools=(json.dumps(fill.pose_tool().to_document()),) if native else (),
            fit=_fit(scene, radius_m) if recipe.lane_format is LaneFormat.BEZIER else None,
        )
    match role:
        case ModelRole.REVIEWER:
            ask = fill_review.reviewer_messages
            messages = ask(scene, instruction, modification, radius_m=radius_m)
        case ModelRole.ENGINEER:
            ask = fill_review.engineer_messages
            messages = ask(scene, instruction, modification, radius_m=radius_m)
        case ModelRole.VIEWER:
            if images is None:
                images = pictures(scene, modification, width_px=recipe.limits.picture_px)
            messages = fill_review.viewer_messages(questions, images)
    return Shown(messages=messages, tools=(), fit=None)


def _fit(scene: Scene, radius_m: float) -> LaneFit | None:
    curves = lane_curves(scene, short_names(scene), radius_m).values()
    if not curves:
        return None
    worst = max(curves, key=lambda curve: curve.lane.error.position_m)
    return LaneFit(
        lanes=len(curves),
        pieces=sum(len(curve.lane.pieces) for curve in curves),
        position_m=worst.lane.error.position_m,
        heading_deg=math.degrees(max(curve.lane.error.heading_rad for curve in curves)),
        worst_lane=worst.id,
    )
