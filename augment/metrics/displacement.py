"""Displacement error: how far what was placed is from what the reference places.

Each added or moved object is matched to one of the reference within its class, so that the sum of
the distances is smallest (the Hungarian algorithm). What is left over is counted, never measured.
Removed agents have no place and take no part. Any frame, the same for both sides.
Where a change lets somebody move, the distance of each matched pair is followed as well.
Notation: R objects of the reference, G generated ones.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from itertools import chain
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from augment.checks import Ground
from augment.checks.wish import measure_wish
from augment.checks.wish_patterns import match_nearest
from augment.geometry.frames import difference
from augment.scene.entities import UPRIGHT, AgentType, Modification, TrafficAgent
from augment.scene.intent import Intent
from augment.scene.motion import HORIZON_S


class ObjectClass(StrEnum):
    """Class of interchangeable objects: a bus for a car, but no cone for a pedestrian."""

    VEHICLE = "vehicle"
    BICYCLE = "bicycle"
    PEDESTRIAN = "pedestrian"
    TRAFFIC_CONE = "traffic cone"
    BARRIER = "barrier"
    CONSTRUCTION_SIGN = "construction sign"
    GENERIC_OBJECT = "generic object"


_STANDS_FOR = {AgentType.EGO_VEHICLE: ObjectClass.VEHICLE, AgentType.BUS: ObjectClass.VEHICLE}
CLASS_OF = {kind: _STANDS_FOR.get(kind) or ObjectClass[kind.name] for kind in AgentType}


MISS_M = 10.0
"""What a missing or surplus object counts where one number says how far off a change is, and a
matched one at most: about a junction's width, beyond which it stands somewhere else."""

