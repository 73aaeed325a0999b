"""The lanes across the ego's route: its own, those left and right of it, the oncoming one.

Frame: the scene's. Left is left of the route, in its direction of travel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from augment.checks.ground import Ground
from augment.checks.lane_index import Beside, LaneIndex, best_aligned
from augment.geometry.frames import difference
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import TurnType
from augment.scene.intent import LaneChoice

_BESIDE_M = 1.0
"""A lane whose centre is nearer than this is the same lane."""
_ALONG_DEG, _AGAINST_DEG = 45.0, 135.0
_JOINT_M = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Band:
    """A lane at one station: where its centre is, left of the route, and how it runs there."""

    left_m: float
    width_m: float
    tangent_rad: float


@dataclass(frozen=True, kw_only=True, eq=False)
class LanesAcross:
    """The ego's route, and the lanes that lie beside it at any station."""

    route: EgoRoute
    lanes: LaneIndex

    @classmethod
    def of(cls, ground: Ground, turn: TurnType = TurnType.STRAIGHT) -> LanesAcross | None:
        """Those of the ground's ego, None where the map has no lane for it.

        Args:
            ground: Of the scene.
            turn: Which way the route goes where the lanes part.
        """
        route = ground.route
        if turn is not TurnType.STRAIGHT:
            route = EgoRoute.of(ground.scene, ground.graph, turn=turn)
        return None if route is None else cls(route=route, lanes=ground.lanes)

    def band(self, choice: LaneChoice, ahead_m: float) -> Band | None:
        """The lane of that choice, None where there is none there."""
        tangent_rad = self.route.heading_at(ahead_m)
        near = self.lanes.beside(*self.route.position(ahead_m))
        if choice is LaneChoice.OWN:
            own = best_aligned(near, tangent_rad)
            if own is None:
                return None
            return Band(left_m=0.0, width_m=own.width_m, tangent_rad=tangent_rad)
        return min(
            (band for lane in near if (band := _band(lane, tangent_rad, choice))),
            key=lambda band: abs(band.left_m),
            default=None,
        )


# Private


def _band(lane: Beside, tangent_rad: float, choice: LaneChoice) -> Band | None:
    """A lane beside the own one as one of the choice, None where it is not."""
    turn_deg = math.degrees(abs(difference(lane.tangent_rad, tangent_rad)))
    is_along, is_against = turn_deg < _ALONG_DEG, turn_deg > _AGAINST_DEG
    left_m = lane.d_m if is_against else -lane.d_m
    if lane.beyond_m > _JOINT_M or abs(left_m) < _BESIDE_M:
        return None
    fits = {
        LaneChoice.LEFT: is_along and left_m > 0.0,
        LaneChoice.RIGHT: is_along and left_m < 0.0,
        LaneChoice.ONCOMING: is_against,
        LaneChoice.OWN: False,
    }
    if not fits[choice]:
        return None
    return Band(left_m=left_m, width_m=lane.width_m, tangent_rad=lane.tangent_rad)
