"""The example of a planner in the documentation is driven as it stands there."""

from __future__ import annotations

import re
from types import ModuleType

import pytest

from augment.simulation.drive import run
from augment.simulation.planners import planner_named
from augment.simulation.traffic import DriveSetting
from tests.house.source import ROOT
from tests.simulation.worlds import street


def test_the_documented_planner_drives(monkeypatch: pytest.MonkeyPatch) -> None:
    page = (ROOT / "docs" / "simulation.md").read_text()
    found = re.search(r"```python\n(.*?)```", page, re.S)
    assert found is not None
    module = ModuleType("my_planners")
    exec(compile(found.group(1), "my_planners", "exec"), module.__dict__)
    monkeypatch.setitem(__import__("sys").modules, "my_planners", module)
    name = "my_planners.AlongTheCentreline"
    planner = planner_named(name, allowed=[name])
    drive = run(DriveSetting(scene=street()), planner, steps=10)
    assert drive.boxes[-1, 0] == pytest.approx(8.0, abs=0.01)
