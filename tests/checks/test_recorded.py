"""The checks on recorded traffic: what people really did is seldom wrong."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from augment.checks import FindingKind, Severity, findings
from augment.scene.entities import AgentType, Modification, Scene
from tests.recorded import recorded

pytestmark = pytest.mark.realdata

FRAMES = (0, 30, 60, 90, 120, 150)
DRIVES_MPS = 2.0


@pytest.fixture(scope="module")
def scenes(realdata: Path) -> list[Scene]:
    return [recorded(realdata, frame)[0] for frame in FRAMES]


def test_most_recorded_vehicles_have_nothing_wrong(
    scenes: list[Scene], capsys: pytest.CaptureFixture[str]
) -> None:
    totals, faulty, unplaced = Counter[str](), Counter[str](), Counter[str]()
    for scene in scenes:
        found = findings(scene, Modification(moved=scene.agents))
        wrong = [one for one in found if one.severity is Severity.WRONG]
        for agent in (one for one in scene.agents if one.type is AgentType.VEHICLE):
            group = "driving" if agent.speed_mps > DRIVES_MPS else "standing or creeping"
            kinds = {one.kind for one in wrong if one.agents[0] == agent.id}
            totals[group] += 1
            faulty[group] += bool(kinds)
            unplaced[group] += bool(kinds - {FindingKind.OVERLAP, FindingKind.DUPLICATE})
    with capsys.disabled():
        print("\nrecorded vehicles with something wrong (other than overlapping annotations):")
        for group, total in totals.items():
            print(f"  {group}: {faulty[group]} ({unplaced[group]}) of {total}")
    # Yards are off the map's road, and some boxes were annotated twice or into each other.
    assert faulty["driving"] <= 0.05 * totals["driving"]
    assert unplaced["standing or creeping"] <= 0.25 * totals["standing or creeping"]
    assert faulty.total() <= 0.25 * totals.total()


def test_no_recorded_agent_is_outside_its_map_or_impossible(scenes: list[Scene]) -> None:
    never = {
        FindingKind.OUTSIDE_MAP,
        FindingKind.SIZE,
        FindingKind.SPEED,
        FindingKind.DEGREES,
        FindingKind.LANE_NAMED,
    }
    for scene in scenes:
        found = findings(scene, Modification(moved=scene.agents))
        assert [
            one.sentence() for one in found if one.severity is Severity.WRONG and one.kind in never
        ] == []
