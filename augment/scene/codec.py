"""Scenes, modifications, recordings, intents and catalogue entries as JSON documents and back.

What can't be read raises `InvalidDocument` and names every place; what is written can be read.
Here stand the rules that reach over more than one field: ids, references, real lines.
Frame: ego frame of the scene.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
from pydantic import AliasChoices, BeforeValidator, Field, TypeAdapter

from augment.errors import InvalidModification
from augment.scene import entities
from augment.scene.intent import CrashRequest, Intent, Length, WalkRequest
from augment.scene.intent_parts import Aim, Amount
from augment.scene.planned_motion import EGO_ID, MotionPreset
from augment.scene.planned_mover import check_scene_motions
from augment.scene.recording import Recording
from augment.scene.schema import CLOSED, Codec, Problem, Text, Yes, path, remember

_ALWAYS_WRITTEN = ("requests", "kind", "body")


def _scene_problems(scene: entities.Scene) -> Iterator[Problem]:
    """Yield the reasons why a well-shaped value is no scene."""
    ego = scene.ego
    if ego.id != EGO_ID:
        yield "ego.id", f"the ego is {EGO_ID!r}, got {ego.id!r}"
    if ego.type is not entities.AgentType.EGO_VEHICLE:
        yield "ego.type", f"the ego is {entities.AgentType.EGO_VEHICLE!s}, got {ego.type!s}"
    for name in ("x_m", "y_m", "heading_rad"):
        if (value := getattr(ego, name)) != 0.0:
            yield f"ego.{name}", f"the ego is the origin of its frame: 0, got {value}"
    named = [("ego.id", ego.id)]
    for key in ("agents", "lanes", "connectors", "areas"):
        named += [
            (path(key, i, "id"), element.id) for i, element in enumerate(getattr(scene, key))
        ]
    yield from _find_doubled(named)
    yield from _agent_problems(agents=scene.agents)
    yield from _reference_problems(scene)
    try:
        check_scene_motions(scene)
    except InvalidModification as fault:
        yield "agents", str(fault)
    for index, area in enumerate(scene.areas):
        if len(set(area.boundary_m)) < 3:
            yield path("areas", index, "boundary_m"), "an area needs three distinct points"
    if scene.options.goal is entities.TurnType.U_TURN:
        yield "options.goal", "left, right or straight"


def _modification_problems(change: entities.Modification) -> Iterator[Problem]:
    """Yield the reasons why a well-shaped value is no modification of any scene."""
    named = [(path("add", i, "id"), agent.id) for i, agent in enumerate(change.added)]
    named += [(path("move", i, "id"), agent.id) for i, agent in enumerate(change.moved)]
    named += [(path("remove", i), name) for i, name in enumerate(change.removed)]
    yield from _find_doubled(named)
    yield from _agent_problems(add=change.added, move=change.moved)


def _find_doubled(named: Iterable[tuple[str, str]]) -> Iterator[Problem]:
    first: dict[str, str] = {}
    for place, name in named:
        if name in first:
            yield place, f"{name!r} is taken already by {first[name]}"
        first.setdefault(name, place)


def _agent_problems(**agents: Iterable[entities.TrafficAgent]) -> Iterator[Problem]:
    for key, listed in agents.items():
        for index, agent in enumerate(listed):
            if agent.type is entities.AgentType.EGO_VEHICLE:
                yield path(key, index, "type"), "there is one ego, and it is not in this list"
            if agent.motion is not None and agent.walk_to_m is not None:
                yield path(key, index, "motion"), "an agent has a walk or a motion, not both"


def _reference_problems(scene: entities.Scene) -> Iterator[Problem]:
    lanes = {lane.id for lane in scene.lanes}
    lane_names = lanes | {connector.id for connector in scene.connectors}
    on = [("ego.lane_id", scene.ego.lane_id)]
    on += [(path("agents", i, "lane_id"), agent.lane_id) for i, agent in enumerate(scene.agents)]
    for place, name in on:
        if name is not None and name not in lane_names:
            yield place, f"{name!r} is not a lane or connector of this scene"
    for index, lane in enumerate(scene.lanes):
        beside = {"left_neighbor": lane.left_neighbor, "right_neighbor": lane.right_neighbor}
        named = [(path("lanes", index, key), name) for key, name in beside.items() if name]
        named += [
            (path("lanes", index, "successors", n), s) for n, s in enumerate(lane.successors)
        ]
        for place, name in named:
            if name not in lanes:
                yield place, f"{name!r} is not a lane of this scene"
    for index, connector in enumerate(scene.connectors):
        for key in ("from_lane", "to_lane"):
            name = getattr(connector, key)
            if name is not None and (name not in lane_names or name == connector.id):
                yield path("connectors", index, key), f"{name!r} is not a lane of this scene"


def _recording_problems(recording: Recording) -> Iterator[Problem]:
    times_s = recording.times_s.tolist()
    if times_s[0] != 0.0:
        yield "times_s[0]", f"the first step is t0: 0, got {times_s[0]}"
    for index, (before, after) in enumerate(pairwise(times_s), start=1):
        if after <= before:
            yield path("times_s", index), f"{after} does not follow {before}"
    if len(recording.ego) and np.isnan(recording.ego[0]).all():
        yield "ego[0]", "the ego is there at t0"
    rows = [("ego", recording.ego)]
    rows += [
        (path("tracks", i, "states"), track.states) for i, track in enumerate(recording.tracks)
    ]
    for place, states in rows:
        if len(states) != len(times_s):
            yield place, f"expected {len(times_s)} states, one a step, got {len(states)}"
    yield from _find_doubled(
        (path("tracks", i, "agent_id"), track.agent_id) for i, track in enumerate(recording.tracks)
    )


def _intent_problems(intent: Intent) -> Iterator[Problem]:
    anchors: list[str] = []
    for number, request in enumerate(intent.requests):
        at, anchor = f"requests[{number}]", request.spot.anchor
        if anchor is not None and anchor not in anchors:
            names = ", ".join(anchors) or "none"
            text = f"{anchor!r} is the name of no earlier request; those before it: {names}"
            yield f"{at}.spot.anchor", text
        if request.name and request.name in anchors:
            yield f"{at}.name", f"{request.name!r} is taken by an earlier request"
        anchors += [request.name] if request.name else []
        further = {WalkRequest: "behind", CrashRequest: "others"}.get(type(request))
        described = len(getattr(request, further)) if further else 0
        if request.count is not None and described > request.count - 1:
            text = f"tells of {described} further ones, but the count is {request.count}"
            yield f"{at}.{further}", text


SCENE = Codec("scene", TypeAdapter(entities.Scene), _scene_problems)
MODIFICATION = Codec("modification", TypeAdapter(entities.Modification), _modification_problems)
RECORDING = Codec("recording", TypeAdapter(Recording), _recording_problems)
SCENE_FORMAT: str = SCENE.frame["format"]
INTENT = Codec("intent", TypeAdapter(Intent), _intent_problems)

# Contestants of a scenario follow one another, and each needs them several times.
scene_to_document, scene_from_document = SCENE.to_document, remember(SCENE.from_document, 8)
modification_to_document = MODIFICATION.to_document
modification_from_document = remember(MODIFICATION.from_document, 256)
recording_to_document = RECORDING.to_document
recording_from_document = remember(RECORDING.from_document, 4)
intent_from_document, intent_from_parts = INTENT.from_document, INTENT.from_parts


def intent_to_document(intent: Intent) -> dict[str, Any]:
    """Return the intent as a JSON document; open parts and plain defaults are left out."""
    parts: dict[str, Any] = intent_to_parts(intent)
    return INTENT.frame | parts


def intent_to_parts(value: Any) -> Any:
    """Return an intent, or what it is made of, as a part of a document without defaults."""
    if isinstance(value, Length):
        written: dict[str, Any] = {"low_m": value.low_m}
        if value.is_range:
            written["high_m"] = value.high_m
        return written | ({"is_approximate": True} if value.is_approximate else {})
    if isinstance(value, Amount):
        return {"low": value.low} | ({"high": value.high} if value.high > value.low else {})
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, tuple):
        return [intent_to_parts(part) for part in value]
    if not is_dataclass(value):
        return value
    return {
        field.name: intent_to_parts(part)
        for field in fields(value)
        if (part := getattr(value, field.name)) != field.default or field.name in _ALWAYS_WRITTEN
    }


def parts_schema() -> dict[str, Any]:
    """Return the JSON schema of an intent's parts, with a line on each."""
    schema = INTENT.shape.json_schema()
    for part in (schema, *schema["$defs"].values()):
        part["description"] = part["description"].partition("\n")[0]
        if "const" in part.get("properties", {}).get("kind", {}):
            part["required"] = ["kind"]
    schema["$defs"]["Length"]["required"] = ["low_m"]
    schema["$defs"]["Amount"]["required"] = ["low"]
    return schema


