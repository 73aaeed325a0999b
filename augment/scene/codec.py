"""Scenes and modifications as JSON documents and back, exactly.

What can't be read raises `InvalidDocument` and names every place; what is written can be read.
Frame: ego frame of the scene.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from itertools import pairwise
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError

from augment.errors import InvalidDocument
from augment.scene.entities import (
    AgentType,
    Area,
    Lane,
    LaneConnector,
    Modification,
    ScenarioType,
    Scene,
    TrafficAgent,
    TurnType,
)
from augment.scene.intent import CrashRequest, Intent, Length, WalkRequest
from augment.scene.recording import Recording
from augment.scene.schema import CLOSED, VERSION, Text, Yes, path, problems_of, read, write

EGO_ID = "Agent1"

Problem = tuple[str, str]


def scene_problems(scene: Scene) -> Iterator[Problem]:
    """What keeps a well-shaped value from being a scene."""
    yield from _ego_problems(scene.ego)
    named = [(path("ego", "id"), scene.ego.id), *_ids("agents", scene.agents)]
    named += _ids("lanes", scene.lanes) + _ids("connectors", scene.connectors)
    yield from _doubled(named + _ids("areas", scene.areas))
    yield from _not_the_ego("agents", scene.agents)
    yield from _reference_problems(scene)
    for index, area in enumerate(scene.areas):
        if len({(x, y) for x, y in area.boundary_m}) < 3:
            yield path("areas", index, "boundary_m"), "an area needs three distinct points"
    if scene.options.goal is TurnType.U_TURN:
        yield path("options", "goal"), "left, right or straight"


def modification_problems(change: Modification) -> Iterator[Problem]:
    """What keeps a well-shaped value from being a modification of any scene."""
    removed = [(path("remove", index), name) for index, name in enumerate(change.removed)]
    yield from _doubled([*_ids("add", change.added), *_ids("move", change.moved), *removed])
    yield from _not_the_ego("add", change.added)
    yield from _not_the_ego("move", change.moved)


# Private


def _ids(
    key: str, entities: Sequence[TrafficAgent | Lane | LaneConnector | Area]
) -> list[Problem]:
    return [(path(key, index, "id"), entity.id) for index, entity in enumerate(entities)]


def _doubled(named: Iterable[tuple[str, str]]) -> Iterator[Problem]:
    first: dict[str, str] = {}
    for place, name in named:
        if name in first:
            yield place, f"{name!r} is taken already by {first[name]}"
        first.setdefault(name, place)


def _ego_problems(ego: TrafficAgent) -> Iterator[Problem]:
    if ego.id != EGO_ID:
        yield path("ego", "id"), f"the ego is {EGO_ID!r}, got {ego.id!r}"
    if ego.type is not AgentType.EGO_VEHICLE:
        yield path("ego", "type"), f"the ego is {AgentType.EGO_VEHICLE!s}, got {ego.type!s}"
    for name in ("x_m", "y_m", "heading_rad"):
        value = getattr(ego, name)
        if value != 0.0:
            yield path("ego", name), f"the ego is the origin of its frame: 0, got {value}"


def _not_the_ego(key: str, agents: Sequence[TrafficAgent]) -> Iterator[Problem]:
    for index, agent in enumerate(agents):
        if agent.type is AgentType.EGO_VEHICLE:
            yield path(key, index, "type"), "there is one ego, and it is not in this list"


def _reference_problems(scene: Scene) -> Iterator[Problem]:
    lanes = {lane.id for lane in scene.lanes}
    known = lanes | {connector.id for connector in scene.connectors}
    agents = [(path("ego", "lane_id"), scene.ego.lane_id)]
    agents += [(path("agents", i, "lane_id"), one.lane_id) for i, one in enumerate(scene.agents)]
    for place, name in agents:
        if name is not None and name not in known:
            yield place, f"{name!r} is not a lane or connector of this scene"
    for place, name in _lane_references(scene):
        if name is not None and name not in lanes:
            yield place, f"{name!r} is not a lane of this scene"
    for index, connector in enumerate(scene.connectors):
        for key in ("from_lane", "to_lane"):
            name = getattr(connector, key)
            if name is not None and (name not in known or name == connector.id):
                yield path("connectors", index, key), f"{name!r} is not a lane of this scene"


def _lane_references(scene: Scene) -> Iterator[tuple[str, str | None]]:
    for index, lane in enumerate(scene.lanes):
        yield path("lanes", index, "left_neighbor"), lane.left_neighbor
        yield path("lanes", index, "right_neighbor"), lane.right_neighbor
        for number, name in enumerate(lane.successors):
            yield path("lanes", index, "successors", number), name


SCENE_FORMAT = "scenario-arena/scene"
MODIFICATION_FORMAT = "scenario-arena/modification"

_SCENE, _MODIFICATION = TypeAdapter(Scene), TypeAdapter(Modification)


def scene_to_document(scene: Scene) -> dict[str, Any]:
    """The scene as a JSON document; fields without a value are left out.

    Raises:
        InvalidDocument: The scene breaks a rule of the format, so nobody could read it again.
    """
    document = write(scene, _SCENE, format_name=SCENE_FORMAT)
    scene_from_document(document)
    return document


def scene_from_document(document: object) -> Scene:
    """The scene that a JSON document describes.

    Raises:
        InvalidDocument: With the path and the reason of every fault.
    """
    scene = read(document, _SCENE, what="scene", format_name=SCENE_FORMAT)
    problems = list(scene_problems(scene))
    if problems:
        raise InvalidDocument("scene", problems)
    return scene


def modification_to_document(modification: Modification) -> dict[str, Any]:
    """The modification as a JSON document; fields without a value are left out.

    Raises:
        InvalidDocument: The modification breaks a rule of the format.
    """
    document = write(modification, _MODIFICATION, format_name=MODIFICATION_FORMAT)
    modification_from_document(document)
    return document


def modification_from_document(document: object) -> Modification:
    """The modification that a JSON document describes; whether it fits a scene is not asked here.

    Raises:
        InvalidDocument: With the path and the reason of every fault.
    """
    what = "modification"
    change = read(document, _MODIFICATION, what=what, format_name=MODIFICATION_FORMAT)
    problems = list(modification_problems(change))
    if problems:
        raise InvalidDocument(what, problems)
    return change


RECORDING_FORMAT = "scenario-arena/recording"
COLUMNS = ["x_m", "y_m", "heading_rad", "speed_mps"]

_RECORDING = TypeAdapter(Recording)


def recording_to_document(recording: Recording) -> dict[str, Any]:
    """The recording as a JSON document.

    Raises:
        InvalidDocument: The recording breaks a rule of the format.
    """
    document = write(recording, _RECORDING, format_name=RECORDING_FORMAT)
    format_and_version = {name: document.pop(name) for name in ("format", "version")}
    document = {**format_and_version, "columns": list(COLUMNS), **document}
    recording_from_document(document)
    return document


def recording_from_document(document: object) -> Recording:
    """The recording that a JSON document describes.

    Raises:
        InvalidDocument: With the path and the reason of every fault.
    """
    what, columns = "recording", None
    if isinstance(document, dict):
        columns = document.get("columns")
        document = {name: part for name, part in document.items() if name != "columns"}
    recording = read(document, _RECORDING, what=what, format_name=RECORDING_FORMAT)
    problems = list(_problems(recording))
    if columns != COLUMNS:
        problems.append(("columns", f"expected {', '.join(COLUMNS)} in this order"))
    if problems:
        raise InvalidDocument(what, problems)
    return recording


# Private


def _problems(given: Recording) -> Iterator[tuple[str, str]]:
    times_s = given.times_s.tolist()
    if times_s[0] != 0.0:
        yield path("times_s", 0), f"the first step is t0: 0, got {times_s[0]}"
    for index, (before, after) in enumerate(pairwise(times_s), start=1):
        if after <= before:
            yield path("times_s", index), f"{after} does not follow {before}"
    if len(given.ego) and np.isnan(given.ego[0]).all():
        yield path("ego", 0), "the ego is there at t0"
    lengths = [("ego", len(given.ego))]
    lengths += [(path("tracks", i, "states"), len(t.states)) for i, t in enumerate(given.tracks)]
    for place, length in lengths:
        if length != len(times_s):
            yield place, f"expected {len(times_s)} states, one a step, got {length}"
    seen: set[str] = set()
    for index, track in enumerate(given.tracks):
        if track.agent_id in seen:
            yield path("tracks", index, "agent_id"), f"{track.agent_id!r} has a track already"
        seen.add(track.agent_id)


INTENT_FORMAT = "scenario-arena/intent"

_INTENT = TypeAdapter(Intent)
_ALWAYS_WRITTEN = ("requests", "kind", "body")


def intent_to_document(intent: Intent) -> dict[str, Any]:
    """The intent as a JSON document; open parts and plain defaults are left out."""
    return {"format": INTENT_FORMAT, "version": VERSION, **intent_to_parts(intent)}


def intent_to_parts(intent: Intent) -> dict[str, Any]:
    """The requests, and whatever else the intent says."""
    parts: dict[str, Any] = _written(intent)
    return parts


def intent_from_document(document: object) -> Intent:
    """The intent that a JSON document describes.

    Raises:
        InvalidDocument: With the path and the reason of every fault.
    """
    return _checked(read(document, _INTENT, what="intent", format_name=INTENT_FORMAT))


def intent_from_parts(parts: object) -> Intent:
    """The intent of a document without its frame: what a language model answers.

    Raises:
        InvalidDocument: With the path and the reason of every fault.
    """
    try:
        return _checked(_INTENT.validate_python(parts))
    except ValidationError as fault:
        raise InvalidDocument("intent", problems_of(fault)) from None


def parts_schema() -> dict[str, Any]:
    """The JSON schema of such parts, with a line on each."""
    schema = _INTENT.json_schema()
    for part in (schema, *schema["$defs"].values()):
        part["description"] = part["description"].partition("\n")[0]
        if "const" in part.get("properties", {}).get("kind", {}):
            part["required"] = ["kind"]
    schema["$defs"]["Length"]["required"] = ["low_m"]
    return schema


# Private


def _checked(intent: Intent) -> Intent:
    problems = list(_contradictions(intent))
    if problems:
        raise InvalidDocument("intent", problems)
    return intent


def _contradictions(intent: Intent) -> Iterator[tuple[str, str]]:
    known: list[str] = []
    for number, request in enumerate(intent.requests):
        at, anchor = f"requests[{number}]", request.spot.anchor
        if anchor is not None and anchor not in known:
            names = ", ".join(known) or "none"
            text = f"{anchor!r} is the name of no earlier request; those before it: {names}"
            yield f"{at}.spot.anchor", text
        if request.name and request.name in known:
            yield f"{at}.name", f"{request.name!r} is taken by an earlier request"
        known += [request.name] if request.name else []
        further = {WalkRequest: "behind", CrashRequest: "others"}.get(type(request))
        if further and request.count is not None:
            given = len(getattr(request, further))
            if given > request.count - 1:
                text = f"tells of {given} further ones, but the count is {request.count}"
                yield f"{at}.{further}", text


def _written(value: Any) -> Any:
    """A value as a part of a document, without what is at its default."""
    if isinstance(value, Length):
        written: dict[str, Any] = {"low_m": value.low_m}
        if value.is_range:
            written["high_m"] = value.high_m
        return written | ({"is_approximate": True} if value.is_approximate else {})
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, tuple):
        return [_written(one) for one in value]
    if not is_dataclass(value):
        return value
    return {
        field.name: _written(part)
        for field in fields(value)
        if (part := getattr(value, field.name)) != field.default or field.name in _ALWAYS_WRITTEN
    }


SCENARIO_FORMAT = "scenario-arena/scenario"

ENGLISH = "en"

Parsed = TypeVar("Parsed")
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
        language: Of the instruction.
        instruction: What is to be changed, in the user's words.
        paraphrases: The same wish in other words, each to be answered by the same reference.
        keep_traffic: Whether the recorded traffic stays in the scene.
        notes: What a reader of the catalogue should know; may be empty.
        intent: What the instruction asks for; None where nobody has written it down.
    """

    __pydantic_config__ = CLOSED

    slug: _Words
    scene: _Words
    type: ScenarioType
    language: Annotated[_Language, Field(exclude_if=lambda code: code == ENGLISH)] = ENGLISH
    instruction: _Words
    paraphrases: Annotated[
        tuple[Wording, ...], Field(max_length=20, exclude_if=lambda wordings: not wordings)
    ] = ()
    keep_traffic: Yes
    provenance: _Words
    notes: Text = ""
    intent: Annotated[Intent | None, Field(exclude=True)] = None
    reference: Annotated[Modification, Field(exclude=True)]


