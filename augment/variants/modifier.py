"""The Scenario Modifier Agent: asks, has its calls answered, reads, and asks once more."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from augment.checks import Ground
from augment.prompts import fill
from augment.prompts.fill import Calling, Form, model_message
from augment.prompts.reply import ReadReply, read_reply
from augment.scene.entities import Scene
from augment.scene.intent import Intent
from augment.variants.pose_tool import PoseTool
from augment.variants.recipes import Recipe, Tools
from augment.variants.respondents import Inquiry, Messages, Respondents
from augment.variants.tool_loop import ToolDesk, ask_with_tool
from augment.variants.transcript import ModelRole


@dataclass(frozen=True, slots=True, kw_only=True)
class Draft:
    """What the modifier made in one round.

    Attributes:
        read: Its answer, understood.
        messages: The conversation up to and including that answer.
    """

    read: ReadReply
    messages: Messages


def form_of(recipe: Recipe, *, native_tools: bool = False) -> Form:
    """The form in which a recipe's modifier gets its task."""
    calling = Calling.NONE
    if recipe.tools is Tools.POSE:
        calling = Calling.NATIVE if native_tools else Calling.IN_PROMPT
    return Form(
        lanes=recipe.lane_format,
        calling=calling,
        radius_m=recipe.limits.radius_m,
        calls=recipe.limits.calls.calls,
        identical=recipe.limits.calls.identical,
    )


@dataclass(frozen=True, kw_only=True)
class Modifier:
    """One modifier at work on one scene.

    Attributes:
        intent: What the instruction asks for: for a geometric review, never for a model.
    """

    recipe: Recipe
    scene: Scene
    respondents: Respondents
    intent: Intent | None = None

    @cached_property
    def ground(self) -> Ground:
        """The scene, laid out for the checks once for all rounds."""
        return Ground.of(self.scene)

    @property
    def form(self) -> Form:
        """The form in which it gets its task."""
        native = self.respondents.client_of(ModelRole.MODIFIER).native_tools
        return form_of(self.recipe, native_tools=native)

    def task(self, instruction: str) -> Messages:
        """What it is asked first."""
        return fill.modifier_messages(self.scene, instruction, self.form)

    def draft(self, messages: Messages) -> Draft:
        """One round: its answer to the conversation so far, read.

        Raises:
            ReplyUnreadable: Neither the first answer nor the re-asked one can be read.
            ModelRefused: The model declined, or its endpoint's filter did.
            ModelFault: The wire broke for good.
        """
        limits, form = self.recipe.limits, self.form
        reply = None
        if form.calling is not Calling.NONE:
            desk = ToolDesk(
                tool=PoseTool(self.scene, limits.radius_m),
                limits=limits.calls,
                transcript=self.respondents.transcript,
            )
            messages, reply = ask_with_tool(
                self.respondents,
                messages,
                desk=desk,
                calling=form.calling,
                max_tokens=limits.max_tokens,
            )
        inquiry = Inquiry(
            respondents=self.respondents,
            role=ModelRole.MODIFIER,
            again=fill.re_ask_messages,
            max_tokens=limits.max_tokens,
            re_asks=limits.re_asks,
            tools=(fill.pose_tool(),) if form.calling is Calling.NATIVE else (),
        )
        read, asked, answer = inquiry.read(messages, self._read, reply)
        return Draft(read=read, messages=(*asked, model_message(answer.text)))

    def _read(self, answer: str) -> ReadReply:
        return read_reply(answer, self.scene, radius_m=self.recipe.limits.radius_m)
