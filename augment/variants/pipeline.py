"""Read first: from a scene and an instruction to an outcome, along a recipe.

In: a `Recipe`, a `Scene`, an instruction, and who is asked. Out: an `Outcome`; everything else is
in the transcript. Prompt -> answer -> Modification, and back with a review's findings where the
recipe has a review. That loop is the only one of all, bounded by the recipe's rounds. A
review never takes a result away: where it is unusable, or a later round can't be read, what the
modifier made before stands, and the notes say so.

An answer that nobody can read and a refusal are outcomes of the model and count as such; whoever
changes nothing refuses, in a block or in prose; reviews judge that, and see the reason. A
broken wire is nobody's outcome and is raised.
"""

import json
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property, partial

from augment.checks import Ground
from augment.errors import ModelRefused, ReplyUnreadable, ReviewUnusable
from augment.llm.client import ChatClient
from augment.llm.messages import Message, Reply, Speaker, ToolChoice
from augment.prompts import fill
from augment.prompts.blocks import names_changes, refuses
from augment.prompts.calls import Tools, WrittenCall, call_form, calls_in, read_arguments
from augment.prompts.fill import Messages, PromptOptions
from augment.prompts.reply import ReadReply, block_schema, read_intent, read_reply
from augment.prompts.vectors import changes_text
from augment.scene.entities import Modification, Scene
from augment.scene.intent import Intent
from augment.simulation.expected import expect_recording
from augment.variants.pose_tool import PoseTool
from augment.variants.recipes import Recipe
from augment.variants.respondents import (
    ModelRole,
    NoteKind,
    RespondentClient,
    Respondents,
    Transcript,
    ask_alone,
)
from augment.variants.retrieval import LaneTool, RetrievalTool
from augment.variants.reviews import BlockForm, Limits, ReviewedAnswer, Verdict

LEFT_ALONE = "The modifier left the scene as it is and did not say why."
READER_TOKENS = 4096
"""The length limit of an intent reader's answer."""

_LONGEST_NOTED = 500
_TOOLS: dict[Tools, type[LaneTool]] = {Tools.RETRIEVE: RetrievalTool, Tools.POSE_ON_LANE: PoseTool}


class OutcomeStatus(StrEnum):
    """End of a run."""

    DONE = "done"
    UNREADABLE = "unreadable"
    REFUSED = "refused"


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """Result of a variant on one scenario.

    Attributes:
        modification: None unless the status is done.
        notes: What the model said about its own work, and what a review made of it.
        reason: Why there is no modification, empty where there is one.
        is_accepted: What the review said of the modification, None without a usable review.
    """

    status: OutcomeStatus
    modification: Modification | None = None
    notes: str = ""
    reason: str = ""
    is_accepted: bool | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class EditTask:
    """The task of a modifier.

    Attributes:
        scene: The scene before the change.
        instruction: The user's wish in natural language; of a follow-up all wishes so far.
        intent: What a geometric review holds modifications against, where that is stored.
        conversation: What was said up to the wish that it is to meet now; by default it is
            given its task.
    """

    scene: Scene
    instruction: str
    intent: Intent | None = None
    conversation: Messages = ()


def run(recipe: Recipe, task: EditTask, respondents: Respondents) -> Outcome:
    """Let a model modify a scene as the recipe says.

    Args:
        recipe: The variant, within whatever limits, which hold for all who are asked.
        task: The scene and the instruction.
        respondents: Who is asked, and what is handed every raw answer before it is read.

    Raises:
        ModelFault: The wire or the endpoint broke; the same run may succeed later if it says so.
    """
    limits = recipe.limits
    asked = replace(respondents, max_tokens=limits.max_output_tokens, re_asks=limits.re_asks)
    return _Work(recipe=recipe, task=task, respondents=asked).outcome()


def ask_for_intent(
    instruction: str, *, client: ChatClient, model: str, transcript: Transcript
) -> Intent:
    """Return a model's reading of a sentence, the only thing that it is shown.

    What it read counts for nothing until a person has accepted it.

    Raises:
        ReplyUnreadable: Neither the first answer nor the re-asked one fits the schema.
        ModelRefused: The model declined, or its endpoint's filter did.
        ModelFault: The wire broke for good.
        BudgetSpent: The transcript's budget has no room for the next call.
    """
    return ask_alone(
        RespondentClient(client=client, model=model),
        ModelRole.READER,
        fill.reader_messages(instruction),
        read_intent,
        transcript=transcript,
        max_tokens=READER_TOKENS,
    )


def modifier_options(recipe: Recipe, *, native_tools: bool = False) -> PromptOptions:
    """Return the options of a recipe's prompt for the modifier."""
    return PromptOptions(
        lanes=recipe.lane_format,
        tools=recipe.tools,
        is_native=native_tools and recipe.tools is not Tools.NONE,
        radius_m=recipe.limits.radius_m,
        calls=recipe.limits.calls,
        identical=recipe.limits.identical_calls,
    )


# Private


