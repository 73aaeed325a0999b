"""Whether the endpoint read the whole prompt. Some cut it without a word and answer 200."""

from __future__ import annotations

import re
from functools import lru_cache

from augment.errors import ContextTruncated
from augment.llm.messages import Reply, Request

_WINDOWS = frozenset({2048, 4096, 8192})
"""What servers that cut silently have as their window unless told otherwise."""

_FAR_BELOW = 0.7
"""So much less than the lower bound is no vocabulary's doing."""

_PIECE = re.compile(r"(?:[^\r\n\w]|_)?[^\W\d_]+|\d{1,3}|(?:[^\s\w]|_)+")
"""Words, numbers of up to three digits, runs of signs: usual vocabularies cut at least there."""


@lru_cache(maxsize=64)
def least_tokens(text: str) -> int:
    """A number of tokens that the text has at least, whatever the vocabulary.

    Remembered, because the turns of one conversation repeat every message before them.
    """
    return len(_PIECE.findall(text))


def cut_of(request: Request, reply: Reply) -> ContextTruncated | None:
    """Compare the tokens that the endpoint counted with what it was sent.

    Returns:
        A fault where it counted far fewer than there are, where its prompt ended exactly at a
        usual window, or where prompt and answer together did and the answer was not finished;
        None where nothing shows a cut, also because nobody counted.
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
    if counted in _WINDOWS or _ends_at_window(request, reply, counted):
        window = counted if counted in _WINDOWS else counted + (reply.completion_tokens or 0)
        return ContextTruncated(
            f"the endpoint silently cut the prompt: its count of tokens ends exactly at {window}, "
            "a usual context window; give it a larger one"
        )
    return None


# --- Private -----------------------------------------------------------------------------------


def _ends_at_window(request: Request, reply: Reply, counted: int) -> bool:
    """Whether the answer ran into the window's end, rather than to its own."""
    written = reply.completion_tokens
    if written is None or reply.finish_reason == "stop" or written >= request.max_tokens:
        return False
    return counted + written in _WINDOWS
