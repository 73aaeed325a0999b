"""The Scenario Modifier Agent: asks, reads, and asks once more where it can't read."""

from __future__ import annotations

from augment.errors import ModelRefused, ReplyUnreadable
from augment.llm.messages import Message, Reply, Request
from augment.prompts import fill
from augment.prompts.reply import ReadReply, read_reply
from augment.scene.entities import Scene
from augment.variants.asking import Conversation
from augment.variants.recipes import Recipe
from augment.variants.transcript import ModelRole


def modify(
    recipe: Recipe, *, scene: Scene, instruction: str, conversation: Conversation
) -> ReadReply:
    """The modifier's answer, read.

    Raises:
        ReplyUnreadable: Neither the first answer nor the re-asked one can be read.
        ModelRefused: The model declined, or its endpoint's filter did.
        ModelFault: The wire broke for good.
    """
    limits = recipe.limits
    messages = fill.modifier_messages(scene, instruction, radius_m=limits.radius_m)
    max_tokens = limits.max_tokens
    for _ in range(limits.re_asks):
        reply = _ask(conversation, messages, max_tokens)
        try:
            return _read(reply, scene, limits.radius_m)
        except ReplyUnreadable as unreadable:
            messages = fill.re_ask_messages(messages, reply.text, unreadable.problems)
            max_tokens *= 2 if reply.is_cut_off else 1
    return _read(_ask(conversation, messages, max_tokens), scene, limits.radius_m)


def _ask(conversation: Conversation, messages: tuple[Message, ...], max_tokens: int) -> Reply:
    request = Request(model=conversation.model, messages=messages, max_tokens=max_tokens)
    reply = conversation.ask(ModelRole.MODIFIER, request, fill.prompt_version())
    if reply.refusal is not None:
        raise ModelRefused(reply.refusal or "The model declined without a reason.")
    if reply.finish_reason == "content_filter":
        raise ModelRefused("The endpoint's content filter withheld the answer.")
    return reply


def _read(reply: Reply, scene: Scene, radius_m: float) -> ReadReply:
    try:
        return read_reply(reply.text, scene, radius_m=radius_m)
    except ReplyUnreadable as unreadable:
        if not reply.is_cut_off:
            raise
        cut = "the answer was cut off at its length limit: be shorter"
        raise ReplyUnreadable([cut, *unreadable.problems]) from None
