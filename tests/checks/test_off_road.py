"""What may stand beside its ground: each threshold from both sides, on both sides of a road."""

from __future__ import annotations

from dataclasses import replace

import pytest

from augment.checks import FindingKind, Severity
from augment.scene.entities import AgentType, Area, AreaKind, Scene
from tests.checks.worlds import found_in, of_kind
from tests.scenes import cone, pedestrian, scene, vehicle

EDGE_M = 4.0
"""The road reaches from -4 to 4 m, a walkway of 2 m beside it on either side."""
FACT, DOUBTFUL, WRONG = Severity.FACT, Severity.DOUBTFUL, Severity.WRONG


def road() -> Scene:
    strips = (
        (AreaKind.DRIVABLE, -4.0, 4.0),
        (AreaKind.WALKWAY, 4.0, 6.0),
        (AreaKind.WALKWAY, -6.0, -4.0),
    )
    return scene(
        lanes=scene().lanes[:1],
        areas=tuple(
            Area(
                id=f"Area{number}",
                kind=kind,
                boundary_m=((-50.0, low), (100.0, low), (100.0, high), (-50.0, high)),
            )
            for number, (kind, low, high) in enumerate(strips, start=1)
        ),
    )


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["left", "right"])
@pytest.mark.parametrize("kind", [AgentType.VEHICLE, AgentType.BUS])
@pytest.mark.parametrize(
    ("outside_percent", "severity"),
    [
        (0.0, None),
        (1.9, None),
        (2.1, FACT),
        (14.9, FACT),
        (15.1, DOUBTFUL),
        (29.0, DOUBTFUL),
        (49.9, DOUBTFUL),
        (50.1, WRONG),
        (100.0, WRONG),
    ],
)
def test_a_vehicle_on_the_kerb_counts_by_the_share_of_its_box(
    side: float, kind: AgentType, outside_percent: float, severity: Severity | None
) -> None:
    """A box 2 m wide along the road: the share outside is what its far edge is past the road's."""
    share = outside_percent / 100.0
    car = replace(vehicle("Agent2", 30.0, side * (EDGE_M - 1.0 + 2.0 * share)), type=kind)
    found = of_kind(found_in(road(), car), FindingKind.OFF_ROAD)
    assert [one.severity for one in found] == ([] if severity is None else [severity])
    if found:
        assert found[0].measured["outside_share"] == pytest.approx(share, abs=1e-6)


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["left", "right"])
@pytest.mark.parametrize(
    ("off_m", "severity"),
    [(-1.0, None), (0.99, None), (1.01, DOUBTFUL), (2.99, DOUBTFUL), (3.01, WRONG)],
)
def test_a_cone_counts_by_how_far_its_centre_is_off_the_road(
    side: float, off_m: float, severity: Severity | None
) -> None:
    found = of_kind(
        found_in(road(), cone("Agent2", 30.0, side * (EDGE_M + off_m))), FindingKind.OFF_ROAD
    )
    assert [one.severity for one in found] == ([] if severity is None else [severity])


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["left", "right"])
@pytest.mark.parametrize(
    ("off_m", "severity"),
    [
        (-0.01, None),
        (0.01, FACT),
        (1.99, FACT),
        (2.01, DOUBTFUL),
        (9.99, DOUBTFUL),
        (10.01, WRONG),
    ],
)
def test_who_walks_counts_by_how_far_he_is_off_all_that_the_map_shows(
    side: float, off_m: float, severity: Severity | None
) -> None:
    walker = pedestrian("Agent2", 30.0, side * (6.0 + off_m))
    found = of_kind(found_in(road(), walker), FindingKind.OFF_ROAD)
    assert [one.severity for one in found] == ([] if severity is None else [severity])
