"""What the rest of the house asks of whatever answers as a language model."""

from __future__ import annotations

from typing import Protocol

from augment.llm.messages import Reply, Request


class ChatClient(Protocol):
    """Answers one request with one reply: one call, no retries of its own."""

    def complete(self, request: Request) -> Reply:
        """The answer to this request.

        A refusal is a reply (`Reply.refusal`); so is an answer that was cut off.

        Raises:
            ModelFault: The wire or the endpoint broke before there was an answer.
        """
        ...
