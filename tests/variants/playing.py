"""One run of any recipe, with everything that it did in a transcript that lives as long."""

import json
import random
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

from augment.errors import ModelFault
from augment.fake_llm.server import FakeServer
from augment.llm.client import Patience
from augment.llm.messages import Reply, Request, ToolCall
from augment.llm.openai_wire import OpenAIWire
from augment.scene.entities import Scene
from augment.scene.intent import Intent
from augment.variants.pipeline import EditTask, Outcome, run
from augment.variants.recipes import Recipe, find_recipe
from augment.variants.respondents import (
    ModelRole,
    NoteKind,
    RespondentClient,
    Respondents,
    Transcript,
)
from augment.variants.reviews import BlockForm
from tests.llm.scripted import ScriptedClient
from tests.scenes import scene


@dataclass(slots=True)
class RecordedCall:
    number: int
    role: ModelRole
    request: Request
    prompt_version: str
    reply: Reply | None = None
    fault: ModelFault | None = None


@dataclass(frozen=True, slots=True)
class RecordedNote:
    kind: NoteKind
    document: dict[str, object]


@dataclass(slots=True)
class MemoryTranscript:
    """Calls are numbered from 1."""

    calls: list[RecordedCall] = field(default_factory=list)
    notes: list[RecordedNote] = field(default_factory=list)

    def cached_reply(self, role: ModelRole, request: Request, prompt_version: str) -> Reply | None:
        return None

    def record_request(self, role: ModelRole, request: Request, prompt_version: str) -> int:
        self.calls.append(RecordedCall(len(self.calls) + 1, role, request, prompt_version))
        return len(self.calls)

    def sending(self, number: int) -> None:
        pass

    def record_reply(self, number: int, reply: Reply, fault: ModelFault | None = None) -> None:
        self.calls[number - 1].reply = reply
        self.calls[number - 1].fault = fault

    def broke(self, number: int, fault: ModelFault) -> None:
        self.calls[number - 1].fault = fault

    def note(self, kind: NoteKind, document: dict[str, object]) -> None:
        self.notes.append(RecordedNote(kind, document))


def agent(**changes: object) -> dict[str, object]:
    made: dict[str, object] = {
        "id": "Agent2", "type": "VEHICLE", "x_m": 21.4, "y_m": 0.9, "heading_rad": 0.0,
        "width_m": 2.0, "length_m": 4.8, "speed_mps": 0.0, "lane": "Lane1",
    }  # fmt: skip
    return {key: value for key, value in (made | changes).items() if value is not ...}


def block(*added: dict[str, object], **changes: object) -> str:
    return json.dumps({"add": list(added), "move": [], "remove": []} | changes)


def answer(json_block: str) -> str:
    return f"""Insights: One road, two lanes.

Summary: A parked car ahead.

Modification Dict: {{"Action": "add", "Modified_Agent": "Agent2"}}

Modification Calculations:
Step 1: 21.4 m ahead of the ego.

Modified Vectors:
```json
{json_block}
```
"""


GOOD = answer(block(agent()))


WISH = "Add a parked car 21.4 m ahead."
Script = Iterable[str | Reply | ModelFault]
Others = Mapping[ModelRole, RespondentClient]


def play(
    recipe: Recipe,
    task: EditTask,
    modifier: RespondentClient,
    transcript: Transcript,
    others: Others | None = None,
) -> Outcome:
    """A run that waits for nothing."""
    asked = Respondents(
        clients={**(others or {}), ModelRole.MODIFIER: modifier},
        transcript=transcript,
        patience=Patience(sleep=lambda _: None, rng=random.Random(0)),
    )
    return run(recipe, task, asked)


@contextmanager
def stand_in_model(
    server: FakeServer, model: str, *, native: bool = False, timeout_s: float = 60.0
) -> Iterator[RespondentClient]:
    """A model of the stand-in over HTTP."""
    with OpenAIWire(base_url=server.url, api_key=None, timeout_s=timeout_s) as client:
        yield RespondentClient(client=client, model=model, native_tools=native)


class Play:
    def __init__(
        self,
        variant: str,
        script: Script,
        *,
        shown: Scene | None = None,
        native: bool = False,
        others: Others | None = None,
        intent: Intent | None = None,
        block: BlockForm = BlockForm.TEXT,
    ) -> None:
        self.client = ScriptedClient(script)
        self.transcript = MemoryTranscript()
        recipe = find_recipe(variant)
        self.outcome = play(
            replace(recipe, limits=replace(recipe.limits, block=block)),
            EditTask(scene=shown or scene(), instruction=WISH, intent=intent),
            RespondentClient(client=self.client, model="m", native_tools=native),
            self.transcript,
            others,
        )

    @property
    def roles(self) -> str:
        """The first letter of each call's role, in order."""
        return "".join(call.role[0] for call in self.transcript.calls)

    @property
    def x_m(self) -> float:
        """Where the first added agent of the outcome is."""
        return self.outcome.modification.added[0].x_m

    def notes(self, kind: str) -> list[dict[str, object]]:
        return [note.document for note in self.transcript.notes if note.kind == kind]


def car(x_m: float, **changes: object) -> str:
    """A readable answer with one car."""
    return answer(block(agent(**({"x_m": x_m, "y_m": 0.0} | changes))))


def rating(compliance: object, realism: object, logic: object, *feedback: str) -> str:
    ratings = {"compliance": compliance, "realism": realism, "logical_consistency": logic}
    return _fenced({"ratings": ratings, "feedback": [_correction(one) for one in feedback]})


def questions(count: int = 3) -> str:
    return _fenced({"questions": [f"Where is Agent{n}?" for n in range(2, 2 + count)]})


def verdict(*feedback: str, said: str | None = None) -> str:
    word = said or ("feedback" if feedback else "accept")
    return _fenced({"verdict": word, "feedback": [_correction(one) for one in feedback]})


def call(name: str = "pose_on_lane", **arguments: object) -> str:
    given = {"lane": "Lane1", "start": "Agent1", "distance_m": 21.4} | arguments
    return json.dumps({"call": name, "arguments": given})


def native(*arguments: str, name: str = "pose_on_lane", extra: str = "") -> Reply:
    calls = tuple(
        ToolCall(id=f"c{n}", name=name, arguments=one, extra=extra)
        for n, one in enumerate(arguments)
    )
    return Reply(text="", finish_reason="tool_calls", tool_calls=calls)


def _fenced(document: object) -> str:
    return f"Done.\n```json\n{json.dumps(document)}\n```\n"


def _correction(problem: str) -> dict[str, str]:
    return {"problem": problem, "reason": "Because.", "corrective_action": "Move it."}
