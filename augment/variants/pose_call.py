"""One call of the tool `pose_on_lane`, read strictly from what a language model wrote."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from augment.errors import ToolError
from augment.geometry.bezier import CubicBezier
from augment.prompts.calls import PARAMETERS, TOOL
from augment.prompts.vectors import curve_from
from augment.scene.entities import AgentType

LANE_START = "lane"
"""The start that means the beginning of the lane; any other start is an agent's id."""

FURTHEST_M = 1000.0
WIDEST_M = 30.0
MOST_PLACES = 16
"""So many distances may be asked for in one call."""

OBJECT_TYPES = tuple(kind for kind in AgentType if kind is not AgentType.EGO_VEHICLE)


class AskedPlace(NamedTuple):
    """One place of a call.

    Attributes:
        distance_m: From the start along the lane, negative to go back.
        lateral_m: To its left, negative to its right.
        object_type: Of what is to stand there.
    """

    distance_m: float
    lateral_m: float
    object_type: AgentType


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseCall:
    """The arguments of a call.

    Attributes:
        lane: The id of a lane, a connector or a piece, or a curve given by its control points.
        start: "lane" or an agent's id.
        places: What is asked for, in order.
        is_list: Whether several were asked for, be it a list of one.
    """

    lane: str | CubicBezier
    start: str
    places: tuple[AskedPlace, ...]
    is_list: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class CallLimits:
    """How often a model may call its tools before it has to answer.

    Attributes:
        calls: In one round.
        identical: Of these with the very same arguments.
    """

    calls: int = 8
    identical: int = 3

    def check(self, earlier: Sequence[object], arguments: object) -> None:
        """Refuse a call that is one too many after the earlier ones of the round.

        Raises:
            ToolError: It is.
        """
        if len(earlier) >= self.calls:
            raise ToolError(
                TOOL, f"no call is left: {self.calls} are allowed. Answer with what you have."
            )
        if sum(call == arguments for call in earlier) >= self.identical:
            raise ToolError(
                TOOL,
                f"this very call was answered {self.identical} times and its answer does not "
                "change. Answer with what you have.",
            )


def read_call(arguments: object) -> PoseCall:
    """The arguments as a typed call.

    Raises:
        ToolError: They are not; the sentence names the argument and what is allowed.
    """
    if not isinstance(arguments, Mapping):
        raise ToolError(TOOL, f"the arguments must be one JSON object with {_listed(PARAMETERS)}")
    unknown = [str(name)[:40] for name in arguments if name not in PARAMETERS]
    if unknown:
        raise ToolError(
            TOOL, f"there is no argument {unknown[0]!r}; there are {_listed(PARAMETERS)}"
        )
    missing = [name for name in PARAMETERS[:3] if name not in arguments]
    if missing:
        raise ToolError(TOOL, f"{_listed(missing)} must be given")
    start = arguments["start"]
    if not isinstance(start, str):
        raise ToolError(TOOL, f'start must be "{LANE_START}" or the id of an agent')
    return PoseCall(
        lane=_lane(arguments["lane"]),
        start=start,
        places=_places(arguments),
        is_list=any(isinstance(arguments.get(name), list) for name in PARAMETERS[2:]),
    )


# Private


def _places(arguments: Mapping[str, object]) -> tuple[AskedPlace, ...]:
    """The places of a call; what is no list goes with each of the others."""
    along = _numbers("distance_m", arguments["distance_m"], FURTHEST_M)
    aside = _numbers("lateral_m", arguments.get("lateral_m", 0.0), WIDEST_M)
    kinds = _object_types(arguments.get("object", AgentType.VEHICLE.value))
    count = max(len(along), len(aside), len(kinds))
    lists = {"distance_m": len(along), "lateral_m": len(aside), "object": len(kinds)}
    for name, length in lists.items():
        if length != count and isinstance(arguments.get(name), list):
            longest = next(other for other, most in lists.items() if most == count)
            raise ToolError(
                TOOL,
                f"{name} is a list of {length} and {longest} one of {count}: make them equally "
                "long, or give one value for all places",
            )
    return tuple(
        AskedPlace(along[n % len(along)], aside[n % len(aside)], kinds[n % len(kinds)])
        for n in range(count)
    )


def _object_types(value: object) -> tuple[AgentType, ...]:
    listed = value if isinstance(value, list) else [value]
    names = [kind.value for kind in OBJECT_TYPES]
    if not 1 <= len(listed) <= MOST_PLACES or any(one not in names for one in listed):
        raise ToolError(
            TOOL,
            f"object must be one of {_listed(names)}, or a list of 1 to {MOST_PLACES} of them",
        )
    return tuple(AgentType(str(one)) for one in listed)


def _numbers(name: str, value: object, limit: float) -> tuple[float, ...]:
    if not isinstance(value, list):
        return (_number(name, value, limit),)
    if not 1 <= len(value) <= MOST_PLACES:
        raise ToolError(TOOL, f"{name} must be a number or a list of 1 to {MOST_PLACES} numbers")
    return tuple(_number(name, one, limit) for one in value)


def _lane(value: object) -> str | CubicBezier:
    if isinstance(value, str):
        return value
    form = (
        "lane must be an id or four control points [[x, y], [x, y], [x, y], [x, y]], "
        "or the two ends of a straight piece"
    )
    if not (isinstance(value, list) and len(value) in (2, 4)):
        raise ToolError(TOOL, form)
    if not all(isinstance(point, list) and len(point) == 2 for point in value):
        raise ToolError(TOOL, form)
    try:
        return curve_from([[_number("lane", x, FURTHEST_M) for x in point] for point in value])
    except ValueError as fault:
        raise ToolError(TOOL, f"lane: {fault}") from None


def _number(name: str, value: object, limit: float) -> float:
    # True is a number to Python, and an integer may be too large for a float.
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ToolError(TOOL, f"{name} must be a number, without quotes and without a unit")
    if not (abs(value) <= limit and math.isfinite(value)):
        raise ToolError(TOOL, f"{name} must be between {-limit:g} and {limit:g}")
    return float(value)


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names)
