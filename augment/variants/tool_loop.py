"""The modifier and its tool: calls are answered until there is an answer, or no call is left.

Two forms: a line of JSON in the answer (for every model, as the paper describes it) and native
calls (where a model's abilities say so). Limits, faults and results are the same in both; every
fault goes back to the model as text.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field

from augment.errors import ToolError
from augment.llm.messages import Message, Reply, Speaker, ToolCall, ToolChoice
from augment.prompts import fill
from augment.prompts.calls import TOOL, WrittenCall, calls_in, read_arguments
from augment.prompts.fill import Calling, model_message, said_by_user
from augment.variants.pose_call import CallLimits
from augment.variants.pose_tool import PoseTool
from augment.variants.respondents import Messages, Respondents
from augment.variants.transcript import ModelRole, NoteKind, Transcript

_LONGEST_NOTED = 500


@dataclass(slots=True, kw_only=True)
class ToolDesk:
    """Answers the calls of one round and keeps count.

    Attributes:
        is_over: Whether a call was one too many: none is answered after it.
    """

    tool: PoseTool
    limits: CallLimits
    transcript: Transcript
    is_over: bool = False
    earlier: list[object] = field(default_factory=list)

    def answer(self, call: WrittenCall) -> str:
        """The result of a call as JSON: a pose, or {"error": a sentence}."""
        result = self._result(call)
        self.transcript.note(
            NoteKind.TOOL_CALL,
            {
                "tool": call.name[:_LONGEST_NOTED],
                "arguments": json.dumps(call.arguments)[:_LONGEST_NOTED],
                "understood": not call.problem,
                "mended": call.mended,
                "result": result,
            },
        )
        return json.dumps(result, separators=(",", ":"))

    def _result(self, call: WrittenCall) -> dict[str, object]:
        asked = (call.name, call.arguments, call.problem)
        try:
            if self.is_over:
                raise ToolError(TOOL, "no call is answered any more. Answer with what you have.")
            try:
                self.limits.check(self.earlier, asked)
            except ToolError:
                self.is_over = True
                raise
        except ToolError as refused:
            return {"error": refused.problem}
        self.earlier.append(asked)
        if call.problem:
            return {"error": call.problem}
        if call.name != TOOL:
            return {"error": f"there is no function {call.name[:40]!r}; there is {TOOL}"}
        return self.tool.answer(call.arguments)


def ask_with_tool(
    respondents: Respondents,
    messages: Messages,
    *,
    desk: ToolDesk,
    calling: Calling,
    max_tokens: int,
) -> tuple[Messages, Reply]:
    """The conversation with all calls and their results, and the reply that calls nothing.

    A model that goes on calling when its calls are used up gets no more results: what it said is
    its answer then.

    Raises:
        ModelRefused: The model declined, or its endpoint's filter did.
        ModelFault: The wire broke for good.
    """
    native = calling is Calling.NATIVE
    tools = (fill.pose_tool(),) if native else ()
    while True:
        choice = ToolChoice.NONE if desk.is_over else ToolChoice.AUTO
        reply = respondents.ask(
            ModelRole.MODIFIER, messages, max_tokens=max_tokens, tools=tools, tool_choice=choice
        )
        if desk.is_over:
            return messages, reply
        # Models that are offered native calls write them into their answers as well.
        more = (native and _native_turns(reply, desk)) or _written_turns(reply, desk)
        if not more:
            return messages, reply
        messages += more


def _written_turns(reply: Reply, desk: ToolDesk) -> Messages:
    """The answer with its calls and the program's message, empty where it calls nothing."""
    calls = calls_in(reply.text, is_cut_off=reply.is_cut_off)
    results: list[str] = []
    for call in calls:
        results.append(desk.answer(call))
        if desk.is_over:
            break
    if not results:
        return ()
    results_message = said_by_user(fill.result_text(results, is_over=desk.is_over))
    return model_message(reply.text), results_message


def _native_turns(reply: Reply, desk: ToolDesk) -> Messages:
    """The calls as they came and one message for each: every call must have its result."""
    if not reply.tool_calls:
        return ()
    read = [read_arguments(call.arguments) for call in reply.tool_calls]
    answer = Message(
        speaker=Speaker.ASSISTANT,
        text=reply.text,
        calls=tuple(_echo(call, one) for call, one in zip(reply.tool_calls, read, strict=True)),
    )
    results = []
    for call, one in zip(reply.tool_calls, read, strict=True):
        written = WrittenCall(name=call.name, arguments=one.arguments, problem=one.problem)
        result = desk.answer(written)
        results.append(Message(speaker=Speaker.TOOL, text=result, answers=call.id))
    return answer, *results


def _echo(call: ToolCall, read: WrittenCall) -> ToolCall:
    """The call as it goes back: servers that read its arguments break on what is no JSON."""
    if isinstance(read.arguments, dict):
        return call
    return ToolCall(id=call.id, name=call.name, arguments="{}", extra=call.extra)
