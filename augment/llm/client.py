"""What the rest of the house asks of whatever answers as a language model."""

from __future__ import annotations

from typing import Protocol

from augment.llm.messages import Reply, Request


class ChatClient(Protocol):
    """Answers one request with one reply: one call, no retries of its own."""

    def fitted(self, request: Request) -> Request:
        """The request as this client would send it: without what the model does not take.

        Raises:
            ModelFault: The request can't do without something that the model lacks.
        """
        ...

    def complete(self, request: Request) -> Reply:
        """The answer to this request.

        A refusal is a reply (`Reply.refusal`); so is an answer that was cut off.

        Raises:
            ParameterRefused: The endpoint does not take a parameter; `fitted` knows it from now
                on, if it can do without.
            ModelFault: The wire or the endpoint broke before there was an answer.
        """
        ...
