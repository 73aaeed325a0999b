"""What a request may cost at most, and what it did cost. Pure.

Money is counted in whole nano-dollars (a price of 2.50 USD per million tokens is 2500 of them a
token) and every sum is rounded up, so that counting never falls short of the bill.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from decimal import Decimal

from augment.llm.messages import Request

NANO_USD = 1_000_000_000
"""So many nano-dollars are one dollar."""

IMAGE_TOKENS = 40_000
"""No known vendor counts more for one image of our size (gpt-4o-mini: 36,835 for six tiles)."""

REQUEST_TOKENS = 256
"""For what chat templates add to a request: preambles, dates, the opening of the answer."""

MESSAGE_TOKENS = 16
"""For what chat templates add to a message."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Price:
    """USD per million tokens, of the prompt and of the answer (reasoning included)."""

    prompt_usd: Decimal
    completion_usd: Decimal

    def nano_usd(self, *, prompt_tokens: int, completion_tokens: int) -> int:
        """What so many tokens cost, in nano-dollars, rounded up."""
        return math.ceil(
            1000 * (self.prompt_usd * prompt_tokens + self.completion_usd * completion_tokens)
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class WorstCase:
    """The most that one attempt at a request can use."""

    prompt_tokens: int
    completion_tokens: int

    @property
    def tokens(self) -> int:
        """Prompt and answer together."""
        return self.prompt_tokens + self.completion_tokens

    def nano_usd(self, price: Price | None) -> int | None:
        """What it costs, None where the price is unknown."""
        if price is None:
            return None
        return price.nano_usd(
            prompt_tokens=self.prompt_tokens, completion_tokens=self.completion_tokens
        )


def worst_case(request: Request) -> WorstCase:
    """The most that one attempt at this request can use.

    A token of text stands for at least one byte, whatever the vocabulary, so the bytes of the
    request are a bound on its tokens; images are counted apart. The answer ends at its length
    limit.
    """
    document = request.to_document(image_url=lambda png: "")
    text = json.dumps(document, ensure_ascii=False).encode("utf-8", "backslashreplace")
    images = sum(len(message.images) for message in request.messages)
    return WorstCase(
        prompt_tokens=len(text)
        + REQUEST_TOKENS
        + MESSAGE_TOKENS * len(request.messages)
        + IMAGE_TOKENS * images,
        completion_tokens=request.max_tokens,
    )


def usd_of(nano_usd: int) -> Decimal:
    """Nano-dollars as dollars."""
    return Decimal(nano_usd) / NANO_USD


def nano_usd_of(usd: Decimal) -> int:
    """Dollars as whole nano-dollars, rounded down: a cap is not rounded up."""
    return int(usd * NANO_USD)
