"""LCTGen-inspired quantised code, without its neural generator: what brackets alone cost.

The rule placer's own placement becomes a code (`quantised_code`), and the code alone is placed
again: somewhere on the centrelines that it leaves open, drawn by a seed. Everything finer is
lost, and what is no vehicle has no code at all. It is not LCTGen: that has a trained network
where this has a draw, and a language model where this has the best code there can be.
Frame: ego frame.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from augment.baselines import rule_placer
from augment.errors import CannotPlace
from augment.geometry.frames import difference, overlap
from augment.geometry.polyline import Polyline
from augment.scene.entities import LENGTH_WIDTH_M, AgentType, Modification, Scene, TrafficAgent
from augment.scene.intent import Body, ConesRequest, Intent, VehicleRequest, WalkRequest
from augment.scene.lane_graph import AnyLane

FURTHEST_M = 72.0
SPEED_BIN_MPS = 2.5
_LEFT_FROM_M = 0.005
"""What lies on the ego's own axis is on its right; half a centimetre is no side."""


class Quadrant(IntEnum):
    """Where the centre lies, seen from the ego's."""

    FRONT_LEFT = 0
    BACK_LEFT = 1
    BACK_RIGHT = 2
    FRONT_RIGHT = 3

    @property
    def is_front(self) -> bool:
        """Whether it lies ahead of the ego."""
        return self in (Quadrant.FRONT_LEFT, Quadrant.FRONT_RIGHT)


class Direction(IntEnum):
    """Which way it faces against the ego, to 45 degrees."""

    SAME = 0
    OPPOSITE = 1
    ACROSS_TO_LEFT = 2
    ACROSS_TO_RIGHT = 3


class Action(IntEnum):
    """What it does next, as far as anybody can ask for it here."""

    STOP = 0
    KEEP_SPEED = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Code:
    """One vehicle, without a class, a size, a lateral offset or an angle.

    Attributes:
        distance_bin: Of the straight line to the ego's centre, counted from 0.
        speed_bin: In steps of 2.5 m/s, counted from 0.
    """

    quadrant: Quadrant
    distance_bin: int
    direction: Direction
    speed_bin: int
    action: Action

    @property
    def speed_mps(self) -> float:
        """The middle of its bin, 0 where it stops."""
        if self.action is Action.STOP:
            return 0.0
        return (self.speed_bin + 0.5) * SPEED_BIN_MPS

    def words(self, bin_m: float) -> str:
        """The code for people, with the edges of its bin."""
        where = self.quadrant.name.replace("_", " ").lower()
        facing = self.direction.name.replace("_", " ").lower()
        low_m = self.distance_bin * bin_m
        if self.action is Action.STOP:
            does = "stands"
        else:
            low_mps = self.speed_bin * SPEED_BIN_MPS
            does = f"drives at {low_mps:g} to {low_mps + SPEED_BIN_MPS:g} m/s"
        return f"{where}, {low_m:g} to {low_m + bin_m:g} m away, direction {facing}, {does}"


def code_of(agent: TrafficAgent, *, bin_m: float) -> Code:
    """What is left of a vehicle.

    Args:
        agent: The vehicle.
        bin_m: The width of a bin of the distance.
    """
    centre = np.array([[agent.x_m, agent.y_m]])
    return Code(
        quadrant=Quadrant(int(quadrants_of(centre)[0])),
        distance_bin=int(bins_of(centre, bin_m=bin_m)[0]),
        direction=direction_of(agent.heading_rad),
        speed_bin=int(agent.speed_mps / SPEED_BIN_MPS),
        action=Action.KEEP_SPEED if agent.speed_mps > 0.0 else Action.STOP,
    )


def quadrants_of(points_m: NDArray[np.float64]) -> NDArray[np.int64]:
    """The quadrants (P,) of points (P, 2)."""
    ahead, left = points_m[:, 0] > 0.0, points_m[:, 1] > _LEFT_FROM_M
    front = np.where(left, int(Quadrant.FRONT_LEFT), int(Quadrant.FRONT_RIGHT))
    back = np.where(left, int(Quadrant.BACK_LEFT), int(Quadrant.BACK_RIGHT))
    return np.where(ahead, front, back).astype(np.int64)


