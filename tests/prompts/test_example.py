"""The worked example of the modifier's prompt is true: its scene, its results and its answer.

python -m tests.prompts.test_example writes the scene's lists anew.
"""

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from augment.geometry.polyline import Polyline
from augment.prompts.calls import PARAMETERS, Tools, calls_in
from augment.prompts.fill import read_text
from augment.prompts.reply import answer_notes, read_reply
from augment.prompts.vectors import LaneFormat, scene_text
from augment.scene.entities import Lane, Scene, TurnType
from augment.variants.pose_tool import PoseTool
from augment.variants.retrieval import RetrievalTool
from tests.scenes import EGO, connector, scene

TEXTS = Path(__file__).parents[2] / "augment" / "prompts" / "text"
WIDTH_M = 3.4
TURN_RAD = 0.4


def bend() -> Polyline:
    """12 m of a bend to the left with a radius of 30 m from (10, 0) on."""
    angles = np.linspace(0.0, TURN_RAD, 41)
    return Polyline(np.column_stack([10.0 + 30.0 * np.sin(angles), 30.0 - 30.0 * np.cos(angles)]))


def beyond() -> Polyline:
    start = bend().points_m[-1]
    step = np.array([math.cos(TURN_RAD), math.sin(TURN_RAD)])
    return Polyline([start, start + 15.0 * step])


def example() -> Scene:
    """A road with one lane that is straight, bends on a connector, and goes on."""

    rest: dict[str, Any] = {"width_m": WIDTH_M, "speed_limit_mps": 11.0}
    before = Polyline([(-20.0, 0.0), (10.0, 0.0)])
    lines = {"Lane1": before, "Lane2": beyond()}
    turn = TurnType.STRAIGHT
    way = connector("Connector1", "Lane1", "Lane2", bend().points_m, turn_type=turn, **rest)
    lanes = tuple(Lane(id=name, centerline=line, **rest) for name, line in lines.items())
    return scene(ego=EGO, lanes=lanes, connectors=(way,), areas=())


@pytest.mark.parametrize("lanes", list(LaneFormat))
def test_the_lists_of_the_example_are_those_of_its_scene(lanes: LaneFormat) -> None:
    assert read_text(f"example_{lanes}.md") == scene_text(example(), lanes=lanes)


@pytest.mark.parametrize(
    ("name", "tool", "count"),
    [(Tools.RETRIEVE, RetrievalTool(example()), 2), (Tools.POSE_ON_LANE, PoseTool(example()), 1)],
)
def test_the_results_of_the_example_are_those_of_the_tool(
    name: Tools, tool: PoseTool | RetrievalTool, count: int
) -> None:
    work = read_text(f"work_{name}_in_prompt.md")
    calls = calls_in(work.partition("Insights:")[0], name)
    results = [json.loads(line) for line in re.findall(r"^\d\. ([\[{].*)$", work, re.MULTILINE)]
    assert len(calls) == count
    assert [tool.answer(call.arguments) for call in calls] == results


@pytest.mark.parametrize(
    "work",
    ["walked", *(f"{name}_{way}" for name in PARAMETERS for way in ("in_prompt", "native"))],
)
def test_the_answer_of_the_example_is_read_and_right(work: str) -> None:
    text = read_text(f"work_{work}.md")
    answer = text[text.index("Insights:") :]
    car, walker = read_reply(answer, example()).modification.added
    assert answer_notes(answer).startswith("A road with a single lane")
    tool = PoseTool(example())
    spots = [
        ((car.x_m, car.y_m), car.lane_id, 17.5, -0.6),
        ((walker.x_m, walker.y_m), walker.lane_id, 21.5, -2.5),
        (walker.walk_to_m, None, 21.5, 2.5),
    ]
    for spot_m, lane, distance_m, lateral_m in spots:
        place = tool.pose_on_lane("Lane1", "Agent1", distance_m, lateral_m)
        assert lane == place.lane
        assert math.dist(spot_m, (place.pose.x_m, place.pose.y_m)) <= 0.02
    way = math.atan2(walker.walk_to_m[1] - walker.y_m, walker.walk_to_m[0] - walker.x_m)
    assert walker.heading_rad == pytest.approx(way, abs=0.01)


if __name__ == "__main__":
    for form in LaneFormat:
        text = scene_text(example(), lanes=form)
        (TEXTS / f"example_{form}.md").write_text(f"{text}\n", encoding="utf-8")