_ENTRY = TypeAdapter(CatalogueEntry)


def entry_to_document(entry: CatalogueEntry) -> dict[str, Any]:
    """The entry as a JSON document, the reference last because it is long.

    English and an instruction without paraphrases go without saying.
    """
    return {
        **write(entry, _ENTRY, format_name=SCENARIO_FORMAT),
        "intent": None if entry.intent is None else intent_to_document(entry.intent),
        "reference": modification_to_document(entry.reference),
    }


def entry_from_document(document: object) -> CatalogueEntry:
    """The entry that a JSON document describes; whether it fits its scene is not asked here.

    Raises:
        InvalidDocument: With the path and the reason of every fault.
    """
    if isinstance(document, dict):
        document = dict(document)
        for name, parse in (
            ("reference", modification_from_document),
            ("intent", intent_from_document),
        ):
            if document.get(name) is not None:
                document[name] = _part(name, parse, document[name])
    return read(document, _ENTRY, what="scenario", format_name=SCENARIO_FORMAT)


def _part(name: str, parse: Callable[[object], Parsed], document: object) -> Parsed:
    """A document within the entry's, its faults with their path in the whole."""
    try:
        return parse(document)
    except InvalidDocument as fault:
        problems = [(f"{name}.{path}", text) for path, text in fault.problems]
        raise InvalidDocument("scenario", problems) from None
