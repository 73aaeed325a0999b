"""Data of the scene editor: agents, the picture below them, the sizes.

In: a scenario. Out: one JSON document for a page. Back: a modification whose lanes are those under
its agents, whatever the page said.
"""

import math
from copy import copy
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Annotated, Any

from django.contrib.auth.models import User
from django.db import transaction
from pydantic import Field, TypeAdapter

from augment.checks import Ground
from augment.checks.derived_motions import find_wish
from augment.errors import Conflict, check_names
from augment.geometry.frames import difference, wrap
from augment.models import BaseScene, IntentReading, Scenario
from augment.render.camera import AROUND_THE_EGO
from augment.scene import codec
from augment.scene.density import fit_boxes, usual_size_m
from augment.scene.entities import AgentType, Modification, TrafficAgent, apply
from augment.scene.intent import IntentOrigin
from augment.scene.intent_parts import Amount
from augment.scene.intent_statements import list_statements
from augment.scene.lane_graph import LaneGraph
from augment.scene.planned_motion import MotionPreset, NearEgo
from augment.scene.presets import PresetNumbers, preset_numbers, with_preset
from augment.scene.schema import CLOSED, Codec, Id, Real
from augment.services.events import log_change
from augment.services.scenarios import scenes

PLACED = tuple(kind for kind in AgentType if kind is not AgentType.EGO_VEHICLE)
_SNAP_WITHIN_M = 15.0
_AHEAD_M = 20.0
_NUMBERS = {
    "speed_mps": "Comes to (m/s)",
    "braking_mps2": "Brakes with (m/s²)",
    "duration_s": "Opens within (s)",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class PresetEdit:
    """Motion of an agent, by its preset.

    Attributes:
        agent_id: Of the scene or of those added.
        preset: None to take its motion away.
        within_m: The ego's distance at which it begins; None for the usual start.
        number: The preset's main one; None for the usual.
    """

    __pydantic_config__ = CLOSED

    agent_id: Id
    preset: MotionPreset | None = None
    within_m: Annotated[Real, Field(gt=0.0, le=500.0)] | None = None
    number: Annotated[Real, Field(gt=0.0, le=100.0)] | None = None


_PRESET = Codec("preset", TypeAdapter(PresetEdit))


# Changes by hand


def make_draft(scene: BaseScene, scenario: Scenario | None, *, keep_traffic: bool) -> Scenario:
    """Return a scenario that is being made or changed, with the traffic that was chosen for it."""
    draft = Scenario(base_scene=scene) if scenario is None else copy(scenario)
    draft.keep_traffic = keep_traffic
    if keep_traffic:
        draft.spawned = None
    return draft


def editor_document(draft: Scenario) -> dict[str, Any]:
    """Return the picture's window, who is there before the change, and what can be placed.

    `ahead` is x, y and heading of what is placed ahead, on the ego's lane; `route` the ego's way.

    Raises:
        InvalidDocument: The stored scene can't be read.
    """
    camera, ground = AROUND_THE_EGO, editable_ground(draft)
    scene, route = ground.scene, ground.route
    ahead = (_AHEAD_M, 0.0, 0.0)
    if route is not None:
        ahead = (*route.position(_AHEAD_M), route.heading_at(_AHEAD_M))
    points = [(0.0, 0.0), (1.0, 0.0)] if route is None else route.line.points_m.round(2).tolist()
    names = ("x_min_m", "y_max_m", "px_per_m", "width_px", "height_px")
    return {
        "camera": {name: getattr(camera, name) for name in names},
        "ahead": [round(number, 2) for number in ahead],
        "route": {"points": points, "ego_s_m": 0.0 if route is None else route.ego_s_m},
        "recorded": _list_agents(make_draft(draft.base_scene, draft, keep_traffic=True)),
        "cleared": _list_agents(make_draft(draft.base_scene, draft, keep_traffic=False)),
        "sizes": {
            kind.value: dict(zip(("length_m", "width_m"), usual_size_m(scene, kind), strict=True))
            for kind in PLACED
        },
        "presets": {
            preset.value: {"label": preset.label, "number": _NUMBERS[preset_numbers(preset)[0]]}
            for preset in MotionPreset
        },
    }


def _list_agents(draft: Scenario) -> list[dict[str, Any]]:
    agents = editable_ground(draft).scene.agents
    listed: list[dict[str, Any]] = codec.MODIFICATION.dump(Modification(moved=agents))["move"]
    return listed


def read_edit(scenario: Scenario, document: object) -> Modification:
    """Return the modification of a document, each of its agents on the lane under it.

    Raises:
        InvalidDocument: It breaks its format.
        InvalidModification: It does not fit the scene.
    """
    ground = editable_ground(scenario)
    change = codec.modification_from_document(document)
    placed = replace(
        change,
        added=tuple(_on_its_lane(agent, ground.graph) for agent in change.added),
        moved=tuple(_on_its_lane(agent, ground.graph) for agent in change.moved),
    )
    placed = fit_boxes(ground.scene, placed)
    scenes.check_reference(ground.scene, placed)
    return placed


def reference_document(scenario: Scenario, document: object) -> dict[str, Any] | None:
    """Return a drawing as a reference; None where nothing is drawn, but for an unmet wish.

    Raises:
        InvalidDocument, InvalidModification: As above.
    """
    if document is None:
        return None
    modification, intent = read_edit(scenario, document), scenes.LoadedScenario(scenario).intent
    if modification.is_empty and not (intent and intent.unmet):
        return None
    return codec.modification_to_document(modification)


def snap(scenario: Scenario, modification: Modification, agent_id: str) -> Modification:
    """Return the modification with one agent on the nearest centreline, along it or against it.

    A pedestrian who walks somewhere faces that way from there, along or across the lane.
    Nothing happens to an agent that is not changed, or further than 15 m from every lane.
    """
    graph = editable_ground(scenario).graph
    return modification.with_changed(
        _snap(agent, graph) if agent.id == agent_id else agent for agent in modification.changed
    )


def give_preset(scenario: Scenario, change: Modification, document_part: object) -> Modification:
    """Return the modification with one agent that does what is asked, or with a door that opens.

    Raises:
        InvalidDocument: What is given is no `PresetEdit`.
        CannotPlace: The scene has not what the preset needs.
        UnknownName: There is no such agent.
    """
    edit = _PRESET.from_parts(document_part)
    after = apply(editable_ground(scenario).scene, change)
    agents = {agent.id: agent for agent in after.agents}
    check_names("agent", [edit.agent_id], agents)
    mover = replace(agents[edit.agent_id], motion=None)
    if edit.preset is not None:
        start = None if edit.within_m is None else NearEgo(within_m=edit.within_m)
        numbers: dict[str, Any] = {"start": start, preset_numbers(edit.preset)[0]: edit.number}
        mover = with_preset(edit.preset, after, mover, PresetNumbers(**numbers))
        mover = replace(mover, id=mover.id or f"{edit.agent_id}-door")
    is_recorded = any(agent.id == mover.id for agent in editable_ground(scenario).scene.agents)
    name = "moved" if is_recorded else "added"
    others = [agent for agent in getattr(change, name) if agent.id != mover.id]
    return replace(change, **{name: (*others, mover)})


def motion_presets(scenario: Scenario, change: Modification) -> dict[str, dict[str, Any]]:
    """Return by id which preset a motion is, with its numbers as `PresetEdit` has them."""
    scene, presets = editable_ground(scenario).scene, dict[str, dict[str, Any]]()
    everyone = apply(scene, change).agents
    for agent in change.changed:
        wish = find_wish(agent, scene, everyone)
        if wish is not None:
            preset, near = wish[0].preset, wish[0].start and wish[0].start.ego_distance
            number: Amount | None = getattr(wish[0], preset_numbers(preset)[0])
            presets[agent.id] = {
                "preset": preset.value,
                "within_m": near and near.low_m,
                "number": number and number.low,
            }
    return presets


def editable_ground(scenario: Scenario) -> Ground:
    """Return the ground that is changed, read once for as long as several edits follow each other.

    Raises:
        InvalidDocument: The stored scene can't be read.
    """
    return _read_ground(_ScenarioByKey(scenes.scene_key(scenario), scenario))


@dataclass(frozen=True, slots=True)
class _ScenarioByKey:
    """A scenario by the key that alone tells when a scene that was read before still holds."""

    key: str
    scenario: Scenario = field(compare=False)


@lru_cache(maxsize=8)
def _read_ground(keyed: _ScenarioByKey) -> Ground:
    return scenes.LoadedScenario(keyed.scenario).ground


def _on_its_lane(agent: TrafficAgent, graph: LaneGraph) -> TrafficAgent:
    return replace(agent, lane_id=graph.under(agent.x_m, agent.y_m, agent.heading_rad))


def _snap(agent: TrafficAgent, graph: LaneGraph) -> TrafficAgent:
    lane_id = graph.under(agent.x_m, agent.y_m, agent.heading_rad)
    nearest = graph.nearest(agent.x_m, agent.y_m)
    if lane_id is None and nearest is not None and nearest[1].distance_m <= _SNAP_WITHIN_M:
        lane_id = nearest[0]
    if lane_id is None:
        return agent
    line = graph.lane(lane_id).centerline
    pose = line.pose_at(line.project(agent.x_m, agent.y_m).s_m)
    heading_rad = pose.heading_rad
    if abs(difference(heading_rad, agent.heading_rad)) > math.pi / 2.0:
        heading_rad = wrap(heading_rad + math.pi)
    if agent.walk_to_m is not None:
        away = (agent.walk_to_m[0] - pose.x_m, agent.walk_to_m[1] - pose.y_m)
        heading_rad = math.atan2(away[1], away[0]) if any(away) else agent.heading_rad
    moved = replace(agent, x_m=pose.x_m, y_m=pose.y_m, heading_rad=heading_rad)
    return _on_its_lane(moved, graph)


# Intents


@transaction.atomic
def enter_intent(*, scenario: str, document: object, actor: User | None = None) -> Scenario:
    """Give a scenario the intent of a document, in the place of the one that it had.

    Raises:
        UnknownName: No such scenario.
        InvalidDocument: The document breaks the format, or leaves open what jobs need.
        Conflict: The scenario is the catalogue's, whose intents are authored.
    """
    return _set_intent(_lock_scenario(scenario), document, IntentOrigin.ENTERED, actor)


@transaction.atomic
def accept_reading(*, scenario: str, actor: User | None = None) -> Scenario:
    """Let the last reading of a scenario count, in the place of the intent that it had.

    Raises:
        UnknownName: No such scenario.
        InvalidDocument: What was read leaves open what jobs need.
        Conflict: Nothing that was read waits to be accepted, or the scenario is the catalogue's.
    """
    row = _lock_scenario(scenario)
    reading = waiting_reading(row)
    if reading is None:
        raise Conflict(f"No reading of '{row.slug}' waits to be accepted.")
    IntentReading.objects.filter(pk=reading.pk).update(state=IntentReading.State.ACCEPTED)
    return _set_intent(row, reading.document, IntentOrigin.READ, actor)


def waiting_reading(scenario: Scenario) -> IntentReading | None:
    """Return the last reading, where it was read and nobody has accepted it yet."""
    last = last_reading(scenario)
    return last if last is not None and last.state == IntentReading.State.READ else None


def last_reading(scenario: Scenario) -> IntentReading | None:
    """Return the last reading, whatever became of it."""
    return scenario.readings.select_related("endpoint").first()


def intent_statements(document: object) -> tuple[str, ...]:
    """Return the short statements of an intent document; none without a document.

    Raises:
        InvalidDocument: The document breaks the format.
    """
    return () if document is None else list_statements(codec.intent_from_document(document))


def refuse_catalogue(row: Scenario, part: str = "reference") -> None:
    """Raise Conflict for a scenario whose files alone change it."""
    if row.in_catalogue:
        problem = "is the catalogue's own; change it in its file."
        raise Conflict(f"The {part} of '{row.slug}' {problem}")


# Private


def _lock_scenario(slug: str) -> Scenario:
    """The row whose intent is to change, which of the catalogue's its files alone do."""
    rows = Scenario.objects.select_for_update(of=("self",))
    row = rows.get(pk=scenes.scenario_named(slug).pk)
    refuse_catalogue(row, "intent")
    return row


def _set_intent(
    row: Scenario, document: object, origin: IntentOrigin, actor: User | None
) -> Scenario:
    before = {"intent": row.intent or None, "origin": row.intent_origin or None}
    row.intent, row.intent_origin = scenes.placeable_intent(document), origin
    row.save(update_fields=["intent", "intent_origin"])
    after = {"intent": row.intent, "origin": origin}
    log_change(row, "set intent", actor, before=before, after=after)
    return row
