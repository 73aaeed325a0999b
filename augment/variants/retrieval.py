"""The paper's function, which the FC variant offers to a language model: one pose on a lane.

As the paper's project page draws it: `retrieve_suitable_pose(lane, agent, dist)` returns
[x, y, heading] and tells nothing else. An offset from the lane is the model's to add.

`LaneTool` is what it shares with ours (pose_tool.py).

Frame: ego frame; dist along the lane from where it begins.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any

import numpy as np
import pydantic
from pydantic import Field

from augment.errors import ToolError
from augment.prompts import vectors
from augment.prompts.blocks import Strict
from augment.prompts.vectors import DEFAULT_RADIUS_M, LaneCurve
from augment.scene.entities import AgentType, Scene, TrafficAgent
from augment.scene.schema import list_problems

FURTHEST_M = 1000.0
OBJECT_TYPES = tuple(kind for kind in AgentType if kind is not AgentType.EGO_VEHICLE)

# Control points this near to those of a piece are that piece: the prompt rounds to 0.01 m.
COPIED_WITHIN_M = 0.05

# Ends of lanes are shown to the centimetre, so a model's length may be this much too long.
_ROUNDING_M = 0.02
_MOST_LISTED = 80

Along = Annotated[float, Field(ge=-FURTHEST_M, le=FURTHEST_M)]
_CONTROL = pydantic.TypeAdapter(
    list[tuple[Along, Along]], config=pydantic.ConfigDict(allow_inf_nan=False)
)


@dataclass(frozen=True, eq=False)
class LaneTool(ABC):
    """A function about the lanes of one scene: make it once, call it often; no call changes it."""

    scene: Scene
    radius_m: float = DEFAULT_RADIUS_M

    @abstractmethod
    def answer_call(self, arguments: object) -> object:
        """Return the answer to a call, ready for JSON.

        Raises:
            ToolError, pydantic.ValidationError: It has none.
        """

    def answer(self, arguments: object) -> Any:
        """Return the answer to the model, ready for JSON, or {"error": a sentence}."""
        try:
            return self.answer_call(arguments)
        except pydantic.ValidationError as fault:
            return {"error": "; ".join(f"{place}: {text}" for place, text in list_problems(fault))}
        except ToolError as fault:
            return {"error": str(fault)}

    def find_line(self, lane: object) -> tuple[LaneCurve, float]:
        """Return the line that a call follows, and its start on it.

        Raises:
            ToolError: Nobody knows it.
        """
        if isinstance(lane, str) and lane in self.curves:
            return self.curves[lane], 0.0
        control = None
        if not isinstance(lane, str):
            try:
                control = vectors.curve_from(_CONTROL.validate_python(lane))
            except ValueError:
                text = "lane must be an id, or the control points of a piece"
                raise ToolError(text) from None
        for curve in self.curves.values():
            for name, piece in zip(curve.pieces, curve.lane, strict=True):
                if name == lane or (
                    control is not None
                    and np.abs(piece.curve.control_m - control.control_m).max() <= COPIED_WITHIN_M
                ):
                    return curve, piece.start_m
        raise ToolError(list_known("lane", lane, self.curves))

    @cached_property
    def curves(self) -> dict[str, LaneCurve]:
        """The shown lanes and connectors by short id."""
        names = vectors.short_names(self._shown)
        return vectors.lane_curves(self._shown, names, self.radius_m)

    @cached_property
    def agents(self) -> dict[str, TrafficAgent]:
        """The shown agents by short id."""
        return {agent.id: agent for agent in vectors.list_agents(self._shown, self.radius_m)}

    @cached_property
    def _shown(self) -> Scene:
        """The scene in the ids that models read and write."""
        return vectors.with_short_ids(self.scene, vectors.short_names(self.scene))


class _Call(Strict):
    lane: Any
    agent: Annotated[str, Field(pattern=f"^({'|'.join(OBJECT_TYPES)})$")]
    dist: Annotated[float, Field(ge=0.0, le=FURTHEST_M)]


class RetrievalTool(LaneTool):
    """The paper's function for one scene."""

    def answer_call(self, arguments: object) -> list[float]:
        """Return [x, y, heading] on a lane's centreline as the prompt rounds, for every type."""
        call = _Call.model_validate(arguments)
        curve, begins_m = self.find_line(call.lane)
        length_m = curve.length_m - begins_m
        if call.dist > length_m + _ROUNDING_M:
            raise ToolError(f"this lane ends after {length_m:.2f}: dist is 0 to that")
        pose = curve.pose_at(begins_m + min(call.dist, length_m))
        # 0.0 is added since JSON would tell minus zero.
        return [
            round(value, digits) + 0.0
            for value, digits in ((pose.x_m, 2), (pose.y_m, 2), (pose.heading_rad, 3))
        ]


def list_known(kind: str, name: object, choices: Iterable[str]) -> str:
    """Say that there is no such one, and which there are."""
    listed = ", ".join([*choices][:_MOST_LISTED])
    return f"there is no {kind} {str(name)[:40]!r}. Known: {listed}."