def bins_of(points_m: NDArray[np.float64], *, bin_m: float) -> NDArray[np.int64]:
    """The bins (P,) of the distances of points (P, 2); what is further than 72 m counts as 72."""
    away_m = np.minimum(np.hypot(points_m[:, 0], points_m[:, 1]), FURTHEST_M)
    return np.asarray(away_m // bin_m, dtype=np.int64)


def direction_of(heading_rad: float) -> Direction:
    """The direction of a heading against the ego's, which is 0."""
    turn_rad = difference(heading_rad, 0.0)
    if abs(turn_rad) < math.radians(45.0):
        return Direction.SAME
    if abs(turn_rad) > math.radians(135.0):
        return Direction.OPPOSITE
    return Direction.ACROSS_TO_LEFT if turn_rad > 0.0 else Direction.ACROSS_TO_RIGHT


_STEP_M = 0.5
_DRAWS = 50
_UNKNOWN = {WalkRequest: "pedestrians", ConesRequest: "cones"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Places:
    """Points every half metre along all centrelines within reach of a code.

    Attributes:
        points_m, headings_rad: (P, 2) and (P,), in the direction of travel.
        lane_ids: Of the lane or connector, (P,).
    """

    points_m: NDArray[np.float64]
    headings_rad: NDArray[np.float64]
    lane_ids: tuple[str, ...]


def place(
    scene: Scene, intent: Intent | None, *, bin_m: float, seed: int = 0
) -> rule_placer.Placement:
    """Vehicles where their codes allow; the same for the same seed.

    Args:
        scene: Where.
        intent: What is asked for.
        bin_m: The width of a bin of the distance, 5 or 20 m in LCTGen's prompts.
        seed: Of the draws.

    Raises:
        CannotPlace: Something that is no vehicle is asked for, the rule placer
            refuses the intent, or no place is left.
    """
    _refuse_others(intent)
    right = rule_placer.place(scene, intent, seed=seed)
    vehicles = right.modification.changed
    codes = tuple(code_of(agent, bin_m=bin_m) for agent in vehicles)
    gone = {*right.modification.removed, *(agent.id for agent in right.modification.moved)}
    left = [agent for agent in scene.everyone if agent.id not in gone]
    rng = np.random.default_rng(seed)
    places = places_of(scene)
    added: list[TrafficAgent] = []
    notes = []
    for agent, code in zip(vehicles, codes, strict=True):
        allowed, relaxed = allowed_by(code, places, bin_m=bin_m)
        drawn = _drawn(code, agent.id, places, allowed, (*left, *added), rng)
        notes.append(f"{agent.id}: {code.words(bin_m)}{relaxed}.")
        if drawn is None:
            notes.append(f"{agent.id} is left out: no place was free.")
        else:
            added.append(drawn)
    if vehicles and not added:
        raise CannotPlace("Every place that the code allows is taken.")
    moved = {agent.id for agent in right.modification.moved}
    return rule_placer.Placement(
        modification=Modification(
            added=tuple(agent for agent in added if agent.id not in moved),
            moved=tuple(agent for agent in added if agent.id in moved),
            removed=right.modification.removed,
        ),
        notes=" ".join(notes),
    )


def places_of(scene: Scene) -> Places:
    """Where vehicles can be put, whatever the code; every place lies on a centreline.

    Raises:
        CannotPlace: No centreline comes near enough to the ego.
    """
    points, headings, ids = [], [], []
    lanes: list[AnyLane] = [*scene.lanes, *scene.connectors]
    for lane in lanes:
        points_m, turned = _along(lane.centerline)
        near = np.hypot(points_m[:, 0], points_m[:, 1]) <= FURTHEST_M
        points.append(points_m[near])
        headings.append(turned[near])
        ids += [lane.id] * int(near.sum())
    if not ids:
        raise CannotPlace(f"No lane lies within {FURTHEST_M:g} m of the ego.")
    return Places(
        points_m=np.vstack(points), headings_rad=np.concatenate(headings), lane_ids=tuple(ids)
    )


def allowed_by(code: Code, places: Places, *, bin_m: float) -> tuple[NDArray[np.intp], str]:
    """Indices of the places that a code leaves open, and in words what had to be given up.

    Given up, until some place is left: the side, the direction, both, all but the bin, and in the
    end the bin, of which the nearest with a lane counts.
    """
    bins = bins_of(places.points_m, bin_m=bin_m)
    in_bin = bins == code.distance_bin
    in_quadrant = quadrants_of(places.points_m) == code.quadrant
    ahead = (places.points_m[:, 0] > 0.0) == code.quadrant.is_front
    facing = np.array([direction_of(heading) is code.direction for heading in places.headings_rad])
    for choice, given_up in (
        (in_bin & in_quadrant & facing, ""),
        (in_bin & ahead & facing, ", its side given up"),
        (in_bin & in_quadrant, ", its direction given up"),
        (in_bin & ahead, ", its side and direction given up"),
        (in_bin, ", all but the distance given up"),
    ):
        if choice.any():
            return np.flatnonzero(choice), given_up
    gaps = np.abs(bins - code.distance_bin)
    return np.flatnonzero(gaps == gaps.min()), ", only the nearest bin with a lane kept"


# --- Private -----------------------------------------------------------------------------------


def _refuse_others(intent: Intent | None) -> None:
    requests = () if intent is None else intent.requests
    asked = [
        name
        for kind, name in _UNKNOWN.items()
        if any(isinstance(request, kind) for request in requests)
    ]
    bodies = {request.body for request in requests if isinstance(request, VehicleRequest)}
    asked += [f"{body}s" for body in _NO_VEHICLES if body in bodies]
    if asked:
        raise CannotPlace(
            f"The code knows vehicles alone, and {' and '.join(asked)} are asked for."
        )


_NO_VEHICLES = (Body.BICYCLE, Body.BARRIER, Body.CONSTRUCTION_SIGN)


def _along(line: Polyline) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points (P, 2) every half metre along a line and its headings (P,) there."""
    at_m = np.arange(_STEP_M / 2.0, line.length_m, _STEP_M)
    points = np.column_stack([np.interp(at_m, line.stations_m, axis) for axis in line.points_m.T])
    steps = np.diff(line.points_m, axis=0)
    piece = np.clip(np.searchsorted(line.stations_m, at_m, side="right") - 1, 0, len(steps) - 1)
    return points, np.arctan2(steps[piece, 1], steps[piece, 0])


def _drawn(
    code: Code,
    name: str,
    places: Places,
    allowed: NDArray[np.intp],
    others: Sequence[TrafficAgent],
    rng: np.random.Generator,
) -> TrafficAgent | None:
    """A vehicle at one of the places, None where every draw met somebody else."""
    length_m, width_m = LENGTH_WIDTH_M[AgentType.VEHICLE]
    vehicle = TrafficAgent(
        id=name,
        type=AgentType.VEHICLE,
        x_m=0.0,
        y_m=0.0,
        heading_rad=0.0,
        length_m=length_m,
        width_m=width_m,
        speed_mps=code.speed_mps,
    )
    for _ in range(_DRAWS):
        index = int(rng.choice(allowed))
        x_m, y_m = places.points_m[index]
        vehicle = replace(
            vehicle,
            x_m=round(float(x_m), 3),
            y_m=round(float(y_m), 3),
            heading_rad=round(float(places.headings_rad[index]), 5),
            lane_id=places.lane_ids[index],
        )
        if not any(overlap(vehicle.box, other.box).depth_m > 0.0 for other in others):
            return vehicle
    return None
