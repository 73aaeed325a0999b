"""The paper's function, which the FC variant offers to a language model: one pose on a lane.

As the paper's project page draws it: `retrieve_suitable_pose(lane, agent, dist)` returns
[x, y, heading] and tells nothing else. An offset from the lane is the model's to add.

Frame: ego frame; dist along the lane from where it begins.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any

import pydantic
from pydantic import Field

from augment.errors import ToolError
from augment.geometry.frames import Pose
from augment.prompts.calls import Tools
from augment.prompts.vectors import DEFAULT_RADIUS_M
from augment.scene.entities import Scene
from augment.scene.schema import list_problems
from augment.variants.pose_tool import FURTHEST_M, OBJECT_TYPES, PoseTool

TOOL = Tools.RETRIEVE

# Ends of lanes are shown to the centimetre, so a model's length may be this much too long.
_ROUNDING_M = 0.02


class _Call(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)

    lane: Any
    agent: Annotated[str, Field(pattern=f"^({'|'.join(OBJECT_TYPES)})$")]
    dist: Annotated[float, Field(ge=0.0, le=FURTHEST_M)]


@dataclass(frozen=True, eq=False)
class RetrievalTool:
    """The paper's function for one scene. Pure: no call changes it."""

    scene: Scene
    radius_m: float = DEFAULT_RADIUS_M

    def retrieve_suitable_pose(self, lane: object, dist_m: float) -> Pose:
        """Return the pose on a lane's centreline; it is the same for agents of every type.

        Args:
            lane: The short id of a lane, connector or piece, or the control points of a piece.
            dist_m: Along the direction of travel from the beginning of what `lane` names.

        Raises:
            ToolError: Nobody knows the lane, or it ends before the distance does.
        """
        curve, begins_m = self._lanes.find_line(lane)
        length_m = curve.length_m - begins_m
        if dist_m > length_m + _ROUNDING_M:
            raise ToolError(TOOL, f"this lane ends after {length_m:.2f}: dist is 0 to that")
        return curve.pose_at(begins_m + min(dist_m, length_m))

    def answer(self, arguments: object) -> list[float] | dict[str, object]:
        """Return [x, y, heading] as the prompt rounds, or {"error": a sentence}."""
        try:
            call = _Call.model_validate(arguments)
            pose = self.retrieve_suitable_pose(call.lane, call.dist)
        except pydantic.ValidationError as fault:
            return {"error": "; ".join(f"{place}: {text}" for place, text in list_problems(fault))}
        except ToolError as fault:
            return {"error": fault.problem}
        # 0.0 is added since JSON would tell minus zero.
        return [
            round(value, digits) + 0.0
            for value, digits in ((pose.x_m, 2), (pose.y_m, 2), (pose.heading_rad, 3))
        ]

    @cached_property
    def _lanes(self) -> PoseTool:
        """The shown lanes, under the ids and control points of the prompt."""
        return PoseTool(self.scene, self.radius_m)
