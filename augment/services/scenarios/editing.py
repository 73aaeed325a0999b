"""What a person needs to change a scene by hand: its agents, the picture below them, the sizes.

In: a scenario. Out: one JSON document for a page. Back: a modification whose lanes are those under
its agents, whatever the page said.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import Any

from django.contrib.auth.models import User
from django.db import transaction

from augment.errors import Conflict, UnknownName
from augment.geometry.frames import Pose, difference, wrap
from augment.models import IntentReading, Scenario
from augment.render.camera import AROUND_THE_EGO
from augment.scene.codec import (
    intent_from_document,
    modification_from_document,
    modification_to_document,
)
from augment.scene.entities import (
    LENGTH_WIDTH_M,
    AgentType,
    Modification,
    Point,
    Scene,
    TrafficAgent,
)
from augment.scene.intent import IntentOrigin
from augment.scene.intent_statements import list_statements
from augment.scene.lane_graph import LaneGraph
from augment.services.events import log_change
from augment.services.scenarios.scenes import (
    check_reference,
    intent_of,
    placeable_intent,
    scene_key,
    scene_of,
)

PLACED = tuple(one for one in AgentType if one is not AgentType.EGO_VEHICLE)
_HALF_TURN_RAD = math.pi
_SNAP_WITHIN_M = 15.0


def editor_document(scenario: Scenario) -> dict[str, Any]:
    """The picture's window, who is there before the change, and the classes that can be placed.

    Raises:
        InvalidDocument: The stored scene can't be read.
    """
    scene = editable_scene(scenario)
    camera = AROUND_THE_EGO
    return {
        "camera": {
            "x_min_m": camera.x_min_m,
            "y_max_m": camera.y_max_m,
            "px_per_m": camera.px_per_m,
            "width_px": camera.width_px,
            "height_px": camera.height_px,
        },
        "agents": modification_to_document(Modification(moved=scene.agents))["move"],
        "sizes": {
            one.value: {"length_m": LENGTH_WIDTH_M[one][0], "width_m": LENGTH_WIDTH_M[one][1]}
            for one in PLACED
        },
    }


def read_edit(scenario: Scenario, document: object) -> Modification:
    """The modification of a document, each of its agents on the lane that lies under it.

    Raises:
        InvalidDocument: It breaks its format.
        InvalidModification: It does not fit the scene.
    """
    scene, graph = _scene_of(scenario)
    given = modification_from_document(document)
    placed = replace(
        given,
        added=tuple(_on_its_lane(agent, graph) for agent in given.added),
        moved=tuple(_on_its_lane(agent, graph) for agent in given.moved),
    )
    check_reference(scene, placed)
    return placed


def snap(scenario: Scenario, modification: Modification, agent_id: str) -> Modification:
    """The modification with one agent on the nearest centreline, facing along it or against it.

    A pedestrian who walks somewhere faces that way from there, along or across the lane.
    Nothing happens to an agent that is not changed, or further than 15 m from every lane.
    """
    _, graph = _scene_of(scenario)
    return replace(
        modification,
        added=tuple(_snapped(one, graph, agent_id) for one in modification.added),
        moved=tuple(_snapped(one, graph, agent_id) for one in modification.moved),
    )


def editable_scene(scenario: Scenario) -> Scene:
    """The scene that is changed, read once for as long as several edits follow each other.

    Raises:
        InvalidDocument: The stored scene can't be read.
    """
    return _scene_of(scenario)[0]


def edit_to_document(modification: Modification) -> dict[str, Any]:
    """The modification as pages and rows have it."""
    return modification_to_document(modification)


# --- Private -----------------------------------------------------------------------------------


def _scene_of(scenario: Scenario) -> tuple[Scene, LaneGraph]:
    return _read_scene(scenario.pk, scene_key(scenario))


@lru_cache(maxsize=8)
def _read_scene(scenario_pk: int, key: str) -> tuple[Scene, LaneGraph]:
    """The key alone tells when a scene that was read before still holds."""
    scene = scene_of(Scenario.objects.select_related("base_scene").get(pk=scenario_pk))
    return scene, LaneGraph(scene)


def _on_its_lane(agent: TrafficAgent, graph: LaneGraph) -> TrafficAgent:
    return replace(agent, lane_id=graph.under(agent.x_m, agent.y_m, agent.heading_rad))


def _snapped(agent: TrafficAgent, graph: LaneGraph, agent_id: str) -> TrafficAgent:
    if agent.id != agent_id:
        return agent
    lane_id = graph.under(agent.x_m, agent.y_m, agent.heading_rad)
    if lane_id is None:
        nearest = graph.nearest(agent.x_m, agent.y_m)
        if nearest is None or nearest[1].distance_m > _SNAP_WITHIN_M:
            return agent
        lane_id = nearest[0]
    line = graph.lane(lane_id).centerline
    pose = line.pose_at(line.project(agent.x_m, agent.y_m).s_m)
    is_against = abs(difference(pose.heading_rad, agent.heading_rad)) > _HALF_TURN_RAD / 2.0
    heading = wrap(pose.heading_rad + _HALF_TURN_RAD) if is_against else pose.heading_rad
    if agent.walk_to_m is not None:
        heading = _towards(agent.walk_to_m, pose, instead=agent.heading_rad)
    snapped = replace(agent, x_m=pose.x_m, y_m=pose.y_m, heading_rad=heading)
    return _on_its_lane(snapped, graph)


def _towards(point: Point, pose: Pose, *, instead: float) -> float:
    """The heading from the pose to the point; `instead` where they are the same."""
    away = (point[0] - pose.x_m, point[1] - pose.y_m)
    return math.atan2(away[1], away[0]) if any(away) else instead


@transaction.atomic
def set_reference(scenario: Scenario, document: object, *, actor: User | None = None) -> Scenario:
    """Give a scenario the reference of a document, in the place of the one that it had.

    Raises:
        InvalidDocument: The document breaks its format.
        InvalidModification: It does not fit the scene.
        Conflict: The scenario is the catalogue's, or nothing changes though the wish can be met.
    """
    row = Scenario.objects.select_for_update(of=("self",)).get(pk=scenario.pk)
    refuse_catalogue(row)
    modification = read_edit(row, document)
    intent = intent_of(row)
    if modification.is_empty and not (intent and intent.unmet):
        raise Conflict(
            "Nothing is added, moved or removed. An empty reference is for wishes that can't "
            "be met, whose intent says so."
        )
    return _set(row, modification_to_document(modification), actor)


@transaction.atomic
def drop_reference(scenario: Scenario, *, actor: User | None = None) -> Scenario:
    """Leave a scenario without a reference.

    Raises:
        Conflict: The scenario is the catalogue's, or has none.
    """
    row = Scenario.objects.select_for_update(of=("self",)).get(pk=scenario.pk)
    refuse_catalogue(row)
    if row.reference is None:
        raise Conflict(f"'{row.slug}' has no reference.")
    return _set(row, None, actor)


def refuse_catalogue(row: Scenario) -> None:
    """Raise Conflict for a scenario whose files alone change it."""
    if row.in_catalogue:
        raise Conflict(
            f"The reference of '{row.slug}' is the catalogue's own; change it in its file."
        )


def _set(row: Scenario, document: dict[str, object] | None, actor: User | None) -> Scenario:
    before = row.reference
    row.reference = document
    row.save(update_fields=["reference"])
    log_change(
        row, "set reference", actor, before={"reference": before}, after={"reference": document}
    )
    return row


State = IntentReading.State


@transaction.atomic
def enter_intent(*, scenario: str, document: object, actor: User | None = None) -> Scenario:
    """Give a scenario the intent of a document, in the place of the one that it had.

    Raises:
        UnknownName: No such scenario.
        InvalidDocument: The document breaks the format, or leaves open what jobs need.
        Conflict: The scenario is the catalogue's, whose intents are authored.
    """
    row = _scenario(scenario)
    if row.in_catalogue:
        raise Conflict(
            f"The intent of '{row.slug}' is the catalogue's own; change it in its file."
        )
    return _set_intents(row, placeable_intent(document), IntentOrigin.ENTERED, actor)


@transaction.atomic
def accept_reading(*, scenario: str, actor: User | None = None) -> Scenario:
    """Let the last reading of a scenario count, in the place of the intent that it had.

    Raises:
        UnknownName: No such scenario.
        InvalidDocument: What was read leaves open what jobs need.
        Conflict: Nothing that was read waits to be accepted, or the scenario is the catalogue's.
    """
    row = _scenario(scenario)
    reading = waiting_reading(row)
    if reading is None:
        raise Conflict(f"No reading of '{row.slug}' waits to be accepted.")
    if row.in_catalogue:
        raise Conflict(
            f"The intent of '{row.slug}' is the catalogue's own; change it in its file."
        )
    document = placeable_intent(reading.document)
    IntentReading.objects.filter(pk=reading.pk).update(state=State.ACCEPTED)
    return _set_intents(row, document, IntentOrigin.READ, actor)


def waiting_reading(scenario: Scenario) -> IntentReading | None:
    """The last reading, where it was read and nobody has accepted it yet."""
    last = scenario.readings.select_related("endpoint").first()
    return last if last is not None and last.state == State.READ else None


def last_reading(scenario: Scenario) -> IntentReading | None:
    """The last reading, whatever became of it."""
    return scenario.readings.select_related("endpoint").first()


def statements_of(document: object) -> tuple[str, ...]:
    """What an intent document says, as short statements; none where there is no document.

    Raises:
        InvalidDocument: The document breaks the format.
    """
    return () if document is None else list_statements(intent_from_document(document))


# --- Private -----------------------------------------------------------------------------------


def _scenario(slug: str) -> Scenario:
    row = Scenario.objects.select_for_update(of=("self",)).filter(slug=slug).first()
    if row is None:
        raise UnknownName("scenario", slug, list(Scenario.objects.values_list("slug", flat=True)))
    return row


def _set_intents(
    row: Scenario, document: dict[str, Any], origin: IntentOrigin, actor: User | None
) -> Scenario:
    before = {"intent": row.intent, "origin": row.intent_origin or None}
    row.intent, row.intent_origin = document, origin
    row.save(update_fields=["intent", "intent_origin"])
    log_change(
        row, "set intent", actor, before=before, after={"intent": document, "origin": origin.value}
    )
    return row
