"""Upper bound of a request's cost, and its actual cost. Pure.

Money is counted in whole nano-dollars (a price of 2.50 USD per million tokens is 2500 of them a
token) and every sum is rounded up, so that counting never falls short of the bill.
"""

import json
import math
import re
from dataclasses import asdict, dataclass
from decimal import Decimal

from augment.errors import ContextTruncated
from augment.llm.messages import Reply, Request

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
    """USD per million tokens, of the prompt and of the answer (reasoning included).

    Attributes:
        cached_usd: Of what of the prompt came from a cache, None where it costs the same.
    """

    prompt_usd: Decimal
    completion_usd: Decimal
    cached_usd: Decimal | None = None

    def nano_usd(
        self, *, prompt_tokens: int, completion_tokens: int, cached_tokens: int = 0
    ) -> int:
        """Return the cost of a number of tokens in nano-dollars, rounded up.

        Args:
            prompt_tokens: Those from a cache included.
            completion_tokens: Of the answer.
            cached_tokens: So many of the prompt's came from a cache.
        """
        cached = min(cached_tokens, prompt_tokens) if self.cached_usd is not None else 0
        prompt_usd = self.prompt_usd * (prompt_tokens - cached) + (self.cached_usd or 0) * cached
        return math.ceil(1000 * (prompt_usd + self.completion_usd * completion_tokens))


@dataclass(frozen=True, slots=True, kw_only=True)
class WorstCase:
    """The most that one attempt at a request can use."""

    prompt_tokens: int
    completion_tokens: int
    cached_tokens: int = 0

    @property
    def tokens(self) -> int:
        """Prompt and answer together."""
        return self.prompt_tokens + self.completion_tokens

    def nano_usd(self, price: Price | None) -> int | None:
        """Return the cost in nano-dollars, None if the price is unknown."""
        return None if price is None else price.nano_usd(**asdict(self))


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


def to_usd(nano_usd: int) -> Decimal:
    """Nano-dollars as dollars."""
    return Decimal(nano_usd) / NANO_USD


def to_nano_usd(usd: Decimal) -> int:
    """Dollars as whole nano-dollars, rounded down: a cap is not rounded up."""
    return int(usd * NANO_USD)


_WINDOWS = frozenset({2048, 4096, 8192})
"""What servers that cut silently have as their window unless told otherwise."""

FAR_BELOW = 0.7
"""So much less than the lower bound is no vocabulary's doing."""

# Words, numbers of up to three digits, and runs of signs, but for one sign before a word; beyond
# ASCII everything passes for a letter.
_LETTER = r"[A-Za-z\u0080-\U0010ffff]"
_SIGN = r"[^\s0-9A-Za-z\u0080-\U0010ffff]"
_PIECE = re.compile(rf"{_LETTER}+|[0-9]{{1,3}}|{_SIGN}{{2,}}|{_SIGN}(?!{_LETTER})")


def least_tokens(text: str) -> int:
    """Return how many tokens the text has at least: usual vocabularies cut at least there."""
    return len(_PIECE.findall(text))


def find_cut(
    request: Request, reply: Reply, *, context_tokens: int | None = None
) -> ContextTruncated | None:
    """Return the fault of a prompt that the endpoint cut silently, None where nothing shows one.

    A cut shows in the endpoint's own count of prompt tokens: below what the prompt must have at
    least and exactly at the window; or prompt and unfinished answer together exactly at the
    window. A count that equals a window proves nothing by itself, and neither does a small one:
    some endpoints leave out what came from a cache.

    Args:
        request: What was sent.
        reply: What came back; without a count of tokens nothing can be shown.
        context_tokens: The model's context window; None for any that servers usually have.
    """
    counted = reply.prompt_tokens
    if counted is None:
        return None
    least = sum(least_tokens(message.text) for message in request.messages)
    windows = _WINDOWS if context_tokens is None else {context_tokens}
    # The length of an answer that ended before its own end and its limit.
    written = reply.completion_tokens or 0
    is_finished = reply.finish_reason == "stop" or written >= request.max_tokens
    total = counted + (0 if is_finished else written)
    if total in windows and (total > counted or counted < least):
        return ContextTruncated(
            f"the endpoint silently cut the prompt: its count of tokens ends exactly at {total}, "
            "a context window; give it a larger one"
        )
    return None
