"""Whether the endpoint read the whole prompt. Some cut it without a word and answer 200."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from augment.errors import ContextTruncated
from augment.llm.messages import Reply, Request

_WINDOWS = frozenset({2048, 4096, 8192})
"""What servers that cut silently have as their window unless told otherwise."""

_FAR_BELOW = 0.7
"""So much less than the lower bound is no vocabulary's doing."""

_SPACE, _SIGN, _DIGIT, _LETTER = range(4)


def _classes() -> NDArray[np.uint8]:
    """What each byte of UTF-8 is; beyond ASCII everything passes for a letter."""
    table = np.full(256, _LETTER, dtype=np.uint8)
    for code in range(128):
        sign = chr(code)
        if sign.isspace():
            table[code] = _SPACE
        elif sign.isdigit():
            table[code] = _DIGIT
        elif not sign.isalpha():
            table[code] = _SIGN
    return table


_CLASSES = _classes()


def least_tokens(text: str) -> int:
    """A number of tokens that the text has at least, whatever the vocabulary.

    Usual vocabularies cut at least between words, numbers of up to three digits and runs of
    signs; one sign before a word may belong to it. Counted over arrays, because a prompt has tens
    of thousands of characters and this stands in the way of every answer.
    """
    kinds = _CLASSES[np.frombuffer(text.encode(errors="replace"), dtype=np.uint8)]
    if not len(kinds):
        return 0
    starts = np.flatnonzero(np.diff(kinds, prepend=kinds[0] + 1))
    lengths = np.diff(starts, append=len(kinds))
    kind = kinds[starts]
    before_word = np.append(kind[1:] == _LETTER, False)
    words = int(np.count_nonzero(kind == _LETTER))
    numbers = int(((lengths[kind == _DIGIT] + 2) // 3).sum())
    signs = int(np.count_nonzero((kind == _SIGN) & (lengths > before_word)))
    return words + numbers + signs


def cut_of(
    request: Request, reply: Reply, *, context_tokens: int | None = None
) -> ContextTruncated | None:
    """Return the fault of a prompt that the endpoint cut silently, None where nothing shows one.

    A cut shows in the endpoint's own count of prompt tokens: far below what the prompt must have
    at least; below it at all and exactly at the window; or prompt and unfinished answer together
    exactly at the window. A count that equals a window proves nothing by itself.

    Args:
        request: What was sent.
        reply: What came back; without a count of tokens nothing can be shown.
        context_tokens: The model's context window; None for any that servers usually have.
    """
    counted = reply.prompt_tokens
    if counted is None:
        return None
    least = sum(least_tokens(message.text) for message in request.messages)
    if counted < _FAR_BELOW * least:
        return ContextTruncated(
            f"the endpoint silently cut the prompt: it counted {counted} tokens, the prompt has "
            f"at least {least}; give it a larger context window"
        )
    windows = _WINDOWS if context_tokens is None else {context_tokens}
    total = counted + _unfinished_tokens(request, reply)
    if total in windows and (total > counted or counted < least):
        return ContextTruncated(
            f"the endpoint silently cut the prompt: its count of tokens ends exactly at {total}, "
            "a context window; give it a larger one"
        )
    return None


# --- Private -----------------------------------------------------------------------------------


def _unfinished_tokens(request: Request, reply: Reply) -> int:
    """Return the length of an answer that ended before its own end and its limit, else 0."""
    written = reply.completion_tokens or 0
    is_finished = reply.finish_reason == "stop" or written >= request.max_tokens
    return 0 if is_finished else written
