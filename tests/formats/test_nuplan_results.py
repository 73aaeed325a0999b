"""What nuPlan needs to drive our scenarios, and what it wrote of them."""

import math
import subprocess
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest
import yaml
from pyarrow import parquet

from augment.errors import InvalidDocument
from augment.formats.interplan.file import InterplanSource
from augment.formats.interplan.runs import SCRIPT, TOKENS, read_tokens
from augment.formats.interplan.writer import write
from augment.formats.nuplan_results import read_results
from augment.formats.writing import Cell
from augment.scene.entities import Modification, ScenarioType
from tests.formats.nuplan_experiment import METRICS, ran, scored, write_experiment
from tests.scenes import scene, vehicle

BASE = "71f182558ee95100"


def cell(who: str, *, token: str | None = BASE) -> Cell:
    rest: dict[str, Any] = {"scene": scene(), "type": ScenarioType.NUDGE, "contestant": who}
    rest["modification"] = Modification(added=(vehicle("Agent2", 20.0, -1.0),))
    source = None if token is None else InterplanSource(token=token)
    return Cell(name=f"street by {who}", augmentation=f"code-of-{who}", source=source, **rest)


def test_a_contestant_gets_a_filter_and_a_command(tmp_path: Path) -> None:
    files = write([cell("ann"), cell("bob"), cell("ann")]).files
    ann = yaml.safe_load(files["scenario_filter/arena-ann.yaml"])
    assert ann["scenario_tokens"] == [f"{BASE}-s0", f"{BASE}-s2"]
    assert ann["defaults"] == ["/interplan@modifications"]
    assert ann["_target_"].endswith("benchmark_scenario_filter.BenchmarkScenarioFilter")
    special = yaml.safe_load(files["interplan.yaml"])["modification_details_dictionary"][BASE]
    assert list(special["special_scenario"]) == ["0", "1", "2"]
    script = files[SCRIPT].decode()
    runs = [line.split("#") for line in script.splitlines() if line.startswith("run ")]
    said = {"ann": 2, "bob": 1}
    assert runs == [[f'run arena-{who} "$@"   ', f" {n} scenarios"] for who, n in said.items()]
    (tmp_path / "python").write_text('#!/bin/sh\nprintf "%s\\n" "$@"\n')
    (tmp_path / "python").chmod(0o700)
    (tmp_path / SCRIPT).write_text(script)
    asked = subprocess.run(
        ["/bin/sh", SCRIPT, "worker=sequential", "seed=two words"],
        env={"PATH": f"{tmp_path}:/usr/bin:/bin", "INTERPLAN_PLUGIN_ROOT": "/plugin"},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.splitlines()
    assert asked[:3] == [
        "/plugin/interplan/planning/script/run_simulation.py",
        *("+simulation=default_interplan_benchmark", "planner=pdm_closed_planner"),
    ]
    assert asked[3:5] == ["scenario_filter=arena-ann", "experiment_name=arena-ann"]
    first, second, *_, last = asked[5].removeprefix("hydra.searchpath=[").split(",")
    assert first == f"file://{tmp_path}"
    assert second == "pkg://interplan.planning.script.config.common"
    assert last == "pkg://nuplan.planning.script.experiments]"
    assert asked[6:8] == ["worker=sequential", "seed=two words"]
    assert asked[11:12] + asked[14:] == ["scenario_filter=arena-bob", *asked[6:8]]
    assert read_tokens(files[TOKENS])[f"{BASE}-s1"] == "code-of-bob"


def test_scenes_that_nuplan_does_not_have_are_in_no_filter() -> None:
    assert list(write([cell("ann", token=None)]).files) == ["interplan.yaml"]


def test_a_table_of_tokens_is_read_strictly() -> None:
    for content, place in (
        (b"\xff", "is no CSV file"),
        (b"scenario,augmentation\n", "line 1: needs the columns"),
        (b"scenario,augmentation,contestant,name\na,b,c\n", "line 2: needs 4 values"),
        (b"scenario,augmentation,contestant,name\na,b,c,d\na,b,c,d\n", "line 3: needs 4 values"),
    ):
        with pytest.raises(InvalidDocument, match=place):
            read_tokens(content)


def test_scores_and_failures_of_an_experiment_are_read(tmp_path: Path) -> None:
    rows = [scored(f"{BASE}-s0", 0.75), scored(f"{BASE}-s1", 0.0, drivable_area_compliance=0.0)]
    report = [ran(f"{BASE}-s0"), ran(f"{BASE}-s2", "Traceback\n  ...\nAssertionError: no route\n")]
    first, second, third = read_results(write_experiment(tmp_path / "run", rows, report))
    assert (first.scenario, first.planner, first.score) == (f"{BASE}-s0", "PDMClosedPlanner", 0.75)
    assert first.parts["lane_changes_to_goal"] is None
    assert first.is_interplan
    assert (second.score, second.parts["drivable_area_compliance"]) == (0.0, 0.0)
    assert (third.score, third.reason) == (None, "AssertionError: no route")


def test_a_scenario_without_a_score_costs_no_other(tmp_path: Path) -> None:
    rows = [scored("a-s0", math.nan), scored("a-s1", 0.5, __index_level_0__=7)]
    first, second = read_results(write_experiment(tmp_path / "run", rows))
    assert (first.score, first.reason) == (None, "nuPlan gave no score")
    assert (second.score, set(second.parts)) == (0.5, set(METRICS))


@pytest.mark.parametrize(
    ("row", "place"),
    [
        ({"score": 1.01}, "row 0: score: .*less than or equal to 1"),
        ({"drivable_area_compliance": math.inf}, "row 0: parts.*drivable_area_compliance.*finite"),
        ({"scenario": "a\nb"}, "row 0: scenario: .*match pattern"),
        ({"planner_name": None}, "row 0: planner: .*string"),
    ],
)
def test_a_row_that_is_none_is_named(tmp_path: Path, row: dict[str, Any], place: str) -> None:
    with pytest.raises(InvalidDocument, match=place):
        read_results(write_experiment(tmp_path / "run", [scored("a-s0", 0.5) | row]))


def test_what_is_no_experiment_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidDocument, match="aggregator_metric: holds no"):
        read_results(tmp_path)
    folder = write_experiment(tmp_path / "run", [scored("a-s0", 0.5)])
    (file,) = folder.glob("*/*.parquet")
    file.write_bytes(file.read_bytes()[:-20])
    with pytest.raises(InvalidDocument, match="is no Parquet file that can be read"):
        read_results(folder)
    parquet.write_table(pa.table({"scenario": ["a"]}), file)
    with pytest.raises(InvalidDocument, match="needs the columns scenario, log_name"):
        read_results(folder)
    bomb = {name: pa.array(["x"] * 100_001) for name in scored("a", 0.5)}
    parquet.write_table(pa.table(bomb), file)
    with pytest.raises(InvalidDocument, match="has more than 100,000 rows"):
        read_results(folder)
