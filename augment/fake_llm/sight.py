"""What the stand-in makes of a request: its role, the scene and the wish, results and feedback.

English it does not read: what the wish asks for it looks up by the wish's text, where it was
given such a list. All else comes from the request alone.
Frame: ego frame.
"""

import json
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from augment.fake_llm.wire import ChatRequest, SpokenMessage
from augment.geometry.frames import difference
from augment.geometry.polyline import Polyline
from augment.prompts.fill import QUOTE, read_text
from augment.prompts.vectors import curve_from
from augment.scene import entities
from augment.scene.intent import Intent
from augment.variants.respondents import ModelRole

Intents = Callable[[str], Intent | None]
"""What an instruction asks for, looked up by its text."""

_FINE_M = 0.5
_SHORTEST_PIECE_M = 1.0
_JOINT_M = 0.1
_RESULT = read_text("function_result.md").partition("\n")[0]
_FEEDBACK = tuple(
    read_text(name).partition("{{")[0].strip() for name in ("feedback.md", "measured.md")
)
_OPENINGS = {read_text(f"{role}.md").partition("\n")[0]: role for role in ModelRole}


class NothingSeen(Exception):
    """The messages hold no scene with a wish that can be read; the text says what is missing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """What somebody is asked to do.

    Attributes:
        prompt: The text that it was read from.
        first_new: The number of the first new agent.
        intent: What the instruction asks for, None where that is not known.
    """

    prompt: str
    scene: entities.Scene
    instruction: str
    first_new: int
    intent: Intent | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Heard:
    """A conversation, understood.

    Attributes:
        role: Whom it is asked to be.
        may_call: Whether it can have a function called now.
        is_native: Whether natively.
        results: Of the calls since the last feedback, in order; None for one that failed.
        called: Whether it has called anything since then.
        feedback: What reviews sent back so far.
    """

    role: ModelRole
    may_call: bool
    is_native: bool
    results: tuple[dict[str, Any] | None, ...]
    called: bool
    feedback: tuple[str, ...]


def knows_nothing(instruction: str) -> Intent | None:
    """Look an instruction up in an empty list."""
    return None


def same_text(instruction: str) -> str:
    """Return an instruction as it is compared: prompts quote it without outer space."""
    return " ".join(instruction.split())


def task_of(messages: Sequence[SpokenMessage], intents: Intents = knows_nothing) -> Task:
    """Return the task in the first message of a user that holds one.

    Raises:
        NothingSeen: None does.
    """
    for message in messages:
        if message.role == "user" and "\nAgents:\n" in message.text:
            try:
                task = _task(message.text)
            except (ValueError, TypeError, KeyError, IndexError) as error:
                raise NothingSeen(f"the scene can't be read ({type(error).__name__})") from None
            return replace(task, intent=intents(task.instruction))
    raise NothingSeen("no message of a user holds a scene")


def instruction_in(messages: Sequence[SpokenMessage]) -> str:
    """Return the quoted wish in the first message of a user that holds one.

    Raises:
        NothingSeen: None does.
    """
    text = next((m.text for m in messages if m.role == "user" and "<instruction>" in m.text), "")
    quoted = re.search(r"^<instruction>\n(.*?)\n</instruction>$", text, re.DOTALL | re.MULTILINE)
    if quoted is None:
        raise NothingSeen("there is no instruction")
    return "\n".join(line.removeprefix(QUOTE) for line in quoted.group(1).split("\n"))


def read_conversation(request: ChatRequest) -> Heard:
    """Return what the conversation says about the answer that is due; by default a modifier's."""
    messages = request.messages
    system = next((message.text for message in messages if message.role == "system"), "")
    told = [
        number
        for number, message in enumerate(messages)
        if message.role == "user" and message.text.startswith(_FEEDBACK)
    ]
    results: list[dict[str, Any] | None] = []
    called = False
    for message in messages[max(told, default=0) :]:
        is_written = message.text.startswith(_RESULT)
        called |= message.role == "tool" or is_written
        if message.role == "tool":
            results.append(_result(message.text))
        elif message.role == "user" and is_written:
            lines = re.findall(r"^[0-9]+\. (\{.*\})$", message.text, re.MULTILINE)
            results += map(_result, lines)
    last, native = messages[-1].text, request.tools is not None
    offered = request.tool_choice != "none" if native else '{"call": "pose_on_lane"' in system
    over = read_text("calls_are_over.md") in last
    asked_again = last.startswith(read_text("re_ask.md").partition("\n")[0])
    return Heard(
        role=_OPENINGS.get(system.partition("\n")[0], ModelRole.MODIFIER),
        may_call=offered and not over and not asked_again,
        is_native=native,
        results=tuple(results),
        called=called,
        feedback=tuple(messages[number].text for number in told),
    )


def list_of(text: str, title: str) -> dict[str, list[Any]]:
    """Return the JSON object under a heading.

    Raises:
        ValueError: There is none.
    """
    start = text.index(f"\n{title}:\n") + len(title) + 3
    vectors, _ = json.JSONDecoder().raw_decode(text, start)
    return dict(vectors)