_IfMoving = Annotated[float | None, Field(exclude_if=lambda value: value is None)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Match:
    """A generated object and the one of the reference that it stands for.

    Attributes:
        distance_m: Between the centres at t0.
        average_m, final_m: Over the steps of `HORIZON_S`, and at the last one at which both are
            there; None where nothing moves in either change. Who has no motion on either side
            keeps its distance.
        start_s: How much later its motion begins than the reference's, None unless both do.
    """

    reference: str
    generated: str
    object_class: ObjectClass
    distance_m: float
    average_m: _IfMoving = None
    final_m: _IfMoving = None
    start_s: _IfMoving = None

    @property
    def error_m(self) -> float:
        """The distance, over time where something moves."""
        return self.distance_m if self.average_m is None else self.average_m


@dataclass(frozen=True, slots=True, kw_only=True)
class Displacement:
    """One modification against its reference.

    Attributes:
        matches: One for every object that has a counterpart.
        missing: Ids of the reference's objects that nothing stands for.
        surplus: Ids of generated objects that stand for nothing.
    """

    matches: tuple[Match, ...] = ()
    missing: tuple[str, ...] = ()
    surplus: tuple[str, ...] = ()

    @property
    def distances_m(self) -> tuple[float, ...]:
        """The error of every matched object at t0."""
        return tuple(match.distance_m for match in self.matches)

    @property
    def errors_m(self) -> tuple[float, ...]:
        """The error of every matched object, over time where something moves."""
        return tuple(match.error_m for match in self.matches)

    @property
    def mean_m(self) -> float | None:
        """The mean error, None where nothing is matched."""
        return float(np.mean(self.errors_m)) if self.matches else None

    @property
    def over_time(self) -> "OverTime | None":
        """The means over time, None where nothing moves or is matched."""
        return mean_over_time([self])

    @property
    def error_m(self) -> float:
        """The mean over all objects, `MISS_M` for each missing or surplus one; 0 without any."""
        # Capped, or dropping a misplaced object would be better than keeping it.
        errors_m = [min(error, MISS_M) for error in self.errors_m]
        # What is missing or surplus counts as an object that is as far off as any can be.
        errors_m += [MISS_M] * (len(self.missing) + len(self.surplus))
        return float(np.mean(errors_m)) if errors_m else 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class OverTime:
    """Matched objects of changes in which something moves.

    Attributes:
        n: How many.
        at_t0_m, average_m, final_m: Means over them of what `Match` has.
        start_s: The mean absolute difference between the starts, None without two to compare.
    """

    n: int
    at_t0_m: float
    average_m: float
    final_m: float
    start_s: float | None


def mean_over_time(displacements: Sequence[Displacement]) -> OverTime | None:
    """Return the means over all matched objects of changes that move, None without any."""
    matches = chain.from_iterable(measured.matches for measured in displacements)
    # Objects of changes in which nothing moves have no error over time.
    moving = [match for match in matches if match.average_m is not None]
    starts_s = [abs(match.start_s) for match in moving if match.start_s is not None]
    if not moving:
        return None
    return OverTime(
        n=len(moving),
        at_t0_m=float(np.mean([match.distance_m for match in moving])),
        average_m=float(np.mean([match.average_m for match in moving])),
        final_m=float(np.mean([match.final_m for match in moving])),
        start_s=float(np.mean(starts_s)) if starts_s else None,
    )


def displacement(
    generated: Modification | None, reference: Modification, ground: Ground | None = None
) -> Displacement:
    """Return the displacement of a modification's objects from the reference's.

    Args:
        generated: None for an answer that was unreadable or refused: all is missing.
        reference: In the same frame.
        ground: Of the scene before the change; without it nothing is followed over time.

    Raises:
        InvalidModification: A change that is to be followed does not fit the scene.
    """
    placed = () if generated is None else generated.changed
    matches: list[Match] = []
    for object_class in ObjectClass:
        wanted, agents = (
            [agent for agent in listed if CLASS_OF[agent.type] is object_class]
            for listed in (reference.changed, placed)
        )
        if wanted and agents:
            matches += _match(wanted, agents, object_class)
    # Either change suffices: not moving what should is an error over time as well.
    moves = reference.has_motion or (generated is not None and generated.has_motion)
    if moves and matches and generated is not None and ground is not None:
        matches = _follow(matches, generated, reference, ground)
    # What the smaller side of a class leaves over: counted, as it has no distance.
    taken = {match.reference for match in matches}
    used = {match.generated for match in matches}
    return Displacement(
        matches=tuple(matches),
        missing=tuple(agent.id for agent in reference.changed if agent.id not in taken),
        surplus=tuple(agent.id for agent in placed if agent.id not in used),
    )


def displacement_from_wish(
    generated: Modification | None, intent: Intent, ground: Ground
) -> Displacement | None:
    """Return the distance to the wish, as one from the nearest placement that an intent admits.

    Of its objects the names are empty.

    Args:
        generated: None for an answer that was unreadable or refused: all is missing.
        intent: What the instruction asks for.
        ground: Of the scene before the change.

    Returns:
        None where the ego is off every lane.

    Raises:
        InvalidModification: The modification does not fit the scene.
    """
    change = generated or Modification()
    wish = measure_wish(ground, change, intent)
    if wish is None:
        return None
    classes = {agent.id: CLASS_OF[agent.type] for agent in change.changed}
    matches = (
        Match(
            reference="",
            generated=match.agent_id,
            object_class=classes[match.agent_id],
            distance_m=match.distance_m,
        )
        for match in wish.matches
    )
    missing = ("",) * wish.missing
    return Displacement(matches=tuple(matches), missing=missing, surplus=wish.surplus)


def _match(
    wanted: list[TrafficAgent], candidates: list[TrafficAgent], object_class: ObjectClass
) -> list[Match]:
    apart_m = np.hypot(
        np.subtract.outer([agent.x_m for agent in wanted], [agent.x_m for agent in candidates]),
        np.subtract.outer([agent.y_m for agent in wanted], [agent.y_m for agent in candidates]),
    )  # (R, G)
    return [
        Match(
            reference=wanted[row].id,
            generated=candidates[column].id,
            object_class=object_class,
            distance_m=float(apart_m[row, column]),
        )
        for row, column in match_nearest(apart_m)
    ]


def _follow(
    matches: Sequence[Match], generated: Modification, reference: Modification, ground: Ground
) -> list[Match]:
    """The matches with their distances over time."""
    motions = [ground.motion_after(change, of_all=False) for change in (reference, generated)]
    # (T,); 1e-9 s, as steps of 0.1 s add up inexactly.
    compared = motions[0].times_s <= HORIZON_S + 1e-9
    wanted, placed = (
        {movement.agent.id: movement for movement in motion.others} for motion in motions
    )
    followed = []
    for match in matches:
        movement, other = wanted[match.reference], placed[match.generated]
        average_m, final_m, start_s = match.distance_m, match.distance_m, None
        apart_m = np.hypot(*(movement.states[compared, :2] - other.states[compared, :2]).T)
        # NaN where one of the two is not there: only common steps count.
        apart_m = apart_m[~np.isnan(apart_m)]
        if len(apart_m) and (movement.agent.motion or other.agent.motion):
            # ADE and FDE of trajectory forecasting, on steps at which both are there.
            average_m, final_m = float(apart_m.mean()), float(apart_m[-1])
            if movement.started_s is not None and other.started_s is not None:
                start_s = other.started_s - movement.started_s
        followed.append(replace(match, average_m=average_m, final_m=final_m, start_s=start_s))
    return followed


WHISKER = 1.5
"""Whiskers end at the last value within so many interquartile ranges of the box (Tukey)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BoxSummary:
    """Quartiles by linear interpolation, whiskers by Tukey, all in metres."""

    mean_m: float
    low_m: float
    q1_m: float
    median_m: float
    q3_m: float
    high_m: float
    outliers_m: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """The displacements of some augmentations taken together.

    Attributes:
        augmentations: How many there are.
        n: Matched objects, each with its own distance.
        missing: Objects of the references that nothing stands for.
        surplus: Generated objects that stand for nothing.
        box: Of the errors, which are over time where something moves; None without a match.
        over_time: None where nothing moves.
    """

    augmentations: int
    n: int
    missing: int
    surplus: int
    box: BoxSummary | None
    over_time: OverTime | None


def summarise(displacements: Sequence[Displacement]) -> Summary:
    """All matched objects of all augmentations; each object counts once."""
    errors_m = [value for displacement in displacements for value in displacement.errors_m]
    return Summary(
        augmentations=len(displacements),
        n=len(errors_m),
        missing=sum(len(displacement.missing) for displacement in displacements),
        surplus=sum(len(displacement.surplus) for displacement in displacements),
        box=summarize_box(errors_m) if errors_m else None,
        over_time=mean_over_time(displacements),
    )


def summarize_box(values_m: Sequence[float]) -> BoxSummary:
    """Return the box of at least one value."""
    values = np.sort(np.asarray(values_m, dtype=float))
    q1, median, q3 = (float(value) for value in np.percentile(values, (25.0, 50.0, 75.0)))
    reach = WHISKER * (q3 - q1)
    # Tukey's fences; what lies beyond is drawn one by one.
    inside = (values >= q1 - reach) & (values <= q3 + reach)
    # Interpolated quartiles may leave no value between a box's edge and its whisker's reach.
    low, high = min(float(values[inside][0]), q1), max(float(values[inside][-1]), q3)
    return BoxSummary(
        mean_m=float(values.mean()),
        low_m=low,
        q1_m=q1,
        median_m=median,
        q3_m=q3,
        high_m=high,
        outliers_m=tuple(float(value) for value in values[~inside]),
    )


_ARROW_S = 1.0
"""A picture shows the motion of so much time as an arrow."""


_SAME_M, _SAME_RAD = 0.15, math.radians(2.0)
"""Up to which differences an object was left as it was, the limits included."""

ALIKE = {"metres": 0.1, "degrees": 10.0, "seconds": 0.1, "px_per_m": 40.0}
"""What nobody sees: less than 4 pixels at that scale, as studies freeze it. Degrees bind for the
small alone; the corners of whoever is longer come farther than the metres before."""


def are_alike(first: Modification, other: Modification) -> bool:
    """Return whether every object of either change has a counterpart that nobody tells from it.

    What is moved and what is removed must be the same.
    """
    shifts = find_shifts(first, other)
    return shifts is not None and all(
        shift.metres <= ALIKE["metres"] + 1e-9 and shift.degrees <= ALIKE["degrees"] + 1e-9
        for shift in shifts
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Shift:
    """Two objects that stand for each other in two changes.

    Attributes:
        metres: The farthest that a corner, the end of a walk or the way of a second comes.
        degrees: The turn, 0 to 180; 0 for what is drawn upright.
    """

    one: TrafficAgent
    other: TrafficAgent
    metres: float
    degrees: float


def find_shifts(first: Modification, other: Modification) -> tuple[Shift, ...] | None:
    """Return the objects of two changes, matched; None where one has no counterpart."""
    moved = [{agent.id: agent for agent in change.moved} for change in (first, other)]
    is_other = moved[0].keys() != moved[1].keys() or len(first.added) != len(other.added)
    if is_other or set(first.removed) != set(other.removed):
        return None
    found = [_find_shift(agent, moved[1][name]) for name, agent in moved[0].items()]
    table = [[_find_shift(a, b) for b in other.added] for a in first.added]
    # (A, B) metres; what can't stand for each other costs more than any sum of distances.
    costs = np.array([[1e9 if cell is None else cell.metres for cell in row] for row in table])
    pairs = match_nearest(costs.reshape(len(table), len(table)))
    found += [table[row][column] for row, column in pairs]
    shifts = tuple(shift for shift in found if shift is not None)
    return shifts if len(shifts) == len(found) else None


def _find_shift(one: TrafficAgent, other: TrafficAgent) -> Shift | None:
    """Return the difference of two objects, None where they are not of one kind."""
    gaps_m = _list_arrow_gaps_m(one, other, ALIKE["seconds"])
    if gaps_m is None:
        return None
    turned = replace(other, heading_rad=one.heading_rad) if one.type in UPRIGHT else other
    gaps_m += np.hypot(*(one.box.corners_m - turned.box.corners_m).T).tolist()
    turn_rad = difference(one.heading_rad, turned.heading_rad)
    return Shift(one=one, other=other, metres=max(gaps_m), degrees=abs(math.degrees(turn_rad)))


def look_alike(one: TrafficAgent, other: TrafficAgent) -> bool:
    """Return whether two objects look the same, whatever their ids."""
    gaps_m = _list_arrow_gaps_m(one, other, _SAME_M)
    if gaps_m is None:
        return False
    gaps_m.append(math.dist((one.x_m, one.y_m), (other.x_m, other.y_m)))
    gaps_m += [abs(one.length_m - other.length_m), abs(one.width_m - other.width_m)]
    turn_rad = 0.0 if one.type in UPRIGHT else difference(one.heading_rad, other.heading_rad)
    return max(gaps_m) <= _SAME_M + 1e-9 and abs(turn_rad) <= _SAME_RAD + 1e-9


def _list_arrow_gaps_m(
    one: TrafficAgent, other: TrafficAgent, within: float
) -> list[float] | None:
    """Return how far the arrows of two objects differ: of their speeds, and of their walks.

    None unless they are of one kind and move alike, but for numbers that differ so little.
    """
    # As documents, whose numbers alone may differ a little.
    mine, theirs = (agent.motion and asdict(agent.motion) for agent in (one, other))
    if one.type is not other.type or not _are_close(mine, theirs, within):
        return None
    gaps_m = [abs(one.speed_mps - other.speed_mps) * _ARROW_S]
    if one.walk_to_m is not None and other.walk_to_m is not None:
        gaps_m.append(math.dist(one.walk_to_m, other.walk_to_m))
    return gaps_m if (one.walk_to_m is None) == (other.walk_to_m is None) else None


def _are_close(value: Any, other: Any, within: float) -> bool:
    """Return whether two parts of documents differ in their numbers alone, and in these little."""
    if type(value) is not type(other):
        return False
    if isinstance(value, float):
        return bool(abs(value - other) <= within + 1e-9)
    if isinstance(value, dict):
        return value.keys() == other.keys() and all(
            _are_close(value[key], other[key], within) for key in value
        )
    if isinstance(value, tuple):
        return len(value) == len(other) and all(
            _are_close(mine, theirs, within) for mine, theirs in zip(value, other, strict=True)
        )
    return bool(value == other)
