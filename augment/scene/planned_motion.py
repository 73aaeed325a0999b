"""Planned motion of an agent after t0: its path, its speeds, and its trigger.

Frame: the scene's. Distances between road users run straight from centre to centre.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, TypeAdapter, model_validator

from augment.scene.schema import CLOSED, Codec, Id, LabelEnum, Metres, PointPair, Real, Speed, Yes

EGO_ID = "Agent1"
"""The ego's id in every scene."""
CHANGE_M = 20.0
"""A lane change takes this long along the lane, where nobody says."""
MOST_TOLD = 4
"""So many points or speeds are told in words."""
REACHED_M = 2.0
"""Somebody is at a place this near to it, where nobody says."""


class MotionPreset(LabelEnum):
    """Critical motions by name; each is a type of the catalogue's moving set as well."""

    CUT_IN = "cut_in", "Cut-in"
    HARD_BRAKING = "hard_braking", "Hard braking"
    LATE_PEDESTRIAN = "late_pedestrian", "Pedestrian starts late"
    DOOR_OPENING = "door_opening", "Door opens"
    U_TURN = "u_turn", "U-turn"
    RED_LIGHT = "red_light", "Red light is run"
    EMERGENCY_STOP = "emergency_stop", "Emergency stop behind a bend"
    PULL_OUT = "pull_out", "Parked car pulls out"


Seconds = Annotated[Real, Field(ge=0.0, le=60.0)]
_Near = Annotated[Real, Field(gt=0.0, le=500.0)]


@dataclass(frozen=True, slots=True, kw_only=True)
class LanePath:
    """Along lanes: each follows the one before, or runs beside it and is changed to.

    Attributes:
        lane_ids: From the lane at which it sets out, or onto which it pulls out from beside it;
            after the last the straightest follow.
        change_m: How far along the lane a change takes, a smooth one.
    """

    kind: Literal["lanes"] = "lanes"
    lane_ids: Annotated[tuple[Id, ...], Field(fail_fast=True, min_length=1, max_length=20)]
    change_m: Annotated[Real, Field(ge=1.0, le=200.0)] = CHANGE_M

    def __str__(self) -> str:
        return f"along {', '.join(self.lane_ids)}"


@dataclass(frozen=True, slots=True, kw_only=True)
class PointPath:
    """From where it is along a smooth line through points; at the last it stands.

    Attributes:
        keeps_heading: It moves without turning, as a door that slides.
    """

    kind: Literal["points"] = "points"
    points_m: Annotated[tuple[PointPair, ...], Field(fail_fast=True, min_length=1, max_length=200)]
    keeps_heading: Yes = False

    def __str__(self) -> str:
        shown = ", ".join(f"({x_m:.1f}, {y_m:.1f})" for x_m, y_m in self.points_m[:MOST_TOLD])
        more = len(self.points_m) - MOST_TOLD
        return f"through {shown}" + (f" and {more} more" if more > 0 else "")


@dataclass(frozen=True, slots=True, kw_only=True)
class AtTime:
    """A moment after t0."""

    kind: Literal["time"] = "time"
    after_s: Seconds = 0.0

    def __str__(self) -> str:
        return f"after {self.after_s:g} s" if self.after_s else "at once"


@dataclass(frozen=True, slots=True, kw_only=True)
class NearEgo:
    """As soon as the ego is this near."""

    kind: Literal["ego_distance"] = "ego_distance"
    within_m: _Near

    def __str__(self) -> str:
        return f"when the ego is within {self.within_m:g} m"


@dataclass(frozen=True, slots=True, kw_only=True)
class AtPlace:
    """As soon as somebody is at a place: the ego, or another agent by its id."""

    kind: Literal["place"] = "place"
    agent_id: Id = EGO_ID
    x_m: Metres
    y_m: Metres
    within_m: _Near = REACHED_M

    def __str__(self) -> str:
        place = f"({self.x_m:g}, {self.y_m:g})"
        return f"when {self.agent_id} is within {self.within_m:g} m of {place}"


Path = Annotated[LanePath | PointPath, Field(discriminator="kind")]
Trigger = Annotated[AtTime | NearEgo | AtPlace, Field(discriminator="kind")]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedMotion:
    """Path, speeds and start; whoever has one reacts to nobody.

    Until it starts, an agent goes on as it would without: it holds its speed along its lane.

    Attributes:
        path: None to go on along its lane.
        speeds: Pairs of seconds since the start and m/s, linear between them; from its own speed
            at the start on unless the first pair is of 0 s, and the last is held.
        start: If it never comes to that, nothing changes.
    """

    __pydantic_config__ = CLOSED

    path: Path | None = None
    speeds: Annotated[tuple[tuple[Seconds, Speed], ...], Field(fail_fast=True, max_length=50)] = ()
    start: Trigger = AtTime()

    @model_validator(mode="after")
    def _has_speeds_in_order(self) -> Self:
        for (before_s, _), (after_s, _) in pairwise(self.speeds):
            if after_s <= before_s:
                raise ValueError(f"speeds: {after_s:g} s does not follow {before_s:g} s")
        return self

    def __str__(self) -> str:
        speeds = [f"{speed:g} m/s after {since:g} s" for since, speed in self.speeds[:MOST_TOLD]]
        if len(self.speeds) > MOST_TOLD:
            speeds.append(f"and {len(self.speeds) - MOST_TOLD} more")
        parts = [f"sets out {self.start}", *([str(self.path)] if self.path else []), *speeds]
        return ", ".join(parts)


MOTION = Codec("motion", TypeAdapter(PlannedMotion))
