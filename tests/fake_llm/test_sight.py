from __future__ import annotations

from dataclasses import replace

from augment.fake_llm.sight import task_of
from augment.fake_llm.wire import SpokenMessage
from augment.prompts.fill import modifier_messages
from augment.scene.entities import Scene, TrafficSide
from tests.scenes import cone, junction, scene, vehicle

WISH = "Add a parked car 17 m ahead.\nIt stands 0.4 m left of the centre."


def messages(shown: Scene, wish: str = WISH) -> list[SpokenMessage]:
    return [
        SpokenMessage.model_validate(message.to_document())
        for message in modifier_messages(shown, wish)
    ]


def test_the_scene_and_the_wish_are_read_back() -> None:
    shown = replace(
        junction(),
        agents=(vehicle("Agent2", 12.0, 0.0, 0.1), cone("Agent6", 30.0, 2.0)),
        traffic_side=TrafficSide.LEFT,
        areas=scene().areas,
    )
    task = task_of(messages(shown))
    assert (task.instruction, task.first_new) == (WISH, 7)
    assert task.scene.traffic_side is TrafficSide.LEFT
    assert [a.id for a in task.scene.agents] == ["Agent2", "Agent6"]
    assert task.scene.agents[0] == shown.agents[0]
    assert task.scene.ego.lane_id == "Lane1"
    assert [(w.id, w.from_lane, w.to_lane, w.turn_type) for w in task.scene.connectors] == [
        (w.id, w.from_lane, w.to_lane, w.turn_type) for w in shown.connectors
    ]
    assert [w.width_m for w in task.scene.connectors] == [3.5, 3.5]
    assert [(a.id, a.kind) for a in task.scene.areas] == [(a.id, a.kind) for a in shown.areas]
