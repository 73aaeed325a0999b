"""Driving scores and their parts, of drives that stop, pass and turn."""

import pytest

from augment.scene.entities import Modification, ScenarioType, Scene
from augment.simulation.drive import find_expert, run
from augment.simulation.pdm_closed import PdmClosed
from augment.simulation.road import Road
from augment.simulation.score import ScoreKind, score_drive
from augment.simulation.states import SPEED, X, Y
from augment.simulation.traffic import DriveSetting
from tests.golden.conftest import Check
from tests.scenes import junction, pedestrian, vehicle
from tests.simulation.worlds import street

SETTINGS: dict[str, tuple[Scene, Modification]] = {
    "a parked car beside the ego's way": (
        street(),
        Modification(added=(vehicle("Agent2", 35.0, -1.6),)),
    ),
    "a person who crosses": (
        street(),
        Modification(added=(pedestrian("Agent2", 45.0, -4.0, (45.0, 7.0)),)),
    ),
    "a car that blocks the way through a junction": (
        junction(),
        Modification(added=(vehicle("Agent2", 50.0, 0.0),)),
    ),
}


def driven(scene: Scene, change: Modification) -> dict[str, object]:
    """Where the ego is every 3 s (x, y in m, speed in m/s), and both scores with their parts."""
    setting, road = DriveSetting(scene=scene, modification=change), Road(scene)
    drive = run(setting, PdmClosed(), road=road)
    expert = find_expert(setting, road)
    parts: dict[str, object] = {}
    for kind in ScoreKind:
        score = score_drive(
            drive, expert, kind=kind, scenario_type=ScenarioType.NUDGE, modification=change
        )
        parts[kind.value] = rounded(score.value)
        parts |= {f"{kind.value} {part.name}": rounded(part.value) for part in score.metrics}
    seen = drive.states[::30, [X, Y, SPEED]]
    way = [" ".join(f"{value:.2f}" for value in state) for state in seen]
    return {"expert": rounded(expert.progress_m), "way": way} | parts


def rounded(value: float | None) -> float | None:
    return None if value is None else round(float(value), 3)


@pytest.mark.slow
def test_drives_have_the_scores_that_they_had(check: Check) -> None:
    check("drives.json", {name: driven(*given) for name, given in SETTINGS.items()})
