"""The references of the catalogue are sound, and each injected fault is named by its kind."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from augment.checks import FindingKind, Severity, findings
from augment.scene.entities import AgentType, Modification, TrafficAgent, TrafficSide
from tests.checks.worlds import Reference, references, severities

REFERENCES = references()
FACING = {"nudge-ferry-road", "overtake-terrace-row-facing"}
"""Here the instruction asks for a vehicle that faces the traffic."""
VEHICLES = [
    one
    for one in REFERENCES
    if one.modification.added[0].type in (AgentType.VEHICLE, AgentType.BUS)
    and one.slug not in FACING
]


def _named(one: Reference) -> str:
    return one.slug


def _off_road(reference: Reference) -> TrafficAgent:
    """The first agent 6 m further towards the kerb, before any side street."""
    towards_kerb = 1.0 if reference.scene.traffic_side is TrafficSide.LEFT else -1.0
    agent = reference.modification.added[0]
    return replace(agent, x_m=15.0, y_m=towards_kerb * 6.0, heading_rad=0.0)


def _on_the_ego(reference: Reference) -> TrafficAgent:
    return replace(reference.modification.added[0], x_m=1.0, y_m=0.5, lane_id=None)


def _turned(reference: Reference) -> TrafficAgent:
    agent = reference.modification.added[0]
    return replace(
        agent, heading_rad=agent.heading_rad - math.copysign(math.pi, agent.heading_rad)
    )


@pytest.mark.parametrize("reference", REFERENCES, ids=_named)
def test_a_reference_has_nothing_wrong(reference: Reference) -> None:
    asked_for = {(FindingKind.HEADING, Severity.DOUBTFUL)} if reference.slug in FACING else set()
    assert severities(findings(reference.scene, reference.modification)) == asked_for


@pytest.mark.parametrize("reference", VEHICLES, ids=_named)
@pytest.mark.parametrize(
    ("inject", "kind", "severity"),
    [
        (_off_road, FindingKind.OFF_ROAD, Severity.WRONG),
        (_on_the_ego, FindingKind.OVERLAP, Severity.WRONG),
        (_turned, FindingKind.HEADING, Severity.DOUBTFUL),
    ],
)
def test_an_injected_fault_is_named(
    reference: Reference,
    inject: Callable[[Reference], TrafficAgent],
    kind: FindingKind,
    severity: Severity,
) -> None:
    alone = Modification(added=(inject(reference),))
    assert (kind, severity) in severities(findings(reference.scene, alone))


@pytest.mark.parametrize("reference", REFERENCES, ids=_named)
def test_the_same_thing_twice_is_named(reference: Reference) -> None:
    added = reference.modification.added
    twin = replace(added[0], id="Agent99")
    found = findings(reference.scene, Modification(added=(*added, twin)))
    named = severities(found)
    assert {
        (FindingKind.DUPLICATE, Severity.WRONG),
        (FindingKind.OVERLAP, Severity.WRONG),
    } <= named
    twins = [one for one in found if one.kind is FindingKind.DUPLICATE]
    assert [one.agents for one in twins] == [(added[0].id, "Agent99")]


@pytest.mark.parametrize(
    "reference",
    [one for one in REFERENCES if one.modification.added[0].walk_to_m is not None],
    ids=_named,
)
def test_a_pedestrian_who_walks_backwards_is_named(reference: Reference) -> None:
    turned = Modification(added=(_turned(reference),))
    assert severities(findings(reference.scene, turned)) == {
        (FindingKind.WALK_HEADING, Severity.WRONG)
    }
