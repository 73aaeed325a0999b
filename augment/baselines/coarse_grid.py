"""Coarse grid baseline, inspired by LCTGen's code of a scene: what brackets alone cost.

The rule placer's own placement becomes a code, and the code alone is placed again: somewhere on
the centrelines that it leaves open, drawn by a seed. Everything finer is lost, and what is no
vehicle has no code at all. The numbers of a code are those that LCTGen's published prompts name
for an actor. It is not LCTGen: that has a trained network where this has a draw, and a language
model where this has the best code there can be.
Frame: ego frame; x ahead, y to the left.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from augment.baselines import rule_placer
from augment.errors import CannotPlace
from augment.geometry.frames import Pose, difference, overlap
from augment.scene import intent as wish
from augment.scene.entities import AgentType, Scene, TrafficAgent
from augment.scene.lane_graph import LaneGraph

FURTHEST_M = 72.0
BIN_M = 5.0
"""Width of a bin of the distance, the finer of the two in LCTGen's prompts."""
SPEED_BIN_MPS = 2.5
_LEFT_FROM_M = 0.005
"""What lies on the ego's own axis is on its right; half a centimetre is no side."""
_STEP_M = 0.5
_DRAWS = 50
_NO_VEHICLES = (wish.Body.BICYCLE, wish.Body.BARRIER, wish.Body.CONSTRUCTION_SIGN)


class Direction(IntEnum):
    """Heading relative to the ego, to 45 degrees."""

    SAME = 0
    OPPOSITE = 1
    ACROSS_TO_LEFT = 2
    ACROSS_TO_RIGHT = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Code:
    """One vehicle, without a class, a size, a lateral offset or an angle.

    Attributes:
        is_ahead, is_left: The quadrant of the centre, seen from the ego's.
        distance_bin: Of the straight line to the ego's centre, counted from 0.
        speed_bin: In steps of 2.5 m/s, counted from 0; None where it stands.
    """

    is_ahead: bool
    is_left: bool
    distance_bin: int
    direction: Direction
    speed_bin: int | None

    @property
    def speed_mps(self) -> float:
        """The middle of its bin, 0 where it stands."""
        return 0.0 if self.speed_bin is None else (self.speed_bin + 0.5) * SPEED_BIN_MPS


def quantise(agent: TrafficAgent) -> Code:
    """Return the coarse code of a vehicle."""
    ahead, left, bins = _find_cells(np.array([[agent.x_m, agent.y_m]]))
    return Code(
        is_ahead=bool(ahead[0]),
        is_left=bool(left[0]),
        distance_bin=int(bins[0]),
        direction=_direction(agent.heading_rad),
        speed_bin=int(agent.speed_mps / SPEED_BIN_MPS) if agent.speed_mps > 0.0 else None,
    )


def _find_cells(
    points_m: NDArray[np.float64],
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.float64]]:
    """Return which points (P, 2) are ahead, which to the left, and their bins up to 72 m, (P,)."""
    away_m = np.minimum(np.hypot(points_m[:, 0], points_m[:, 1]), FURTHEST_M)
    return points_m[:, 0] > 0.0, points_m[:, 1] > _LEFT_FROM_M, away_m // BIN_M


def _direction(heading_rad: float) -> Direction:
    turn_rad = difference(heading_rad, 0.0)
    if abs(turn_rad) < math.radians(45.0):
        return Direction.SAME
    if abs(turn_rad) > math.radians(135.0):
        return Direction.OPPOSITE
    return Direction.ACROSS_TO_LEFT if turn_rad > 0.0 else Direction.ACROSS_TO_RIGHT


def place(scene: Scene, intent: wish.Intent | None, *, seed: int = 0) -> rule_placer.Placement:
    """Put vehicles where their codes allow; the same for the same seed.

    Args:
        scene: Where.
        intent: What is asked for.
        seed: Of the draws.

    Raises:
        CannotPlace: Something that is no vehicle is asked for, the rule placer
            refuses the intent, or no place is left.
    """
    for request in () if intent is None else intent.requests:
        is_other = isinstance(request, wish.VehicleRequest) and request.body in _NO_VEHICLES
        if is_other or isinstance(
            request, wish.WalkRequest | wish.ConesRequest | wish.DoorRequest
        ):
            raise CannotPlace("The code knows vehicles alone, and something else is asked for.")
    right = rule_placer.place(scene, intent, seed=seed).modification
    standing = [agent for agent in scene.everyone if agent.id not in right.replaced]
    rng = np.random.default_rng(seed)
    places = _Places(scene)
    placed: list[TrafficAgent] = []
    notes = []
    for agent in right.changed:
        drawn = places.draw(quantise(agent), [*standing, *placed], rng)
        if drawn is None:
            notes.append(f"{agent.id} is left out: no place was free.")
        else:
            placed.append(replace(drawn, id=agent.id))
    if right.changed and not placed:
        raise CannotPlace("Every place that the code allows is taken.")
    changes = right.with_changed(placed)
    return rule_placer.Placement(modification=changes, notes=" ".join(notes))


class _Places:
    """Points every half metre along all centrelines within reach of a code.

    Raises:
        CannotPlace: No centreline comes near enough to the ego.
    """

    def __init__(self, scene: Scene) -> None:
        points, headings, ids = [], [], list[str]()
        for lane in LaneGraph(scene).lanes.values():
            line = lane.centerline
            at_m = np.arange(_STEP_M / 2.0, line.length_m, _STEP_M)
            points_m = line.points_at(at_m)
            near = np.hypot(points_m[:, 0], points_m[:, 1]) <= FURTHEST_M
            points.append(points_m[near])
            headings += [line.heading_at(s_m) for s_m in at_m[near].tolist()]
            ids += [lane.id] * int(near.sum())
        if not ids:
            raise CannotPlace(f"No lane lies within {FURTHEST_M:g} m of the ego.")
        self._points, self._headings, self._lane_ids = np.vstack(points), headings, ids

    def draw(
        self, code: Code, others: Sequence[TrafficAgent], rng: np.random.Generator
    ) -> TrafficAgent | None:
        """Return a vehicle at a place of its code, None where every draw met somebody else."""
        allowed = self._list_allowed(code)
        for _ in range(_DRAWS):
            index = int(rng.choice(allowed))
            x_m, y_m = self._points[index].round(3).tolist()
            pose = Pose(x_m=x_m, y_m=y_m, heading_rad=round(self._headings[index], 5))
            vehicle = TrafficAgent.at(
                AgentType.VEHICLE, pose, lane_id=self._lane_ids[index], speed_mps=code.speed_mps
            )
            if not any(overlap(vehicle.box, other.box).depth_m > 0.0 for other in others):
                return vehicle
        return None

    def _list_allowed(self, code: Code) -> NDArray[np.intp]:
        """Return the indices of the places that a code leaves open.

        Until some place is left, its side is given up, its direction, both, all but the bin, and
        in the end the bin, of which the nearest with a lane counts.
        """
        ahead, left, bins = _find_cells(self._points)
        gaps = np.abs(bins - code.distance_bin)
        same_end = (gaps == 0) & (ahead == code.is_ahead)
        in_quadrant = same_end & (left == code.is_left)
        facing = np.array([_direction(rad) is code.direction for rad in self._headings])
        choices = (in_quadrant & facing, same_end & facing, in_quadrant, same_end)
        return next(
            (np.flatnonzero(choice) for choice in choices if choice.any()),
            np.flatnonzero(gaps == gaps.min()),
        )
