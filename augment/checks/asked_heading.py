"""The direction that something faces against the one that was asked for."""

from __future__ import annotations

import math
from collections.abc import Iterator

from augment.checks.asked import Asked, hand, severity
from augment.checks.finding import Finding, Kind
from augment.checks.tolerances import HEADING_DEG
from augment.geometry.angles import difference
from augment.instruction.intent import Facing, VehicleRequest
from augment.scene.entities import TrafficAgent


def asked_heading(asked: Asked) -> Iterator[Finding]:
    """Vehicles against their lane; those that have crashed are told by `asked_crash`."""
    for party in asked.parties:
        request = party.request
        if isinstance(request, VehicleRequest):
            for agent in party.agents:
                yield from _vehicle(asked, request, agent)


def _vehicle(asked: Asked, request: VehicleRequest, agent: TrafficAgent) -> Iterator[Finding]:
    place = asked.way.of_agent(agent)
    band = asked.way.band(request.spot.lane, place.ahead_m)
    if band is None:
        return
    turn_deg = math.degrees(difference(agent.heading_rad, band.tangent_rad))
    turns = (turn_deg, turn_deg + 180.0) if request.facing is Facing.ACROSS else (turn_deg,)
    wanted_deg = _FACING_DEG[request.facing] + request.turn_deg
    off_deg = min(abs(_difference_deg(one, wanted_deg)) for one in turns)
    yield Finding(
        kind=Kind.ASKED_HEADING,
        severity=severity(fits=off_deg <= HEADING_DEG),
        agents=(agent.id,),
        measured={
            "turn_deg": turn_deg,
            "asked_deg": _difference_deg(wanted_deg, 0.0),
            "off_deg": off_deg,
        },
        template=(
            f"{{agents[0]}} is turned {{turn_deg:.0f}} degrees to the {hand(turn_deg)} of its "
            f"lane; {_words(request)} is asked for."
        ),
    )


def _words(request: VehicleRequest) -> str:
    turn = ""
    if request.turn_deg:
        turn = f", turned {abs(request.turn_deg):g} degrees to the {hand(request.turn_deg)}"
    return f"facing {request.facing}{turn}"


def _difference_deg(one: float, other: float) -> float:
    return math.degrees(difference(math.radians(one), math.radians(other)))


_FACING_DEG = {Facing.WITH_LANE: 0.0, Facing.AGAINST_LANE: 180.0, Facing.ACROSS: 90.0}