@dataclass(frozen=True, slots=True, kw_only=True)
class _Round:
    """Result of one turn, and its review, None without a usable one."""

    number: int
    read: ReadReply
    verdict: Verdict | None


@dataclass(frozen=True, kw_only=True)
class _Work:
    """One modifier at work on one scene."""

    recipe: Recipe
    task: EditTask
    respondents: Respondents

    @cached_property
    def ground(self) -> Ground:
        """The scene, laid out for the checks once for all rounds."""
        return Ground.of(self.task.scene, expect_recording)

    def outcome(self) -> Outcome:
        """Return the outcome, also of a missing answer."""
        try:
            best, remark = self.modify_and_review()
        except ReplyUnreadable as unreadable:
            reason = "; ".join(unreadable.problems)
            return Outcome(status=OutcomeStatus.UNREADABLE, reason=reason)
        except ModelRefused as refused:
            return Outcome(status=OutcomeStatus.REFUSED, reason=str(refused))
        # After a follow-up an empty block may also take back what was placed before.
        changes_nothing = best.read.modification.is_empty and not self.task.conversation
        if best.read.is_refusal or changes_nothing:
            return Outcome(status=OutcomeStatus.REFUSED, reason=best.read.notes or LEFT_ALONE)
        return Outcome(
            status=OutcomeStatus.DONE,
            modification=best.read.modification,
            notes="\n\n".join(part for part in (best.read.notes, remark) if part),
            is_accepted=None if best.verdict is None else best.verdict.is_accepted,
        )

    def modify_and_review(self) -> tuple[_Round, str]:
        """Return the round that counts, and how it came to, for people; empty without a review.

        Raises:
            ReplyUnreadable: The modifier's first round can't be read.
            ModelRefused: The modifier declined in its first round.
            ModelFault: The wire broke for good.
        """
        note = self.respondents.transcript.note
        native = self.respondents.client_of(ModelRole.MODIFIER).native_tools
        options = modifier_options(self.recipe, native_tools=native)
        messages = self.task.conversation or fill.modifier_messages(
            self.task.scene, self.task.instruction, options
        )
        rounds: list[_Round] = []
        while True:
            number, fault = len(rounds) + 1, ""
            try:
                read, messages = self._draft(messages, options)
            except (ReplyUnreadable, ModelRefused) as unusable:
                if not rounds:
                    raise
                note(NoteKind.ROUND, {"round": number, "fault": str(unusable)})
                fault = f"Round {number} brought no modification: {unusable}"
                break
            if self.recipe.review is None:
                return _Round(number=1, read=read, verdict=None), ""
            changes = changes_text(self.task.scene, read.modification)
            note(NoteKind.ROUND, {"round": number, "changes": changes, "mended": read.mended})
            verdict, fault = self._review(read, rounds)
            rounds.append(_Round(number=number, read=read, verdict=verdict))
            if verdict is None or verdict.is_accepted or number >= self.recipe.rounds:
                break
            messages = fill.regenerate_messages(
                messages, verdict.feedback, is_measured=verdict.is_measured
            )
        return self._choose_round(rounds, fault)

    def _draft(self, messages: Messages, options: PromptOptions) -> tuple[ReadReply, Messages]:
        """Return one answer, read, and the conversation up to and including it."""
        reply = None
        if options.tools is not Tools.NONE:
            messages, reply = self._ask_with_tool(messages, options)
        scene, radius_m = self.task.scene, self.recipe.limits.radius_m
        schema, sections = None, ""
        if self.recipe.limits.block is BlockForm.SCHEMA:
            reply = reply or self.respondents.ask(ModelRole.MODIFIER, messages)
            if not refuses(reply.text):
                messages, sections = fill.block_messages(messages, reply.text), reply.text
                schema, reply = block_schema(scene, radius_m=radius_m), None
        read, asked_messages, answer = self.respondents.read(
            ModelRole.MODIFIER,
            messages,
            partial(read_reply, scene=scene, radius_m=radius_m, sections=sections),
            again=fill.re_ask_messages,
            tools=fill.list_native_tools(options),
            reply=reply,
            schema=schema,
        )
        return read, (*asked_messages, fill.model_message(answer.text))

    def _ask_with_tool(self, messages: Messages, options: PromptOptions) -> tuple[Messages, Reply]:
        """Return the conversation with all calls and their results, and the reply without calls.

        A model that goes on calling when its calls are used up gets no more results: what it
        said is its answer then.
        """
        calls = _ToolCalls(
            name=options.tools,
            tool=_TOOLS[options.tools](self.task.scene, options.radius_m),
            limits=self.recipe.limits,
            transcript=self.respondents.transcript,
        )
        while True:
            is_over = calls.is_over
            reply = self.respondents.ask(
                ModelRole.MODIFIER,
                messages,
                tools=fill.list_native_tools(options),
                tool_choice=ToolChoice.NONE if is_over else ToolChoice.AUTO,
            )
            turns = () if is_over else calls.turns(reply, native=options.is_native)
            if not turns:
                return messages, reply
            messages += turns

    def _review(self, read: ReadReply, rounds: list[_Round]) -> tuple[Verdict | None, str]:
        """Return the verdict, or None and why there is none."""
        review = self.recipe.review
        assert review is not None
        answer = ReviewedAnswer(
            ground=self.ground,
            instruction=self.task.instruction,
            modification=read.modification,
            respondents=self.respondents,
            limits=self.recipe.limits,
            earlier=rounds[-1].read.modification if rounds else None,
            told=tuple(
                entry for draft in rounds if draft.verdict for entry in draft.verdict.feedback
            ),
            intent=self.task.intent,
            refusal=read.notes if read.modification.is_empty else "",
        )
        head: dict[str, object] = {"round": len(rounds) + 1, "review": review.name}
        note = partial(self.respondents.transcript.note, NoteKind.REVIEW)
        try:
            verdict = review.judge(answer)
        except ReviewUnusable as unusable:
            note(head | {"unusable": unusable.reason})
            return None, str(unusable)
        note(head | verdict.document)
        return verdict, ""

    def _choose_round(self, rounds: list[_Round], fault: str) -> tuple[_Round, str]:
        """Return the round that counts, and a remark about it.

        That is the best reviewed one, of equals the last. An unreviewed last round came after all
        the feedback and counts.
        """
        best = rounds[-1]
        if best.verdict is not None:
            best = max(
                rounds,
                key=lambda draft: (draft.verdict.score if draft.verdict else (), draft.number),
            )
        accepted, judgement = None, ""
        if best.verdict is not None:
            accepted, judgement = best.verdict.is_accepted, f": {best.verdict.summary}"
        count = len(rounds)
        self.respondents.transcript.note(
            NoteKind.KEPT,
            {"round": best.number, "rounds": count, "accepted": accepted, "remark": fault},
        )
        remark = f"{self.recipe.title}: round {best.number} of {count} counts{judgement}."
        if accepted is False:
            remark += " No round was accepted."
        return best, f"{remark} {fault.rstrip('.')}." if fault else remark


