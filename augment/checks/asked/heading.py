"""The direction that something faces against the one that was asked for."""

from __future__ import annotations

import math
from collections.abc import Iterator

from augment.checks.asked.question import Asked, facing_words, severity_of, side_of
from augment.checks.finding import Finding, FindingKind
from augment.geometry.frames import difference
from augment.scene.entities import TrafficAgent
from augment.scene.intent import Body, Facing, VehicleRequest


def asked_heading(asked: Asked) -> Iterator[Finding]:
    """Vehicles against their lane; those that have crashed are told by `asked_crash`."""
    for party in asked.parties:
        request = party.request
        if isinstance(request, VehicleRequest):
            for agent in party.agents:
                yield from _vehicle(asked, request, agent)


def _vehicle(asked: Asked, request: VehicleRequest, agent: TrafficAgent) -> Iterator[Finding]:
    if request.spot.lane is None or (request.body in _NO_FRONT and request.facing is None):
        return
    place = asked.route.locate_agent(agent)
    band = asked.lanes.band(request.spot.lane, place.ahead_m)
    if band is None:
        return
    turn_deg = math.degrees(difference(agent.heading_rad, band.tangent_rad))
    turns = (turn_deg, turn_deg + 180.0) if _facing(request) is Facing.ACROSS else (turn_deg,)
    wanted_deg = _FACING_DEG[_facing(request)] + request.turn_deg
    off_deg = min(abs(_difference_deg(turn, wanted_deg)) for turn in turns)
    usual = "" if request.facing else ", as nothing else is said,"
    yield Finding(
        kind=FindingKind.ASKED_HEADING,
        severity=severity_of(fits=off_deg <= asked.tolerances.heading_deg),
        agents=(agent.id,),
        measured={
            "turn_deg": turn_deg,
            "asked_deg": _difference_deg(wanted_deg, 0.0),
            "off_deg": off_deg,
        },
        template=(
            f"{{agents[0]}} is turned {{turn_deg:.0f}} degrees to the {side_of(turn_deg)} of its "
            f"lane; {facing_words(request.facing)}{usual}{_turn(request)} is asked for."
        ),
    )


def _turn(request: VehicleRequest) -> str:
    if not request.turn_deg:
        return ""
    return f", turned {abs(request.turn_deg):g} degrees to the {side_of(request.turn_deg)}"


def _facing(request: VehicleRequest) -> Facing:
    """As its lane leads where nothing is said: what else would say so stands in the sentence."""
    return request.facing or Facing.WITH_LANE


def _difference_deg(one: float, other: float) -> float:
    return math.degrees(difference(math.radians(one), math.radians(other)))


_NO_FRONT = frozenset({Body.BARRIER, Body.CONSTRUCTION_SIGN})
_FACING_DEG = {Facing.WITH_LANE: 0.0, Facing.AGAINST_LANE: 180.0, Facing.ACROSS: 90.0}
