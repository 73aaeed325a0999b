"""What the stand-in sees: the scene and the wish, read back out of a request's messages.

English it does not read: what the wish asks for it looks up by the wish's text, where it was
given such a list. All else comes from the request alone.
Frame: ego frame.
"""

from __future__ import annotations

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
from augment.scene.entities import (
    AgentType,
    Area,
    AreaKind,
    Lane,
    LaneConnector,
    Origin,
    Scene,
    TrafficAgent,
    TrafficSide,
    TurnType,
)
from augment.scene.intent import Intent
from augment.variants.respondents import ModelRole

_FINE_M = 0.5
_SHORTEST_PIECE_M = 1.0
_JOINT_M = 0.1

Vectors = dict[str, list]  # type: ignore[type-arg]


Intents = Callable[[str], Intent | None]
"""What an instruction asks for, looked up by its text."""


def knows_nothing(instruction: str) -> Intent | None:
    """The list of who was given none."""
    return None


def same_text(instruction: str) -> str:
    """An instruction as it is compared: prompts quote it line by line, without outer space."""
    return " ".join(instruction.split())


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
    scene: Scene
    instruction: str
    first_new: int
    intent: Intent | None = None


def task_of(messages: Sequence[SpokenMessage], intents: Intents = knows_nothing) -> Task:
    """The task in the first message of a user that holds one.

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


def smooth(points_m: NDArray[np.float64]) -> Polyline:
    """A curve through points (P, 2) a few metres apart, as a fine line."""
    from scipy.interpolate import CubicSpline

    points = np.asarray(points_m, dtype=np.float64)
    if len(points) > 2 and np.hypot(*(points[-1] - points[-2])) < _SHORTEST_PIECE_M:
        # The direction of a very short last piece is mostly rounding.
        points = np.delete(points, -2, axis=0)
    coarse = Polyline(points)
    if len(points) == 2:
        return coarse
    stations = coarse.stations_m
    at = np.unique(np.concatenate([np.arange(0.0, stations[-1], _FINE_M), stations]))
    return Polyline(CubicSpline(stations, coarse.points_m)(at))


@lru_cache(maxsize=64)
def _task(text: str) -> Task:
    """The task in a text; remembered, because a conversation brings it again with every call."""
    agents = [agent_of(name, vector) for name, vector in list_of(text, "Agents").items()]
    lanes = tuple(_lane(name, vector) for name, vector in list_of(text, "Lanes").items())
    side = re.search(r"^Traffic drives on the (left|right)-hand side", text, re.MULTILINE)
    first_new = re.search(r"^The first new agent is Agent(\d+)\.$", text, re.MULTILINE)
    if side is None or first_new is None:
        raise NothingSeen("the side of the road or the first new agent is not named")
    scene = Scene(
        name="seen",
        ego=next(agent for agent in agents if agent.type is AgentType.EGO_VEHICLE),
        traffic_side=TrafficSide(side.group(1)),
        origin=Origin(frame="prompt", x_m=0.0, y_m=0.0, heading_rad=0.0),
        provenance="read from a prompt",
        agents=tuple(agent for agent in agents if agent.type is not AgentType.EGO_VEHICLE),
        lanes=_joined(lanes),
        connectors=tuple(
            _connector(name, vector) for name, vector in list_of(text, "Lane connectors").items()
        ),
        areas=tuple(
            Area(id=name, kind=AreaKind(vector[0]), boundary_m=tuple(map(_point, vector[1])))
            for name, vector in list_of(text, "Areas").items()
        ),
    )
    return Task(
        prompt=text, scene=scene, instruction=_instruction(text), first_new=int(first_new.group(1))
    )


def list_of(text: str, title: str) -> Vectors:
    """The JSON object under a heading.

    Raises:
        ValueError: There is none.
    """
    start = text.index(f"\n{title}:\n") + len(title) + 3
    vectors, _ = json.JSONDecoder().raw_decode(text, start)
    return dict(vectors)


def instruction_in(messages: Sequence[SpokenMessage]) -> str:
    """The quoted wish in the first message of a user that holds one.

    Raises:
        NothingSeen: None does.
    """
    for message in messages:
        if message.role == "user" and "<instruction>" in message.text:
            return _instruction(message.text)
    raise NothingSeen("there is no instruction")


def _instruction(text: str) -> str:
    quoted = re.search(r"^<instruction>\n(.*?)\n</instruction>$", text, re.DOTALL | re.MULTILINE)
    if quoted is None:
        raise NothingSeen("there is no instruction")
    return "\n".join(line.removeprefix(QUOTE) for line in quoted.group(1).split("\n"))


def agent_of(name: str, vector: Sequence[object]) -> TrafficAgent:
    """The agent that a vector of the prompt describes."""
    kind, *numbers, lane = vector
    x, y, heading, width, length, speed = (float(str(number)) for number in numbers)
    return TrafficAgent(
        id=name,
        type=AgentType(str(kind)),
        x_m=x,
        y_m=y,
        heading_rad=heading,
        width_m=width,
        length_m=length,
        speed_mps=speed,
        lane_id=None if lane is None else str(lane),
    )


def _lane(name: str, vector: Sequence[Any]) -> Lane:
    _, _, _, width, _, points = vector
    return Lane(id=name, centerline=_line(points), width_m=float(str(width)))


def _connector(name: str, vector: Sequence[Any]) -> LaneConnector:
    before, after, _, turn, width, _, points = vector
    ends = [None if end is None else str(end) for end in (before, after)]
    return LaneConnector(
        id=name,
        from_lane=ends[0],
        to_lane=ends[1],
        centerline=_line(points),
        width_m=float(str(width)),
        turn_type=TurnType(str(turn)),
    )


def _line(coordinates: list[Any]) -> Polyline:
    """A centreline from points, or from the control points of Bezier pieces."""
    if not isinstance(coordinates[0][0], list):
        return smooth(np.array(coordinates, dtype=np.float64))
    pieces = []
    for control in coordinates:
        curve = curve_from(control)
        count = max(2, math.ceil(curve.length_m / _FINE_M) + 1)
        pieces.append(curve.points(curve.parameters_at(np.linspace(0.0, curve.length_m, count))))
    return Polyline(np.vstack([pieces[0], *(piece[1:] for piece in pieces[1:])]))


def _joined(lanes: tuple[Lane, ...]) -> tuple[Lane, ...]:
    """The lanes with those beside them and those that begin where they end: no list names them."""
    return tuple(
        replace(
            lane,
            left_neighbor=_beside(lane, lanes, 1.0),
            right_neighbor=_beside(lane, lanes, -1.0),
            successors=tuple(other.id for other in lanes if _follows(lane, other)),
        )
        for lane in lanes
    )


def _follows(lane: Lane, other: Lane) -> bool:
    end, start = lane.centerline.points_m[-1], other.centerline.points_m[0]
    return other is not lane and float(np.hypot(*(start - end))) < _JOINT_M


def _beside(lane: Lane, lanes: tuple[Lane, ...], side: float) -> str | None:
    middle = lane.centerline.pose_at(lane.centerline.length_m / 2.0)
    for other in lanes:
        place = other.centerline.project(middle.x_m, middle.y_m)
        # Seen from the other lane this one lies on the far side.
        gap = -side * place.d_m
        width = (lane.width_m + other.width_m) / 2.0
        turn = difference(other.centerline.heading_at(place.s_m), middle.heading_rad)
        if other is not lane and abs(gap - width) < 0.4 * width and abs(turn) < 0.5:
            return other.id
    return None


def _point(pair: Sequence[float]) -> tuple[float, float]:
    x, y = pair
    return float(x), float(y)


_RESULT = read_text("function_result.md").partition("\n")[0]
_FEEDBACK = tuple(
    read_text(name).partition("{{")[0].strip() for name in ("feedback.md", "measured.md")
)


_OPENINGS = {read_text(f"{part}.md").partition("\n")[0]: part for part in ModelRole}


@dataclass(frozen=True, slots=True, kw_only=True)
class Heard:
    """A conversation, understood.

    Attributes:
        part: Whom it is asked to be.
        may_call: Whether it can have a function called now.
        is_native: Whether natively.
        results: Of the calls since the last feedback, in order; None for one that failed.
        called: Whether it has called anything since then.
        feedback: What reviews sent back so far.
    """

    part: ModelRole
    may_call: bool = False
    is_native: bool = False
    results: tuple[dict[str, object] | None, ...] = ()
    called: bool = False
    feedback: tuple[str, ...] = ()


def read_conversation(request: ChatRequest) -> Heard:
    """What the conversation says about the answer that is due; by default a modifier's."""
    system = next((message.text for message in request.messages if message.role == "system"), "")
    part = _OPENINGS.get(system.partition("\n")[0], ModelRole.MODIFIER)
    feedback = [message.text for message in request.messages if _is_feedback(message)]
    start = max((n for n, one in enumerate(request.messages) if _is_feedback(one)), default=0)
    since = request.messages[start:]
    native = request.tools is not None
    offered = request.tool_choice != "none" if native else '{"call": "pose_on_lane"' in system
    over = read_text("calls_are_over.md") in request.messages[-1].text
    asked_again = request.messages[-1].text.startswith(read_text("re_ask.md").partition("\n")[0])
    return Heard(
        part=part,
        may_call=offered and not over and not asked_again,
        is_native=native,
        results=tuple(_results(since)),
        called=any(one.role == "tool" or one.text.startswith(_RESULT) for one in since),
        feedback=tuple(feedback),
    )


def _is_feedback(message: SpokenMessage) -> bool:
    return message.role == "user" and message.text.startswith(_FEEDBACK)


def _results(messages: Sequence[SpokenMessage]) -> list[dict[str, object] | None]:
    results: list[dict[str, object] | None] = []
    for message in messages:
        if message.role == "tool":
            results.append(_result(message.text))
        elif message.role == "user" and message.text.startswith(_RESULT):
            lines = re.findall(r"^[0-9]+\. (\{.*\})$", message.text, re.MULTILINE)
            results += [_result(line) for line in lines]
    return results


def _result(written: str) -> dict[str, object] | None:
    try:
        result = json.loads(written)
    except ValueError:
        return None
    return None if not isinstance(result, dict) or "error" in result else result
