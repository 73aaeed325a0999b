"""Where pedestrians come from, where they look, and whether they cross the ego's way."""

from __future__ import annotations

import math
from collections.abc import Iterator

from augment.checks.asked import Asked, hand, severity
from augment.checks.finding import Finding, Kind
from augment.checks.walk_crossing import end_of_walk
from augment.instruction.intent import Side, WalkRequest
from augment.scene.entities import TrafficAgent

_ON_ROAD_M = 1.0
"""Who begins so near the middle of the ego's lane comes from no side of it."""
_ALONG_SHARE = 0.2
"""Who looks less than this across the road (some 12 degrees) looks along it."""


def asked_walk(asked: Asked) -> Iterator[Finding]:
    """Side (a fault of logic), direction (of heading), crossing (of logic): the first one wrong.

    Looking or walking away from the road is a fault of the heading, as in the paper; that such a
    walk crosses nothing follows from it.
    """
    for party in asked.parties:
        if isinstance(party.request, WalkRequest):
            for agent in party.agents:
                yield _finding(asked, agent, 1.0 if party.request.start is Side.LEFT else -1.0)


def _finding(asked: Asked, agent: TrafficAgent, start: float) -> Finding:
    place = asked.way.of_agent(agent)
    across = math.sin(agent.heading_rad - place.tangent_rad)
    end = end_of_walk(agent)
    end_left_m = None if end is None else asked.way.place(*end).left_m
    to_left_m = 0.0 if end_left_m is None else end_left_m - place.left_m
    goes = math.copysign(1.0, to_left_m) if abs(to_left_m) > _ON_ROAD_M else 0.0
    is_other_side = place.left_m * start < -_ON_ROAD_M and goes == start
    measured = {"start_left_m": place.left_m, "end_left_m": end_left_m}
    begins, ends = hand(start), hand(-start)
    if is_other_side:
        return _said(
            Kind.ASKED_SIDE, agent, measured,
            f"{{agents[0]}} crosses from the {ends} to the {begins}; from the {begins} is asked "
            "for.",
        )  # fmt: skip
    looks_away = across * start > -_ALONG_SHARE
    if looks_away or goes == start:
        away = "looks" if looks_away else "walks"
        measured |= {"turn_deg": math.degrees(math.asin(across))}
        return _said(
            Kind.ASKED_HEADING, agent, measured,
            f"{{agents[0]}} {away} away from its way to the {ends} side of the road.",
        )  # fmt: skip
    crosses = end_left_m is not None and place.left_m * start > -_ON_ROAD_M
    if crosses and end_left_m is not None and end_left_m * start < 0.0:
        return Finding(
            kind=Kind.ASKED_CROSSING,
            severity=severity(fits=True),
            agents=(agent.id,),
            measured=measured,
            template=f"{{agents[0]}} crosses the ego's way from the {begins}, as asked for.",
        )
    return _said(
        Kind.ASKED_CROSSING, agent, measured,
        f"{{agents[0]}} does not cross the ego's way from the {begins} to the {ends}.",
    )  # fmt: skip


def _said(
    kind: Kind, agent: TrafficAgent, measured: dict[str, float | None], words: str
) -> Finding:
    return Finding(
        kind=kind,
        severity=severity(fits=False),
        agents=(agent.id,),
        measured=measured,
        template=words,
    )
