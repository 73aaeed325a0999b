"""Counts, types and motion against those that were asked for."""

from __future__ import annotations

from collections.abc import Iterator

from augment.checks.bodies import name_type
from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.parties import SPEED_MPS, SPEED_SHARE, Asked, Role, middle_of, severity_of
from augment.checks.situation import STOPPED_BELOW_MPS
from augment.scene.intent import CrashRequest, VehicleRequest


def asked_count(asked: Asked) -> Iterator[Finding]:
    """What is missing, and what nobody asked for."""
    for party in asked.parties:
        here = tuple(one.id for one in party.everyone)
        for role, number in party.missing:
            yield Finding(
                kind=FindingKind.ASKED_COUNT,
                severity=Severity.WRONG,
                agents=here,
                belongs_m=None if here else middle_of(party.request.spot, asked.lanes),
                measured={"missing": float(number)},
                template=(
                    f"{{missing:.0f}} {_COUNTED[role][number != 1]} asked for and not there."
                ),
            )
    for agent in asked.matching.surplus:
        yield Finding(
            kind=FindingKind.ASKED_COUNT,
            severity=Severity.WRONG,
            agents=(agent.id,),
            measured={"surplus": 1.0},
            template=f"{{agents[0]}}, {name_type(agent.type)}, is more than was asked for.",
        )


def asked_type(asked: Asked) -> Iterator[Finding]:
    """What stands in for something of another type."""
    for party in asked.parties:
        for agent, role in party.mistyped:
            yield Finding(
                kind=FindingKind.ASKED_TYPE,
                severity=Severity.WRONG,
                agents=(agent.id,),
                template=f"{{agents[0]}} is {name_type(agent.type)}; {_A[role]} is asked for.",
            )


def asked_motion(asked: Asked) -> Iterator[Finding]:
    """The speed of vehicles: those that are to stand do, the others drive as fast as said."""
    for party in asked.parties:
        request = party.request
        if not isinstance(request, (VehicleRequest, CrashRequest)):
            continue
        wanted_mps = request.speed_mps if isinstance(request, VehicleRequest) else 0.0
        if wanted_mps is None:
            continue
        allowed_mps = max(SPEED_MPS, SPEED_SHARE * wanted_mps) if wanted_mps else STOPPED_BELOW_MPS
        words = _DRIVES if wanted_mps else _STANDS
        for agent in party.agents:
            off_mps = abs(agent.speed_mps - wanted_mps)
            yield Finding(
                kind=FindingKind.ASKED_MOTION,
                severity=severity_of(fits=off_mps <= allowed_mps),
                agents=(agent.id,),
                measured={"speed_mps": agent.speed_mps, "asked_mps": wanted_mps},
                template=f"{{agents[0]}} moves at {{speed_mps:.1f}} m/s; {words}.",
            )


def find_unasked(asked: Asked) -> Iterator[Finding]:
    """Agents of the scene that were moved or removed, and nobody asked for that."""
    moved = [(agent.id, _MOVED, asked.to_move) for agent in asked.modification.moved]
    removed = [(name, _REMOVED, asked.to_remove) for name in asked.modification.removed]
    for name, done, wanted in (*moved, *removed):
        if name in wanted:
            continue
        yield Finding(
            kind=FindingKind.UNASKED,
            severity=Severity.WRONG,
            agents=(name,),
            template=f"{{agents[0]}} was in the scene and is {done}; nobody asked for that.",
        )


def asked_changes(asked: Asked) -> Iterator[Finding]:
    """Agents of the scene that are to be moved or removed, and were not."""
    moved = frozenset(agent.id for agent in asked.modification.moved)
    removed = frozenset(asked.modification.removed)
    left_alone = [(name, _MOVED) for name in sorted(asked.to_move - moved)]
    left_alone += [(name, _REMOVED) for name in sorted(asked.to_remove - removed)]
    for name, wanted in left_alone:
        yield Finding(
            kind=FindingKind.ASKED_COUNT,
            severity=Severity.WRONG,
            agents=(name,),
            template=f"{{agents[0]}} is to be {wanted} and is not.",
        )


def find_attempted(asked: Asked) -> Iterator[Finding]:
    """Whatever is done about a wish that can't be met."""
    touched = [agent.id for agent in asked.modification.changed] + [*asked.modification.removed]
    if asked.unmet and touched:
        why = asked.unmet.replace("{", "{{").replace("}", "}}")
        yield Finding(
            kind=FindingKind.UNASKED,
            severity=Severity.WRONG,
            agents=tuple(touched),
            template=f"The wish can't be met, and {{agents[0]}} is changed: {why}",
        )


_MOVED, _REMOVED = "moved", "removed"
_DRIVES, _STANDS = "{asked_mps:.1f} m/s is asked for", "it is to stand"
_A = {
    Role.VEHICLE: "a vehicle",
    Role.CAR: "a car",
    Role.BUS: "a bus",
    Role.BICYCLE: "a bicycle",
    Role.WALKER: "a pedestrian",
    Role.CONE: "a cone",
    Role.WORKER: "a worker",
    Role.BARRIER: "a barrier",
    Role.SIGN: "a construction sign",
}
_COUNTED = {
    Role.VEHICLE: ("vehicle is", "vehicles are"),
    Role.CAR: ("car is", "cars are"),
    Role.BUS: ("bus is", "buses are"),
    Role.BICYCLE: ("bicycle is", "bicycles are"),
    Role.WALKER: ("pedestrian is", "pedestrians are"),
    Role.CONE: ("cone is", "cones are"),
    Role.WORKER: ("worker is", "workers are"),
    Role.BARRIER: ("barrier is", "barriers are"),
    Role.SIGN: ("construction sign is", "construction signs are"),
}
"""One, and several or none."""
