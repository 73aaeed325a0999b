"""Files that programs wrote which share no code with us are read as submissions."""

import json
from dataclasses import replace
from pathlib import Path

from augment.benchmark.submission import check_submission
from augment.benchmark.submitted_file import ONLY_T0
from augment.metrics.displacement import are_alike
from augment.scene.entities import AgentType, Modification
from tests.benchmark.sets import on_disk, street, street_set
from tests.benchmark.test_report import CARD_PARTS
from tests.formats.receivers import run
from tests.scenes import vehicle

SCRIPT = Path(__file__).with_name("entrants.py")


def test_commonroad_io_and_a_writer_of_scenarionet_can_enter(tmp_path: Path) -> None:
    given = street_set("near", "far")
    handed_out = on_disk(tmp_path / "handed out", given)
    sources = {"commonroad/near.xml": "near.xml"}
    sources["scenarionet/sd_scenario_arena_1_far.pkl"] = "far.pkl"
    made = tmp_path / "mine"
    made.mkdir()
    (made / "card.json").write_text(json.dumps(CARD_PARTS))
    for source, name in sources.items():
        run(SCRIPT, source.partition("/")[0], str(handed_out / source), str(made / name))
    ours = {agent.type: agent for agent in street().agents}
    driving = street().agents[0]
    wanted = Modification(
        added=(vehicle("Agent12", 30.0, 0.5, 0.1),),
        moved=(replace(driving, x_m=25.0),),
        removed=(ours[AgentType.PEDESTRIAN].id,),
    )
    for entry in check_submission(given, made, checksum="").entries:
        assert entry.modification is not None, entry
        assert are_alike(entry.modification, wanted), entry
        assert [one.id for one in entry.modification.added] == ["Agent12"]
        assert ONLY_T0 in entry.notes
