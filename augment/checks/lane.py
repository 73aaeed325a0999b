"""The lane or connector that an agent is on, how far along it and how far off its centre."""

from __future__ import annotations

from collections.abc import Iterator

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.lane_index import Beside
from augment.checks.situation import ChangedScene


def lane(situation: ChangedScene) -> Iterator[Finding]:
    """A fact for every changed agent: the lane under it, or how far it is off the nearest."""
    for agent in situation.changed:
        under = situation.under(agent)
        nearest = situation.nearest(agent)
        if under is not None:
            yield _on(agent.id, under)
        elif nearest is not None:
            yield _off(agent.id, nearest)


def _on(agent_id: str, place: Beside) -> Finding:
    if abs(place.d_m) < 0.005:
        words = (
            "{agents[0]} is on {lanes[0]}, {along_m:.1f} m along it and on its centre line; the "
            "lane is {lane_width_m:.1f} m wide."
        )
    else:
        side = "left" if place.d_m >= 0.0 else "right"
        words = (
            "{agents[0]} is on {lanes[0]}, {along_m:.1f} m along it and {left_m:.2f} m to the "
            f"{side} of its centre line; the lane is {{lane_width_m:.1f}} m wide."
        )
    return _fact(agent_id, place, 0.0, words)


def _off(agent_id: str, place: Beside) -> Finding:
    return _fact(
        agent_id,
        place,
        place.off_m,
        (
            "{agents[0]} is {off_m:.1f} m off every lane; the nearest lane is {lanes[0]} at "
            "{along_m:.1f} m along it."
        ),
    )


def _fact(agent_id: str, place: Beside, off_m: float, template: str) -> Finding:
    return Finding(
        kind=FindingKind.LANE,
        severity=Severity.FACT,
        agents=(agent_id,),
        lanes=(place.lane_id,),
        measured={
            "along_m": place.s_m,
            "left_m": place.d_m,
            "lane_width_m": place.width_m,
            "off_m": off_m,
        },
        template=template,
    )
