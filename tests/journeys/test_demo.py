"""`make demo SERVE=0`: the main job, unattended, on the real parts."""

import csv
import json
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.processes import ROOT, copy_database, wait_until
from tests.stack import SMALL_DEMO, Home

pytestmark = [pytest.mark.redis, pytest.mark.slow, pytest.mark.timeout(1000)]

LONGEST_PX, MOST_CONTROLS = 2_500, 40

CONTINUOUS = ("job", "job-grid")
"""A table that goes on as one scrolls; each of its cells is a link."""


def standings(home: Home) -> list[dict[str, str]]:
    with (home.folder / "var" / "demo" / "leaderboard.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_it_leaves_a_leaderboard_that_says_that_it_is_simulated(demo_home: Home) -> None:
    rows = standings(demo_home)
    assert len(rows) >= 3
    assert demo_home.rows("SELECT count(*) FROM arena_vote") == [(200,)]
    assert sum(int(row["wins"]) + int(row["losses"]) for row in rows) <= 2 * 200
    assert sum(int(row["votes"]) for row in rows) >= 2 * 200  # settled pairs count as ties
    kinds = "SELECT count(DISTINCT s.type) FROM augment_augmentation a JOIN augment_scenario s"
    kinds += " ON s.id = a.scenario_id WHERE a.state = 'done' AND s.catalogue_set = 'moving'"
    assert demo_home.rows(kinds) == [(8,)]
    functions = "SELECT DISTINCT c.variant, json_extract(n.document, '$.tool') "
    functions += "FROM augment_transcriptnote n JOIN augment_attempt t ON t.id = n.attempt_id "
    functions += "JOIN augment_augmentation a ON a.id = t.augmentation_id "
    functions += "JOIN augment_contestant c ON c.id = a.contestant_id "
    functions += (
        "WHERE n.kind = 'tool_call' AND json_extract(n.document, '$.understood') ORDER BY 1"
    )
    assert demo_home.rows(functions) == [
        ("fc", "retrieve_suitable_pose"),
        ("fc-plus", "pose_on_lane"),
    ]
    document = json.loads((demo_home.folder / "var" / "demo" / "leaderboard.json").read_text())
    assert len(document["standings"]) == len(rows)
    assert r"\toprule" in (demo_home.folder / "var" / "demo" / "leaderboard.tex").read_text()
    for ending in ("csv", "json", "tex", "svg"):
        path = demo_home.folder / "var" / "demo" / f"leaderboard.{ending}"
        assert "simulated" in path.read_text().lower(), path.name


def test_its_open_study_has_twenty_pairs_and_soon_a_film(demo_home: Home) -> None:
    pairs = (
        "SELECT m.position, c.catalogue_set FROM arena_matchup m "
        "JOIN arena_study s ON s.id = m.study_id JOIN augment_scenario c ON c.id = m.scenario_id "
        "WHERE s.state = 'open' ORDER BY 1"
    )
    rows = demo_home.rows(pairs)
    assert [position for position, _ in rows] == list(range(1, 21))
    assert "moving" in [which for _, which in rows[:3]]


def test_a_second_run_uses_what_is_there(demo_home: Home, tmp_path: Path) -> None:
    again = demo_home.copy(tmp_path / "again")
    before = (again.folder / "var" / "demo" / "leaderboard.csv").read_bytes()
    again.must(*SMALL_DEMO)
    assert (again.folder / "var" / "demo" / "leaderboard.csv").read_bytes() == before


def test_its_study_travels_whole(demo_home: Home, tmp_path: Path) -> None:
    """Export, import into an empty installation, export again: the same folder, to the byte."""
    first, second = tmp_path / "first", tmp_path / "second"
    ((name,),) = demo_home.rows("SELECT name FROM arena_study WHERE state = 'closed'")
    demo_home.must("export", "study", name, "--out", str(first))
    elsewhere = Home.at(tmp_path / "h")
    elsewhere.must_all(
        ("import", "study", str(first)), ("export", "study", name, "--out", str(second))
    )
    compared = subprocess.run(["diff", "-r", str(first), str(second)], capture_output=True)
    assert compared.stdout == b""
    assert len(list((first / "transcripts").iterdir())) >= 20
    assert len(list((first / "media" / "bev").rglob("*.png"))) >= 20


def test_ctrl_c_in_the_middle_ends_it_at_once(migrated: Path, tmp_path: Path) -> None:
    copy_database(migrated, tmp_path / "db.sqlite3")
    log = tmp_path / "demo.log"
    with log.open("w") as file:
        demo = subprocess.Popen(
            [sys.executable, "manage.py", "demo", "--no-serve"],
            cwd=ROOT,
            env=Home.at(tmp_path).environment,
            stdout=file,
            stderr=subprocess.STDOUT,
        )
    under_way = re.compile(r"\d+ of \d+ augmentations")
    wait_until(lambda: bool(under_way.search(log.read_text())), what="the job is under way")
    demo.send_signal(signal.SIGINT)
    assert demo.wait(timeout=120) == 130
    assert "The demo was stopped before it was done" in log.read_text()
    assert "Traceback" not in log.read_text()
    assert "Augmentations:" not in log.read_text()


@pytest.mark.browser
def test_a_page_is_short_and_has_few_controls(demo_home: Home, tmp_path: Path) -> None:
    home = demo_home.copy(tmp_path / "pages")
    ended = subprocess.run(
        [sys.executable, "-m", "tests.screenshots", str(home.folder), "--measure"],
        cwd=ROOT,
        capture_output=True,
        check=False,
        text=True,
    )
    assert ended.returncode == 0, ended.stderr
    sizes: dict[str, tuple[int, int]] = json.loads(ended.stdout.splitlines()[-1])
    assert len(sizes) > 60
    wrong = {
        name: f"{high} px, {controls} controls"
        for name, (high, controls) in sizes.items()
        if high > LONGEST_PX or (controls > MOST_CONTROLS and name not in CONTINUOUS)
    }
    assert wrong == {}
