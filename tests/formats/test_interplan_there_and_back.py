"""Modification -> interPlan -> modification: what comes back otherwise has a line.

References are in test_interplan.py.
"""

from dataclasses import replace

import pytest

from augment.formats.interplan.file import token_of
from augment.formats.interplan.writer import interplan_text as write_interplan
from augment.scene.entities import AgentType, ScenarioType, without_traffic
from tests.formats.cells import cell
from tests.formats.interplan_files import entries_of
from tests.formats.round_trips import agent_changes
from tests.scenes import cone, pedestrian, vehicle

ODD = {
    "box": replace(vehicle("Agent9", 30.0, 0.5, 0.1), length_m=5.2),
    "velocity": replace(vehicle("Agent9", 30.0, 0.5), speed_mps=3.0),
    "class": replace(vehicle("Agent9", 30.0, 0.5), length_m=9.0),
    "missing": replace(cone("Agent9", 30.0, 0.5), type=AgentType.BARRIER),
    "heading": replace(cone("Agent9", 30.0, 0.5), heading_rad=0.5),
    "walk": pedestrian("Agent9", 30.0, -4.0),
    "short walk": replace(pedestrian("Agent9", 30.0, -4.0, (30.0, -3.0)), speed_mps=1.0 / 15.0),
    "fast walk": replace(pedestrian("Agent9", 30.0, -4.0, (30.0, 8.0)), speed_mps=2.0),
    "askew walk": replace(
        pedestrian("Agent9", 30.0, -4.0, (30.0, 8.0)), heading_rad=1.5, speed_mps=0.8
    ),
    "hurried worker": replace(pedestrian("Agent9", 30.0, -4.0), speed_mps=1.0),
}


@pytest.mark.parametrize("kind", [ScenarioType.CONSTRUCTION_ZONE, ScenarioType.JAYWALKER])
@pytest.mark.parametrize("odd", list(ODD))
def test_what_interplan_changes_has_a_line_with_its_name(odd: str, kind: ScenarioType) -> None:
    given = cell(added=(ODD[odd], cone("Agent10", 20.0, -1.0)), type=kind)
    text, losses = write_interplan([given])
    scene = without_traffic(given.scene)
    (found,) = entries_of(text, {token_of(scene.name): scene})
    wanted, got = given.modification.added, found.modification.added
    assert len(got) == (1 if odd == "missing" else 2)
    changed = {change.name for change in agent_changes(wanted, got)}
    if odd != "walk" or kind is ScenarioType.JAYWALKER:
        assert changed == {"Agent9"}
    else:
        assert changed == set()  # a worker who stands is what interPlan's step says
    assert changed == {
        name for name in ("Agent9", "Agent10") if any(name in x.text for x in losses)
    }
