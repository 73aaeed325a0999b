"""Which way the ego is on through a drive, and whom it touches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from augment.simulation.drive import Drive
from augment.simulation.road import Road
from augment.simulation.states import (
    SPEED,
    BoolArray,
    Contact,
    FloatArray,
    IntArray,
    Kind,
    at_fault,
    classify,
    corners,
    meet,
    wrap_angles,
)

NO_WAY = -1
NEAR_M = 5.0
"""So far off every way the ego still counts as on the one it was on."""


def ego_ways(road: Road, centres_m: FloatArray, headings_rad: FloatArray) -> IntArray:
    """The index of the way at each moment (T,), `NO_WAY` off them all.

    The way stays the one it was while that contains the centre. Else one of the ways there is
    taken: one that follows the old way, then one of the route, then the best aligned.
    """
    inside = road.covering(centres_m)
    ways = np.full(len(centres_m), NO_WAY, dtype=np.int64)
    before = NO_WAY
    for moment, row in enumerate(inside):
        candidates = np.flatnonzero(row)
        if before != NO_WAY and row[before]:
            ways[moment] = before
        elif len(candidates):
            heading = float(headings_rad[moment])
            ways[moment] = _pick(road, candidates, before, centres_m[moment], heading)
        elif before != NO_WAY and _near(road, before, centres_m[moment]):
            ways[moment] = before
        before = int(ways[moment])
    return ways


def _pick(
    road: Road, candidates: IntArray, before: int, place_m: FloatArray, heading_rad: float
) -> int:
    after = set(road.graph.successors(road.names[before])) if before != NO_WAY else set()

    def misfit(number: int) -> tuple[bool, bool, float]:
        path = road.way_path(number)
        s_m, _ = path.beside(place_m[None])
        turn = float(wrap_angles(path.poses(s_m)[0, 2] - heading_rad))
        name = road.names[number]
        return name not in after, name not in road.beside, abs(turn)

    return min((int(number) for number in candidates), key=misfit)


def _near(road: Road, number: int, place_m: FloatArray) -> bool:
    import shapely

    return bool(shapely.distance(road.strips[number], shapely.Point(*place_m)) <= NEAR_M)


@dataclass(frozen=True, slots=True, kw_only=True)
class Collision:
    """The first contact with one object."""

    moment: int
    object_id: str
    kind: Kind
    contact: Contact
    at_fault: bool


def collisions(drive: Drive) -> tuple[Collision, ...]:
    """Who was touched, in the order of time.

    Who touches the ego at the very start is left out: nobody drove there.
    """
    met: list[Collision] = []
    known: set[str] = set()
    astray = off_one_way(drive)
    for moment, objects in enumerate(drive.objects):
        box = np.broadcast_to(drive.boxes[moment], objects.boxes.shape)
        hit = [n for n in np.flatnonzero(meet(box, objects.boxes)) if objects.ids[n] not in known]
        known |= {objects.ids[number] for number in hit}
        if not hit or moment == 0:
            continue
        states = np.repeat(drive.states[moment : moment + 1], len(hit), axis=0)
        contacts = classify(
            states,
            states[:, SPEED],
            objects.boxes[hit],
            objects.speeds_mps[hit],
            objects.kinds[hit],
            drive.body,
        )
        guilty = at_fault(contacts, np.full(len(hit), astray[moment]))
        for number, contact, fault in zip(hit, contacts, guilty, strict=True):
            met.append(
                Collision(
                    moment=moment,
                    object_id=objects.ids[number],
                    kind=Kind(int(objects.kinds[number])),
                    contact=Contact(int(contact)),
                    at_fault=bool(fault),
                )
            )
    return tuple(met)


def off_one_way(drive: Drive) -> BoolArray:
    """Whether the ego is off the road, or not on one way and what follows it, (T,)."""
    boxes = corners(drive.boxes)
    off = ~drive.road.drivable.contains(boxes).all(axis=-1)
    return np.asarray(off | ~drive.road.on_one_way(boxes), dtype=np.bool_)
