"""Client interface of whatever answers as a language model.

In: a `Request` (messages, model, limits). Out: a `Reply` (text or calls, tokens), or a
`ModelFault` that says whether a later attempt may do better. `openai_wire` is the one that calls
out.
"""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Protocol

from augment.errors import ModelFault
from augment.llm.messages import LengthName, Reply, Request, SchemaForm

Sending = Callable[[], None]
"""Called once, when a request is about to leave this computer; what it raises keeps it here."""


def watch_nothing() -> None:
    """For requests that nobody keeps a record of."""


class ChatClient(Protocol):
    """Answers one request with one reply: one call, no retries of its own."""

    def fit(self, request: Request) -> Request:
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Patience:
    """Exponential back-off with jitter, bounded by a number of attempts and by a longest wait.

    Attributes:
        attempts: How often one request is sent at most.
        first_wait_s: The wait after the first fault; it doubles from one to the next.
        longest_wait_s: No wait of the back-off is longer.
        longest_asked_s: Who is asked to wait longer (Retry-After) gives up. Limits by the minute
            are over in one.
        sleep: Waits for that many seconds.
        rng: Where the jitter comes from.
    """

    attempts: int = 3
    first_wait_s: float = 1.0
    longest_wait_s: float = 30.0
    longest_asked_s: float = 90.0
    sleep: Callable[[float], None] = time.sleep
    rng: random.Random = field(default_factory=random.Random)

    def wait_s(self, fault: ModelFault, *, attempt: int) -> float | None:
        """Seconds to wait after that attempt (the first is 1), None to give up.

        The jitter takes away up to half of the back-off. What the endpoint asked for with
        Retry-After is never undercut.
        """
        if not fault.retryable or attempt >= self.attempts:
            return None
        asked_s = fault.retry_after_s or 0.0
        if asked_s > self.longest_asked_s:
            return None
        backoff_s = min(self.first_wait_s * 2.0 ** (attempt - 1), self.longest_wait_s)
        return max(asked_s, backoff_s * (1.0 - 0.5 * self.rng.random()))


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelProfile:
    """The abilities of a model at an endpoint.

    Attributes:
        native_tools, vision: None where nobody knows.
        refused: Names of parameters that it does not take.
        reasoning_effort: Sent with each request, empty for none.
        max_output_tokens: No answer may be asked to be longer, None without a limit.
    """

    native_tools: bool | None = None
    vision: bool | None = None
    refused: frozenset[str] = frozenset()
    reasoning_effort: str = ""
    max_output_tokens: int | None = None

    def fit(self, request: Request) -> Request:
        """The request with what this model takes, and nothing else.

        Raises:
            ModelFault: It can't do without what the model lacks: sight, native tools, a limit of
                the answer's length.
        """
        self._check(request)
        effort = request.reasoning_effort or self.reasoning_effort or None
        taken = [name for name in LengthName if name not in self.refused]
        name = request.length_name if request.length_name in taken else taken[0]
        return replace(
            request,
            max_tokens=min(request.max_tokens, self.max_output_tokens or request.max_tokens),
            temperature=None if "temperature" in self.refused else request.temperature,
            seed=None if "seed" in self.refused else request.seed,
            reasoning_effort=None if "reasoning_effort" in self.refused else effort,
            length_name=name,
            schema_form=next(
                (form for form in SchemaForm if form not in self.refused), request.schema_form
            ),
        )

    def without(self, parameter: str) -> ModelProfile:
        """The same model, that does not take this parameter."""
        return replace(self, refused=self.refused | {parameter})

    def _check(self, request: Request) -> None:
        lacks = None
        if self.vision is False and any(message.images for message in request.messages):
            lacks = "can't see pictures, which this variant needs"
        elif self.native_tools is False and request.tools:
            lacks = "has no native tool calls, which this variant was told to use"
        elif request.schema is not None and self.refused.issuperset(SchemaForm):
            lacks = "keeps to no schema of an answer, which this contestant was told to use"
        elif self.refused.issuperset(LengthName):
            lacks = "takes no limit of the answer's length, so that its cost has no bound"
        if lacks:
            raise ModelFault(f"{request.model} at this endpoint {lacks}", retryable=False)
