"""The collisions of a drive: each object once, at its first contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from augment.simulation.contact import Contact, at_fault, classify
from augment.simulation.drive import Drive
from augment.simulation.objects import Kind
from augment.simulation.overlap import corners, meet
from augment.simulation.states import SPEED, BoolArray


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