def agent_of(name: str, vector: Sequence[Any]) -> entities.TrafficAgent:
    """Return the agent that a vector of the prompt describes."""
    kind, *numbers, lane = vector
    names = ("x_m", "y_m", "heading_rad", "width_m", "length_m", "speed_mps")
    fields: dict[str, Any] = dict(zip(names, map(float, numbers), strict=True))
    lane_id = None if lane is None else str(lane)
    return entities.TrafficAgent(id=name, type=entities.AgentType(kind), lane_id=lane_id, **fields)


# Private


def _result(written: str) -> dict[str, Any] | None:
    try:
        result = json.loads(written)
    except ValueError:
        return None
    return None if not isinstance(result, dict) or "error" in result else result


@lru_cache(maxsize=64)
def _task(text: str) -> Task:
    """Read the task; remembered, because a conversation brings it again with every call."""
    agents = [agent_of(name, vector) for name, vector in list_of(text, "Agents").items()]
    side = re.search(r"^Traffic drives on the (left|right)-hand side", text, re.MULTILINE)
    first_new = re.search(r"^The first new agent is Agent(\d+)\.$", text, re.MULTILINE)
    if side is None or first_new is None:
        raise NothingSeen("the side of the road or the first new agent is not named")
    lanes = tuple(
        entities.Lane(id=name, centerline=_line(vector[-1]), width_m=float(vector[3]))
        for name, vector in list_of(text, "Lanes").items()
    )
    connectors = tuple(
        entities.LaneConnector(
            id=name,
            from_lane=before,
            to_lane=after,
            centerline=_line(points),
            width_m=float(width),
            turn_type=entities.TurnType(turn),
        )
        for name, (before, after, _, turn, width, _, points) in list_of(
            text, "Lane connectors"
        ).items()
    )
    areas = tuple(
        entities.Area(
            id=name,
            kind=entities.AreaKind(kind),
            boundary_m=tuple((float(x), float(y)) for x, y in ring),
        )
        for name, (kind, ring) in list_of(text, "Areas").items()
    )
    scene = entities.Scene(
        name="seen",
        ego=next(agent for agent in agents if agent.type is entities.AgentType.EGO_VEHICLE),
        traffic_side=entities.TrafficSide(side.group(1)),
        origin=entities.Origin(frame="prompt", x_m=0.0, y_m=0.0, heading_rad=0.0),
        provenance="read from a prompt",
        agents=tuple(
            agent for agent in agents if agent.type is not entities.AgentType.EGO_VEHICLE
        ),
        lanes=tuple(_joined(lane, lanes) for lane in lanes),
        connectors=connectors,
        areas=areas,
    )
    wish = instruction_in([SpokenMessage(role="user", content=text)])
    return Task(prompt=text, scene=scene, instruction=wish, first_new=int(first_new.group(1)))


def _line(coordinates: list[Any]) -> Polyline:
    """Return a centreline from points, or from the control points of Bezier pieces."""
    if not isinstance(coordinates[0][0], list):
        return _smooth(np.array(coordinates, dtype=np.float64))
    pieces = []
    for control in coordinates:
        curve = curve_from(control)
        count = max(2, math.ceil(curve.length_m / _FINE_M) + 1)
        pieces.append(curve.points(curve.parameters_at(np.linspace(0.0, curve.length_m, count))))
    return Polyline(np.vstack([pieces[0], *(piece[1:] for piece in pieces[1:])]))


def _smooth(points: NDArray[np.float64]) -> Polyline:
    """Return a curve through points (P, 2) a few metres apart, as a fine line."""
    from scipy.interpolate import CubicSpline

    if len(points) > 2 and np.hypot(*(points[-1] - points[-2])) < _SHORTEST_PIECE_M:
        # The direction of a very short last piece is mostly rounding.
        points = np.delete(points, -2, axis=0)
    coarse = Polyline(points)
    if len(points) == 2:
        return coarse
    stations = coarse.stations_m
    at = np.unique(np.concatenate([np.arange(0.0, stations[-1], _FINE_M), stations]))
    return Polyline(CubicSpline(stations, coarse.points_m)(at))


def _joined(lane: entities.Lane, lanes: tuple[entities.Lane, ...]) -> entities.Lane:
    """Return the lane with its neighbours and successors, which no list of the prompt names."""
    line = lane.centerline
    middle, end = line.pose_at(line.length_m / 2.0), line.points_m[-1]
    beside: dict[float, str] = {}
    following = []
    for other in lanes:
        if other is lane:
            continue
        if float(np.hypot(*(other.centerline.points_m[0] - end))) < _JOINT_M:
            following.append(other.id)
        place = other.centerline.project(middle.x_m, middle.y_m)
        width = (lane.width_m + other.width_m) / 2.0
        turn = difference(other.centerline.heading_at(place.s_m), middle.heading_rad)
        # Seen from the other lane this one lies on the far side.
        side = -math.copysign(1.0, place.d_m)
        if abs(abs(place.d_m) - width) < 0.4 * width and abs(turn) < 0.5:
            beside.setdefault(side, other.id)
    return replace(
        lane,
        left_neighbor=beside.get(1.0),
        right_neighbor=beside.get(-1.0),
        successors=tuple(following),
    )
