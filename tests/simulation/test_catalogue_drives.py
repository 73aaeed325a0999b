"""One nudge of the catalogue, driven until it can be told; docs/simulation.md has all 50."""

from __future__ import annotations

from augment.scene.entities import without_traffic
from augment.simulation.drive import Drive, run
from augment.simulation.pdm_closed import ORIGINAL_OFFSETS_M, PAPER_OFFSETS_M, PdmClosed
from augment.simulation.road import Road
from augment.simulation.traffic import DriveSetting
from tests.fixtures.shelf import entry, shown_scene

SLUG = "nudge-mill-junction"
STEPS = 55


def advance_m(drive: Drive) -> float:
    """How far the ego came along its route."""
    stations, _ = drive.road.centreline.beside(drive.boxes[[0, -1], :2])
    return float(stations[1] - stations[0])


def test_offsets_to_4_m_pass_a_parked_car_at_which_the_original_ones_wait() -> None:
    scene, parked = without_traffic(shown_scene(SLUG)), entry(SLUG).reference
    assert parked is not None
    road, setting = Road(scene), DriveSetting(scene=scene, modification=parked)
    wide, narrow = (
        run(setting, PdmClosed(offsets), road=road, steps=STEPS)
        for offsets in (PAPER_OFFSETS_M, ORIGINAL_OFFSETS_M)
    )
    assert advance_m(narrow) < parked.added[0].x_m < advance_m(wide)
    assert narrow.states[-1, 3] < 0.5
