"""Who plays which role, and how a role is asked until its answer can be read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TypeVar

from augment.errors import ModelRefused, ReplyUnreadable
from augment.llm.client import ChatClient, Patience
from augment.llm.messages import Message, Reply, Request, Tool, ToolChoice
from augment.prompts.fill import prompt_version
from augment.variants.recording_client import RecordingClient
from augment.variants.transcript import ModelRole, Transcript

Messages = tuple[Message, ...]
_Read = TypeVar("_Read")


@dataclass(frozen=True, slots=True, kw_only=True)
class Sampling:
    """What every request of a run is sent with; None is not sent."""

    temperature: float | None = None
    seed: int | None = None
    reasoning_effort: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RespondentClient:
    """Who plays a role.

    Attributes:
        model: The model id that the client is asked for.
        native_tools: Whether the model is to call tools natively instead of in its answer.
        context_tokens: Its context window, None where nobody entered it.
    """

    client: ChatClient
    model: str
    native_tools: bool = False
    context_tokens: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Respondents:
    """Who is talked to, and what keeps the record.

    Attributes:
        clients: By role; a role without one is played by the modifier's.
        sampling: What every request is sent with.
    """

    clients: Mapping[ModelRole, RespondentClient]
    transcript: Transcript
    patience: Patience
    sampling: Sampling = field(default_factory=Sampling)

    def client_of(self, role: ModelRole) -> RespondentClient:
        """Who plays that role."""
        return self.clients.get(role, self.clients[ModelRole.MODIFIER])

    def ask(
        self,
        role: ModelRole,
        messages: Messages,
        *,
        max_tokens: int,
        tools: tuple[Tool, ...] = (),
        tool_choice: ToolChoice = ToolChoice.AUTO,
    ) -> Reply:
        """The reply of whoever plays the role.

        Raises:
            ModelRefused: The model declined, or its endpoint's filter did.
            ModelFault: The last attempt broke, or the fault is one that does not pass.
            BudgetSpent: The transcript's budget has no room for the next attempt.
        """
        respondent = self.client_of(role)
        request = Request(
            model=respondent.model,
            messages=messages,
            max_tokens=max_tokens,
            tools=tools,
            tool_choice=tool_choice,
            temperature=self.sampling.temperature,
            seed=self.sampling.seed,
            reasoning_effort=self.sampling.reasoning_effort,
        )
        recording = RecordingClient(
            client=respondent.client,
            model=respondent.model,
            transcript=self.transcript,
            patience=self.patience,
            context_tokens=respondent.context_tokens,
        )
        reply = recording.ask(role, request, prompt_version())
        if reply.refusal is not None:
            raise ModelRefused(reply.refusal or "The model declined without a reason.")
        if reply.finish_reason == "content_filter":
            raise ModelRefused("The endpoint's content filter withheld the answer.")
        return reply


@dataclass(frozen=True, slots=True, kw_only=True)
class Inquiry:
    """How an answer is asked for until it can be read.

    Attributes:
        again: The conversation that asks once more: from the one so far, the answer's text and
            what is wrong with it.
        re_asks: How often that is done.
    """

    respondents: Respondents
    role: ModelRole
    again: Callable[[Messages, str, list[str]], Messages]
    max_tokens: int
    re_asks: int
    tools: tuple[Tool, ...] = ()

    def read(
        self, messages: Messages, reader: Callable[[str], _Read], reply: Reply | None = None
    ) -> tuple[_Read, Messages, Reply]:
        """What was read, the conversation that led to the answer, and the answer.

        Args:
            messages: What is asked.
            reader: From a text to what it says, raising ReplyUnreadable.
            reply: The first answer, where it is there already.

        Raises:
            ReplyUnreadable: No answer can be read.
            ModelRefused: The model declined, or its endpoint's filter did.
            ModelFault: The wire broke for good.
        """
        max_tokens = self.max_tokens
        reply = reply or self._ask(messages, max_tokens)
        for _ in range(self.re_asks):
            try:
                return _read(reply, reader), messages, reply
            except ReplyUnreadable as unreadable:
                messages = self.again(messages, reply.text, unreadable.problems)
                max_tokens *= 2 if reply.is_cut_off else 1
                reply = self._ask(messages, max_tokens)
        return _read(reply, reader), messages, reply

    def _ask(self, messages: Messages, max_tokens: int) -> Reply:
        # Tools are named where the conversation holds calls, and can't be called any more.
        return self.respondents.ask(
            self.role,
            messages,
            max_tokens=max_tokens,
            tools=self.tools,
            tool_choice=ToolChoice.NONE,
        )


def _read(reply: Reply, reader: Callable[[str], _Read]) -> _Read:
    try:
        return reader(reply.text)
    except ReplyUnreadable as unreadable:
        if not reply.is_cut_off:
            raise
        cut = "the answer was cut off at its length limit: be shorter"
        raise ReplyUnreadable([cut, *unreadable.problems]) from None
