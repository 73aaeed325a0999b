"""Roles and their models, repeated requests until an answer can be read, and their record."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import partial
from typing import Any, Protocol, TypeVar

from augment import errors
from augment.errors import ModelFault, ModelRefused
from augment.llm.client import ChatClient, Patience
from augment.llm.costs import find_cut
from augment.llm.messages import DEFAULT_MAX_TOKENS, Reply, Request, Tool, ToolChoice
from augment.prompts.blocks import only_thinks
from augment.prompts.fill import Messages, prompt_version, review_re_ask_messages

_Read = TypeVar("_Read")


class ModelRole(StrEnum):
    """Role of a language model: one of the paper's agents, a reader of intents, a judge."""

    MODIFIER = "modifier"
    REVIEWER = "reviewer"
    ENGINEER = "engineer"
    VIEWER = "viewer"
    READER = "reader"
    JUDGE = "judge"


class NoteKind(StrEnum):
    """Kind of an event between two calls in a transcript."""

    ROUND = "round"
    TOOL_CALL = "tool_call"
    REVIEW = "review"
    KEPT = "kept"


class Transcript(Protocol):
    """Told of every attempt before it is sent, and of its end before anybody reads it."""

    def cached_reply(self, role: ModelRole, request: Request, prompt_version: str) -> Reply | None:
        """Return an earlier answer to this request, recorded as a call that cost nothing.

        None where the request is to be sent.
        """
        ...

    def record_request(self, role: ModelRole, request: Request, prompt_version: str) -> int:
        """Note that this request is about to be sent; returns the number of the call.

        Raises:
            QuestionInFlight: Somebody else has just sent the same; its answer will be known.
        """
        ...

    def sending(self, number: int) -> None:
        """Note that this call leaves the computer now, after every wait.

        Raises:
            LeaseLost: Nobody needs the answer any more; it is not to be sent.
        """
        ...

    def record_reply(self, number: int, reply: Reply, fault: ModelFault | None = None) -> None:
        """Keep the raw answer to that call, and what shows that it is none to rely on."""
        ...

    def broke(self, number: int, fault: ModelFault) -> None:
        """Note that there was no answer to that call, and why."""
        ...

    def note(self, kind: NoteKind, document: dict[str, object]) -> None:
        """Keep what happened since the last call: ready for JSON, shown as it is."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class RespondentClient:
    """Client of a role.

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
    """Everybody who is asked in one run, and what keeps the record.

    Attributes:
        clients: By role; a role without one is played by the modifier's.
        sampling: Temperature, seed and reasoning effort of every request; None is not sent.
        max_tokens: The length limit of one answer; a cut-off one is asked again with twice it.
        re_asks: How often an answer that can't be read is asked for again.
    """

    clients: Mapping[ModelRole, RespondentClient]
    transcript: Transcript
    patience: Patience = field(default_factory=Patience)
    sampling: Mapping[str, Any] = field(default_factory=dict)
    max_tokens: int = DEFAULT_MAX_TOKENS
    re_asks: int = 1

    def client_of(self, role: ModelRole) -> RespondentClient:
        """Return who plays that role."""
        return self.clients.get(role, self.clients[ModelRole.MODIFIER])

    def read(
        self,
        role: ModelRole,
        messages: Messages,
        reader: Callable[[str], _Read],
        *,
        again: Callable[[Messages, str, list[str]], Messages] = review_re_ask_messages,
        tools: tuple[Tool, ...] = (),
        reply: Reply | None = None,
        schema: Mapping[str, object] | None = None,
    ) -> tuple[_Read, Messages, Reply]:
        """Ask until the answer can be read.

        Args:
            role: Who is asked.
            messages: What is asked.
            reader: From a text to what it says, raising errors.ReplyUnreadable.
            again: The conversation that asks once more: from the one so far, the answer's text
                and what is wrong with it.
            tools: Named where the conversation holds calls; none can be called any more.
            reply: The first answer, where it is there already.
            schema: What every answer has to obey.

        Returns:
            What was read, the conversation that led to the answer, and the answer.

        Raises:
            errors.ReplyUnreadable: No answer can be read.
            ModelRefused: The model declined, or its endpoint's filter did.
            ModelFault: The wire broke for good.
        """
        ask = partial(self.ask, role, tools=tools, tool_choice=ToolChoice.NONE, schema=schema)
        max_tokens, re_asked = self.max_tokens, 0
        reply = reply or ask(messages)
        while True:
            has_begun = not (reply.is_cut_off and only_thinks(reply.text))
            try:
                return reader(reply.text if has_begun else ""), messages, reply
            except errors.ReplyUnreadable as unreadable:
                problems = list(unreadable.problems)
                if reply.is_cut_off:
                    problems.insert(0, "the answer was cut off at its length limit: be shorter")
                elif reply.tool_calls:
                    problems.insert(0, "no native call is answered: write the answer itself")
                elif reply.reasoning and not reply.text:
                    problems.insert(0, "there are thoughts and no answer: write it as well")
                if re_asked == self.re_asks:
                    raise errors.ReplyUnreadable(problems) from None
            messages = again(messages, reply.text, problems)
            max_tokens *= 2 if reply.is_cut_off else 1
            re_asked += 1
            reply = ask(messages, max_tokens=max_tokens)

    def ask(
        self,
        role: ModelRole,
        messages: Messages,
        *,
        max_tokens: int | None = None,
        tools: tuple[Tool, ...] = (),
        tool_choice: ToolChoice = ToolChoice.AUTO,
        schema: Mapping[str, object] | None = None,
    ) -> Reply:
        """Return the reply of whoever plays the role.

        Raises:
            ModelRefused: The model declined, or its endpoint's filter did.
            ModelFault: The last attempt broke, or the fault is one that does not pass.
            BudgetSpent: The transcript's budget has no room for the next attempt.
        """
        request = Request(
            model=self.client_of(role).model,
            messages=messages,
            max_tokens=max_tokens or self.max_tokens,
            tools=tools,
            tool_choice=tool_choice,
            schema=schema,
            **self.sampling,
        )
        reply = self.send(role, request, prompt_version())
        if reply.refusal is not None:
            raise ModelRefused(reply.refusal or "The model declined without a reason.")
        if reply.is_withheld:
            raise ModelRefused("The endpoint's content filter withheld the answer.")
        return reply

    def send(self, role: ModelRole, request: Request, version: str) -> Reply:
        """Return the reply to a request; every attempt is recorded before it is judged.

        The request goes without what the model does not take, and what the transcript knows the
        answer to is not sent.

        Raises:
            ContextTruncated: There is an answer, but to a part of the prompt.
            ModelFault: The last attempt broke, or the fault is one that does not pass.
            BudgetSpent: The transcript's budget has no room for the next attempt.
            errors.Unwanted: Nobody needs the reply any more.
        """
        client = self.client_of(role).client
        while True:
            sent = client.fit(request)
            try:
                return self.transcript.cached_reply(role, sent, version) or self._attempt(
                    role, sent, version
                )
            except errors.ParameterRefused:
                if client.fit(request) == sent:
                    raise
            except errors.QuestionInFlight:
                continue  # the transcript waits for the answer

    def _attempt(self, role: ModelRole, request: Request, version: str) -> Reply:
        """Send the request as it is, as often as patience allows."""
        respondent, attempt = self.client_of(role), 1
        while True:
            number = self.transcript.record_request(role, request, version)
            try:
                sending = partial(self.transcript.sending, number)
                reply = respondent.client.complete(request, sending=sending)
            except errors.NotNeeded as why:
                self.transcript.broke(number, errors.NotSent(f"not sent: {why}"))
                raise
            except errors.CallDropped as fault:
                self.transcript.broke(number, fault)
                raise fault.why from None
            except ModelFault as fault:
                self.transcript.broke(number, fault)
                wait_s = self.patience.wait_s(fault, attempt=attempt)
                if wait_s is None or isinstance(fault, errors.ParameterRefused):
                    raise
                self.patience.sleep(wait_s)
                attempt += 1
            else:
                cut = find_cut(request, reply, context_tokens=respondent.context_tokens)
                self.transcript.record_reply(number, reply, cut)
                if cut is not None:
                    raise cut
                return reply


def ask_alone(
    who: RespondentClient,
    role: ModelRole,
    messages: Messages,
    reader: Callable[[str], _Read],
    **settings: Any,
) -> _Read:
    """Return what the answer of a model says that plays the only role; `Respondents` has settings.

    Raises:
        errors.ReplyUnreadable, ModelRefused, ModelFault: As `Respondents.read`.
    """
    respondents = Respondents(clients={ModelRole.MODIFIER: who}, **settings)
    answer, _, _ = respondents.read(role, messages, reader)
    return answer
