"""How many calls a recipe makes, and how much text they can hold, before anybody is asked. Pure.

Counted are calls that get an answer. Attempts that break on the wire come on top; a job's cap
counts them too.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from augment.variants.recipes import Recipe, Tools
from augment.variants.transcript import ModelRole

PROGRAM_TOKENS = 2_000
"""What the program says between two answers: results of calls, problems, feedback."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CallRange:
    """Calls of one role in one augmentation.

    Attributes:
        least: Where nothing goes wrong and no function is called.
        usual: A guess: one answer with calls where there is a function, and one round.
        most: Every round, every re-ask, every call of the function in an answer of its own.
    """

    least: int
    usual: int
    most: int


@dataclass(frozen=True, slots=True, kw_only=True)
class TokenUse:
    """Tokens of one role in one augmentation."""

    prompt: int
    completion: int


def calls_of(recipe: Recipe) -> dict[ModelRole, CallRange]:
    """The calls of every role that a recipe has."""
    limits = recipe.limits
    again = 1 + limits.re_asks
    rounds = recipe.rounds
    has_tool = recipe.tools is not Tools.NONE
    # The answer with the first call too many, and the one that it is asked for.
    a_round = again + (limits.calls.calls + 1 if has_tool else 0)
    calls = {ModelRole.MODIFIER: CallRange(least=1, usual=1 + has_tool, most=rounds * a_round)}
    if recipe.review is not None:
        for role, asked in Counter(recipe.review.asks).items():
            calls[role] = CallRange(least=asked, usual=asked, most=asked * rounds * again)
    return calls


def most_tokens(recipe: Recipe, first: Mapping[ModelRole, int]) -> dict[ModelRole, TokenUse]:
    """The tokens of conversations in which every answer reaches its length limit.

    Args:
        recipe: The variant.
        first: At most so many tokens has the first prompt of each role.
    """
    limits = recipe.limits
    # A cut-off answer is asked for again with twice the room.
    longest = limits.max_tokens * (2 if limits.re_asks else 1)
    turn = longest + PROGRAM_TOKENS
    rounds = recipe.rounds
    by_role = {}
    for role, calls in calls_of(recipe).items():
        # The modifier's conversation goes on through all rounds; a review is one of its own, and
        # holds what the others said of the round.
        talks = 1 if role is ModelRole.MODIFIER else rounds
        turns = calls.most // talks
        start = first[role] + (0 if role is ModelRole.MODIFIER else turn)
        by_role[role] = TokenUse(
            prompt=talks * (turns * start + turn * turns * (turns - 1) // 2),
            completion=calls.most * longest,
        )
    return by_role
