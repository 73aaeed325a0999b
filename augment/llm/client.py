"""What the rest of the house asks of whatever answers as a language model.

In: a `Request` (messages, model, limits). Out: a `Reply` (text or calls, tokens), or a
`ModelFault` that says whether a later attempt may do better. `openai_wire` is the one that calls
out.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from augment.llm.messages import Reply, Request

Sending = Callable[[], None]
"""Called once, when a request is about to leave this computer; what it raises keeps it here."""


def watch_nothing() -> None:
    """For requests that nobody keeps a record of."""


class ChatClient(Protocol):
    """Answers one request with one reply: one call, no retries of its own."""

    def fitted(self, request: Request) -> Request:
        """The request as this client would send it: without what the model does not take.

        Raises:
            ModelFault: The request can't do without something that the model lacks.
        """
        ...

    def complete(self, request: Request, *, sending: Sending = watch_nothing) -> Reply:
        """The answer to this request.

        A refusal is a reply (`Reply.refusal`); so is an answer that was cut off.

        Args:
            request: What is asked.
            sending: Is called after every wait, right before the request is sent.

        Raises:
            ParameterRefused: The endpoint does not take a parameter; `fitted` knows it from now
                on, if it can do without.
            ModelFault: The wire or the endpoint broke before there was an answer.
            Abandoned: Nobody needs the answer any more; the request was sent.
            Unwanted: Nobody needs the answer any more; nothing was sent.
        """
        ...