_Words = Annotated[Text, Field(min_length=1, pattern=r"\S")]
_Language = Annotated[Text, Field(pattern=r"^[a-z]{2}$")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Wording:
    """A wish in one language (ISO 639-1)."""

    language: _Language
    text: _Words


@dataclass(frozen=True, slots=True, kw_only=True)
class CatalogueEntry:
    """A scenario as the catalogue gives it.

    Attributes:
        scene: The name of its base scene.
        follows: The slug of the scenario whose results it asks to change further, mostly empty.
        language: Of the instruction; English goes without saying.
        instruction: What is to be changed, in the user's words.
        paraphrases: The same wish in other words, each to be answered by the same reference.
        keep_traffic: Whether the recorded traffic stays in the scene.
        notes: What a reader of the catalogue should know; may be empty.
        intent: What the instruction asks for; None where nobody has written it down.
        reference: What a person made of it; where the wish is open an `example` in the document,
            one right answer among many, which nobody's answer is measured by.
    """

    __pydantic_config__ = CLOSED

    slug: _Words
    scene: _Words
    follows: str = ""
    type: entities.ScenarioType | MotionPreset | Aim
    language: _Language = "en"
    instruction: _Words
    paraphrases: Annotated[tuple[Wording, ...], Field(max_length=20)] = ()
    keep_traffic: Yes
    provenance: _Words
    notes: Text = ""
    intent: Annotated[
        Intent | None,
        BeforeValidator(lambda document: document and intent_from_document(document)),
    ] = None
    reference: Annotated[
        entities.Modification,
        Field(validation_alias=AliasChoices("reference", "example")),
        BeforeValidator(modification_from_document),
    ]

    @property
    def is_open(self) -> bool:
        """True if the intent names a purpose."""
        return self.intent is not None and self.intent.purpose is not None


entry_from_document = Codec("scenario", TypeAdapter(CatalogueEntry)).from_document
