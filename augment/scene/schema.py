"""The shape of the project's own JSON documents, and the sentences for what breaks it.

Values are strict: no text for numbers, no unknown fields, nothing that is not finite. Names carry
their units; frame: ego frame (x forward, y left), `origin` alone is in the source's world frame.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError

from augment.errors import InvalidDocument
from augment.scene.entities import (
    AgentType,
    AreaKind,
    TrafficDensity,
    TrafficLight,
    TrafficSide,
    TurnType,
)

VERSION = 1
SCENE_FORMAT = "scenario-arena/scene"
MODIFICATION_FORMAT = "scenario-arena/modification"
RECORDING_FORMAT = "scenario-arena/recording"

_TURN_RAD = math.ceil(2.0 * math.pi * 1e4) / 1e4

Id = Annotated[str, Field(min_length=1, max_length=40, pattern=r"^[A-Za-z0-9][A-Za-z0-9_.:-]*$")]
Metres = Annotated[float, Field(ge=-100_000.0, le=100_000.0)]
WorldMetres = Annotated[float, Field(ge=-1e8, le=1e8)]
Heading = Annotated[float, Field(ge=-_TURN_RAD, le=_TURN_RAD)]
Size = Annotated[float, Field(gt=0.0, le=100.0)]
Speed = Annotated[float, Field(ge=0.0, le=100.0)]
Limit = Annotated[float, Field(gt=0.0, le=100.0)]
PointPair = Annotated[list[Metres], Field(min_length=2, max_length=2)]
# The first fault of a line is told, and lists have an end: a broken file of some megabytes is
# refused as fast as it is read.
MOST_POINTS = 100_000
MOST_AGENTS = 5_000
MOST_WAYS = 50_000
Line = Annotated[list[PointPair], Field(fail_fast=True, min_length=2, max_length=MOST_POINTS)]
Ring = Annotated[list[PointPair], Field(fail_fast=True, min_length=3, max_length=MOST_POINTS)]
# Strict mode would ask for the enum itself; in JSON a member is its text.
AgentTypeText = Annotated[AgentType, Strict(False)]
AreaKindText = Annotated[AreaKind, Strict(False)]
LightText = Annotated[TrafficLight, Strict(False)]
SideText = Annotated[TrafficSide, Strict(False)]
TurnText = Annotated[TurnType, Strict(False)]
DensityText = Annotated[TrafficDensity, Strict(False)]


class Document(BaseModel):
    """Strict, closed, finite."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)


class AgentDocument(Document):
    """A `TrafficAgent`."""

    id: Id
    type: AgentTypeText
    x_m: Metres
    y_m: Metres
    heading_rad: Heading
    width_m: Size
    length_m: Size
    speed_mps: Speed = 0.0
    lane_id: Id | None = None
    walk_to_m: PointPair | None = None


Agents = Annotated[list[AgentDocument], Field(max_length=MOST_AGENTS)]


class LaneDocument(Document):
    """A `Lane`."""

    id: Id
    centerline_m: Line
    width_m: Size
    speed_limit_mps: Limit | None = None
    left_boundary_m: Line | None = None
    right_boundary_m: Line | None = None
    left_neighbor: Id | None = None
    right_neighbor: Id | None = None
    successors: Annotated[list[Id], Field(fail_fast=True, max_length=MOST_WAYS)] = []


class ConnectorDocument(Document):
    """A `LaneConnector`."""

    id: Id
    from_lane: Id | None = None
    to_lane: Id | None = None
    centerline_m: Line
    width_m: Size
    traffic_light: LightText = TrafficLight.NONE
    turn_type: TurnText = TurnType.STRAIGHT
    speed_limit_mps: Limit | None = None
    left_boundary_m: Line | None = None
    right_boundary_m: Line | None = None


class AreaDocument(Document):
    """An `Area`."""

    id: Id
    kind: AreaKindText
    boundary_m: Ring


class OriginDocument(Document):
    """An `Origin`: where the ego frame lies in the source's world frame."""

    frame: Annotated[str, Field(min_length=1, max_length=200)]
    x_m: WorldMetres
    y_m: WorldMetres
    heading_rad: Heading


class SceneOptionsDocument(Document):
    """The `SceneOptions`."""

    density: DensityText = TrafficDensity.NONE
    goal: TurnText | None = None
    goal_m: PointPair | None = None


class SceneDocument(Document):
    """A `Scene`."""

    format: str
    version: int
    name: Annotated[str, Field(min_length=1, max_length=200)]
    provenance: Annotated[str, Field(min_length=1)]
    traffic_side: SideText
    origin: OriginDocument
    ego: AgentDocument
    agents: Agents = []
    lanes: Annotated[list[LaneDocument], Field(max_length=MOST_WAYS)] = []
    connectors: Annotated[list[ConnectorDocument], Field(max_length=MOST_WAYS)] = []
    areas: Annotated[list[AreaDocument], Field(max_length=MOST_WAYS)] = []
    options: SceneOptionsDocument = SceneOptionsDocument()


class ModificationDocument(Document):
    """A `Modification`; all three lists empty means that nothing changes."""

    format: str
    version: int
    add: Agents = []
    move: Agents = []
    remove: Annotated[list[Id], Field(fail_fast=True, max_length=MOST_AGENTS)] = []


Read = TypeVar("Read", bound=Document)


def read(document: object, model: type[Read], *, what: str, format_name: str) -> Read:
    """The document in its typed shape.

    Args:
        document: What `json.loads` returned, or a dict like it.
        model: The shape.
        what: The kind of document, for the sentence.
        format_name: What its "format" must say.

    Raises:
        InvalidDocument: With one problem a fault, each with its path inside the document.
    """
    if not isinstance(document, dict):
        raise InvalidDocument(what, [("", f"expected an object, got {type(document).__name__}")])
    if document.get("format") != format_name:
        given = _shown(document.get("format"))
        raise InvalidDocument(what, [("format", f"expected {format_name!r}, got {given}")])
    version = document.get("version")
    if type(version) is not int or version != VERSION:
        text = f"version {_shown(version)} is not known; this program reads version {VERSION}"
        raise InvalidDocument(what, [("version", text)])
    try:
        return model.model_validate(document)
    except ValidationError as fault:
        raise InvalidDocument(what, problems_of(fault)) from None


def problems_of(fault: ValidationError) -> list[tuple[str, str]]:
    """Each fault that pydantic found, as its path and a sentence."""
    return [(path(*error["loc"]), _sentence(error)) for error in fault.errors(include_url=False)]


def path(*steps: int | str) -> str:
    """A place inside a document: `lanes[3].centerline_m[0][1]`."""
    shown = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in steps)
    return shown.removeprefix(".")


# Private


def _sentence(error: Any) -> str:
    if error["type"] == "missing":
        return "is missing"
    if error["type"] == "extra_forbidden":
        return "is not a field of this format"
    return f"{error['msg']}, got {_shown(error['input'])}"


def _shown(value: object) -> str:
    if isinstance(value, (dict, list)):
        return f"a {'list' if isinstance(value, list) else 'object'} of {len(value)}"
    text = repr(value) if not isinstance(value, int) or abs(value) < 1e30 else "a huge number"
    return text if len(text) <= 60 else text[:57] + "..."