@dataclass(slots=True, kw_only=True)
class _ToolCalls:
    """Answers the calls of one round and keeps count.

    Calls come in two forms: a line of JSON in the answer (for every model, as the paper
    describes it) and natively (where a model's abilities say so). Limits, faults and results are
    the same in both; every fault goes back to the model as text.

    Attributes:
        is_over: Whether a call was one too many: none is answered after it.
    """

    name: Tools
    tool: LaneTool
    limits: Limits
    transcript: Transcript
    is_over: bool = False
    earlier: list[object] = field(default_factory=list)

    def turns(self, reply: Reply, *, native: bool) -> Messages:
        """Return the answer with its calls and their results, empty where it calls nothing."""
        # Models that are offered native calls write them into their answers as well.
        if native and reply.tool_calls:
            return self._native_turns(reply)
        results: list[str] = []
        calls = calls_in(reply.text, self.name, is_cut_off=reply.is_cut_off)
        if not (calls or names_changes(reply.text)):
            problem = "calls are not made natively here; a call is one line of the form "
            problem += call_form(self.name)
            calls = tuple(WrittenCall(name=c.name, problem=problem) for c in reply.tool_calls)
        for call in calls:
            results.append(self._answer(call))
            if self.is_over:
                break
        if not results:
            return ()
        result = fill.result_text(results, is_over=self.is_over)
        return fill.model_message(reply.text), fill.make_user_message(result)

    def _native_turns(self, reply: Reply) -> Messages:
        """Return the calls as they came and one message for each: all must have a result."""
        echoes, results = [], []
        for call in reply.tool_calls:
            written = replace(read_arguments(call.arguments), name=call.name)
            # Servers that read the arguments of what comes back break on what is no JSON.
            is_object = isinstance(written.arguments, dict)
            echoes.append(call if is_object else replace(call, arguments="{}"))
            result = self._answer(written)
            results.append(Message(speaker=Speaker.TOOL, text=result, answers=call.id))
        echo = Message(
            speaker=Speaker.ASSISTANT, text=reply.text, calls=tuple(echoes), extra=reply.extra
        )
        return echo, *results

    def _answer(self, call: WrittenCall) -> str:
        """Return the result of a call as JSON: a pose, or {"error": a sentence}."""
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

    def _result(self, call: WrittenCall) -> object:
        signature, most = (call.name, call.arguments, call.problem), self.limits
        problem = call.problem
        if self.is_over:
            problem = "no call is answered any more. Answer with what you have."
        elif len(self.earlier) >= most.calls:
            self.is_over = True
            problem = f"no call is left: {most.calls} are allowed. Answer with what you have."
        elif self.earlier.count(signature) >= most.identical_calls:
            self.is_over = True
            problem = f"this was answered {most.identical_calls} times. Answer with what you have."
        elif not problem and call.name != self.name:
            problem = f"there is no function {call.name[:40]!r}; there is {self.name}"
        if not self.is_over:
            self.earlier.append(signature)
        return {"error": problem} if problem else self.tool.answer(call.arguments)
