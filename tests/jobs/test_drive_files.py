"""Drives from files to files: parts make up one run byte for byte, and need no database."""

import json
from datetime import date
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from django.core.management import call_command
from django.core.management.base import CommandError

from augment.formats.own_json import write
from augment.formats.writing import Cell
from augment.scene.entities import Modification
from augment.simulation.drive import STEPS
from augment.simulation.planning import Plan, Situation
from tests.jobs.test_simulations import Straight
from tests.scenes import cone, scene

PLANNER = "tests.jobs.test_simulations.Straight"


@pytest.fixture
def scenarios(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Five streets, each with a cone further to the left; the last two are passed."""
    monkeypatch.setitem(STEPS, False, 26)
    cells = [
        Cell(
            name=f"cone {n}",
            stem=f"cone-{n}",
            scene=scene(),
            type=None,
            modification=Modification(added=(cone("Agent2", 20.0, 0.6 * n),)),
            made_on=date(2026, 11, 26),
        )
        for n in range(5)
    ]
    folder = tmp_path / "scenarios"
    folder.mkdir()
    for name, content in write(cells).files.items():
        (folder / name).write_bytes(content)
    return folder


class FailsBesideACone(Straight):
    """Raises where the third street's cone stands."""

    def plan(self, situation: Situation) -> Plan:
        if np.isclose(situation.objects.boxes[:, 1], 1.2).any():
            raise RuntimeError("no idea")
        return super().plan(situation)


def simulate(source: Path, out: Path, shard: str = "1/1") -> dict[str, bytes]:
    call_command("simulate", str(source), to=out, shard=shard, planner=PLANNER, stdout=StringIO())
    return {file.name: file.read_bytes() for file in sorted(out.iterdir())}


@pytest.mark.slow
def test_the_parts_together_are_one_run_byte_for_byte(scenarios: Path, tmp_path: Path) -> None:
    whole = simulate(scenarios, tmp_path / "whole")
    assert list(whole) == [f"cone-{n}.drive.json" for n in range(5)]
    sizes, parts = [], tmp_path / "parts"
    for part in (3, 1, 2):
        before = len(list(parts.iterdir())) if parts.exists() else 0
        sizes.append(len(simulate(scenarios, parts, f"{part}/3")) - before)
    assert (sizes, simulate(scenarios, parts, "9/9")) == ([1, 2, 2], whole)
    hit = [len(json.loads(content)["collisions"]) for content in whole.values()]
    assert hit == [1, 1, 1, 0, 0], "bodies 2.3 m and 0.5 m wide touch below 1.4 m"


def test_what_cannot_be_driven_costs_the_others_nothing(
    scenarios: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (scenarios / "cone-1.before.json").write_text("{")
    out, planner = tmp_path / "out", f"{__name__}.FailsBesideACone"
    out.mkdir()
    (out / "cone-2.drive.json").write_text("of a run before")
    with pytest.raises(CommandError, match="2 of 5 can't be driven"):
        call_command("simulate", str(scenarios), to=out, planner=planner)
    printed = capsys.readouterr().out
    assert "cone-1: This scene can't be read" in printed
    assert "cone-2: unexpected: RuntimeError: no idea" in printed
    assert sorted(file.name for file in out.iterdir()) == [
        f"cone-{n}.drive.json" for n in (0, 3, 4)
    ]


@pytest.mark.parametrize("shard", ["0/3", "4/3", "1/0", "one", "1/3/5", ""])
def test_a_shard_that_is_none_is_refused(scenarios: Path, tmp_path: Path, shard: str) -> None:
    with pytest.raises(CommandError, match="I from 1 to N"):
        simulate(scenarios, tmp_path / "out", shard)


def test_a_folder_without_scenarios_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CommandError, match=r"before\.json"):
        simulate(tmp_path, tmp_path / "out")
    assert not (tmp_path / "out").exists()
