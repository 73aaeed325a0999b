"""Stand-in's understanding of a request: its role, the task, results and feedback.

It reads neither English nor maps: it looks the wish's text up in the list that it was given, and
finds there the scene and what is asked for. All else comes from the request alone.
Frame: ego frame.
"""

import json
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from augment.fake_llm.wire import ChatRequest
from augment.prompts.calls import PARAMETERS, Tools
from augment.prompts.fill import QUOTE, read_text
from augment.prompts.vectors import LaneFormat, scene_text, short_names, with_short_ids
from augment.scene.entities import AgentType, Scene, TrafficAgent
from augment.scene.intent import Intent
from augment.scene.planned_motion import MOTION
from augment.variants.respondents import ModelRole

_NUMBERS = ("x_m", "y_m", "heading_rad", "width_m", "length_m", "speed_mps")

KnownTasks = Callable[[str], Sequence[tuple[Scene, Intent]]]
"""Scenes that an instruction is put to, each with what it asks for, looked up by its text."""

_RESULT = read_text("function_result.md").partition("\n")[0]
_FEEDBACK = tuple(
    read_text(name).partition("{{")[0].strip() for name in ("feedback.md", "measured.md")
)
_OPENINGS = {read_text(f"{role}.md").partition("\n")[0]: role for role in ModelRole}
_INSTRUCTION = re.compile(r"^<instruction>\n(.*?)\n</instruction>$", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """Task of a role.

    Attributes:
        prompt: The text that it was found by; of a follow-up that of the first task as well.
        scene: With the short ids of the prompt.
    """

    prompt: str
    scene: Scene
    intent: Intent


@dataclass(frozen=True, slots=True, kw_only=True)
class Heard:
    """A conversation, understood.

    Attributes:
        role: Whom it is asked to be.
        task: None where the list does not know the wish.
        tool: The function that it was told of.
        may_call: Whether it can have that called now.
        is_native: Whether natively.
        results: Of the calls since the last wish or feedback, in order: x, y and heading, None for
            a call that failed.
        called: Whether it has called anything since then.
        feedback: What reviews sent back since the last wish.
        seed: That the request names.
    """

    role: ModelRole
    task: Task | None
    tool: Tools
    may_call: bool
    is_native: bool
    results: tuple[list[float] | None, ...]
    called: bool
    feedback: tuple[str, ...]
    seed: int | None

    @property
    def all_told(self) -> str:
        """The prompt and all feedback: a new round is a new throw of the dice."""
        return "\n".join([self.task.prompt if self.task else "", *self.feedback])


def knows_nothing(instruction: str) -> Sequence[tuple[Scene, Intent]]:
    """Look an instruction up in an empty list."""
    return ()


def same_text(instruction: str) -> str:
    """Return an instruction as it is compared: prompts quote it without outer space."""
    return " ".join(instruction.split())


def read_conversation(request: ChatRequest, tasks: KnownTasks = knows_nothing) -> Heard:
    """Return the due answer's task and feedback; by default a modifier's."""
    messages = request.messages
    system = next((message.text for message in messages if message.role == "system"), "")
    user_texts = [
        (n, message.text) for n, message in enumerate(messages) if message.role == "user"
    ]
    last_wish = max((n for n, text in user_texts if _INSTRUCTION.search(text)), default=0)
    reviews = [n for n, text in user_texts if n > last_wish and text.startswith(_FEEDBACK)]
    results: list[list[float] | None] = []
    called = False
    for message in messages[max(reviews, default=last_wish) :]:
        is_written = message.text.startswith(_RESULT)
        called |= message.role == "tool" or is_written
        if message.role == "tool":
            results.append(_result(message.text))
        elif message.role == "user" and is_written:
            lines = re.findall(r"^[0-9]+\. ([\[{].*[\]}])$", message.text, re.MULTILINE)
            results += map(_result, lines)
    last, native = messages[-1].text, request.tools is not None
    told_of = json.dumps(request.tools) if native else system
    tool = next((name for name in PARAMETERS if f'"{name}"' in told_of), Tools.NONE)
    offered = tool is not Tools.NONE and request.tool_choice != "none"
    over = read_text("calls_are_over.md") in last
    asked_again = last.startswith(read_text("re_ask.md").partition("\n")[0])
    return Heard(
        role=_OPENINGS.get(system.partition("\n")[0], ModelRole.MODIFIER),
        task=_task(request, tasks),
        tool=tool,
        may_call=offered and not over and not asked_again,
        is_native=native,
        results=tuple(results),
        called=called,
        feedback=tuple(messages[number].text for number in reviews),
        seed=request.seed,
    )


def read_changed_agents(prompt: str) -> list[TrafficAgent]:
    """Return the agents that a prompt lists as added, then those that it lists as moved."""
    vectors: dict[str, list[Any]] = {}
    for title in ("\nAdded agents:\n", "\nMoved agents:\n"):
        vectors |= json.JSONDecoder().raw_decode(prompt, prompt.index(title) + len(title))[0]
    changed = []
    for name, (kind, *values) in vectors.items():
        made: dict[str, Any] = dict(zip(_NUMBERS, map(float, values[:6]), strict=True))
        lane, *last = values[6:]
        if last and isinstance(last[0], dict):
            made["motion"] = MOTION.shape.validate_python(last[0])
        changed.append(TrafficAgent(id=name, type=AgentType(kind), lane_id=lane, **made))
    return changed


# Private


def _task(request: ChatRequest, known: KnownTasks) -> Task | None:
    """Return the task of the last wish that a user has said.

    Where the list puts the wish to several scenes, the one that the first wish's message shows
    counts.
    """
    texts = [message.text for message in request.messages if message.role == "user"]
    wishes = [text for text in texts if _INSTRUCTION.search(text)]
    if not wishes:
        return None
    prompt = "\n".join(dict.fromkeys((wishes[0], wishes[-1])))
    lines = _INSTRUCTION.findall(wishes[-1])[-1].split("\n")
    tasks = known(same_text("\n".join(line.removeprefix(QUOTE) for line in lines)))
    if len(tasks) > 1:
        forms = [(task, scene_text(task[0], lanes=form)) for task in tasks for form in LaneFormat]
        tasks = [task for task, text in forms if text in prompt] or tasks
    if not tasks:
        return None
    scene, intent = tasks[0]
    scene = with_short_ids(scene, short_names(scene))
    return Task(prompt=prompt, scene=scene, intent=intent)


def _result(written: str) -> list[float] | None:
    """Return the pose that either function gave, None for anything else."""
    try:
        result = json.loads(written)
        if isinstance(result, dict):
            result = [result[name] for name in ("x_m", "y_m", "heading_rad")]
        return [float(value) for value in result]
    except (ValueError, TypeError, KeyError):
        return None
