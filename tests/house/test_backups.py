"""The commands of docs/deploying.md keep all votes, also those that a copy of the file lacks."""

from __future__ import annotations

import os
import re
import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest

from tests.house.source import ROOT

VOTES = 60


def commands() -> tuple[str, str]:
    """The two blocks of the section: taking a backup, and putting it back."""
    text = (ROOT / "docs" / "deploying.md").read_text()
    section = text.split("\n## Backups\n")[1].split("\n## ")[0]
    taking, restoring = re.findall(r"(?:^    .+\n)+", section, re.MULTILINE)
    return taking, restoring


def run(script: str, folder: Path) -> None:
    python = folder / "bin" / "python"
    if not python.exists():
        python.parent.mkdir()
        python.symlink_to(sys.executable)
    path = f"{python.parent}{os.pathsep}{os.environ['PATH']}"
    subprocess.run(
        ["sh", "-e", "-c", script],
        cwd=folder,
        env={**os.environ, "PATH": path},
        check=True,
        capture_output=True,
    )


def votes_in(file: Path) -> int:
    with closing(sqlite3.connect(file)) as rows:
        return int(rows.execute("SELECT count(*) FROM votes").fetchone()[0])


@pytest.fixture
def home(tmp_path: Path) -> Path:
    (tmp_path / "var").mkdir()
    (tmp_path / "var" / "secret_key").write_text("a key")
    (tmp_path / "media" / "bev").mkdir(parents=True)
    (tmp_path / "media" / "bev" / "picture.png").write_bytes(b"...")
    return tmp_path


def test_a_backup_of_a_live_database_has_every_vote_and_can_be_put_back(home: Path) -> None:
    live = home / "var" / "arena.sqlite3"
    with closing(sqlite3.connect(live, isolation_level=None)) as server:
        server.execute("PRAGMA journal_mode=WAL")
        server.execute("PRAGMA wal_autocheckpoint=0")
        server.execute("CREATE TABLE votes (outcome TEXT)")
        server.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        server.executemany("INSERT INTO votes VALUES (?)", [["left"]] * VOTES)
        copy = shutil.copy(live, home / "copy.sqlite3")
        assert votes_in(Path(copy)) == 0, "that is why a copy is no backup"
        taking, restoring = commands()
        run(taking, home)
        server.execute("INSERT INTO votes VALUES ('after the backup')")
    kept = home / "backup"
    assert votes_in(kept / "arena.sqlite3") == VOTES
    assert {path.stat().st_mode & 0o077 for path in kept.rglob("*")} == {0}
    for lost in ("var", "media"):
        shutil.rmtree(home / lost)
    (home / "var").mkdir()
    run(restoring, home)
    assert votes_in(live) == VOTES
    assert (home / "var" / "secret_key").read_text() == "a key"
    assert (home / "media" / "bev" / "picture.png").read_bytes() == b"..."


def test_a_second_backup_overwrites_none(home: Path) -> None:
    with closing(sqlite3.connect(home / "var" / "arena.sqlite3")) as server:
        server.execute("CREATE TABLE votes (outcome TEXT)")
    taking, _ = commands()
    run(taking, home)
    with pytest.raises(subprocess.CalledProcessError):
        run(taking, home)


def test_without_a_database_there_is_no_backup(tmp_path: Path) -> None:
    (tmp_path / "var").mkdir()
    with pytest.raises(subprocess.CalledProcessError):
        run(commands()[0], tmp_path)
    assert list((tmp_path / "backup").iterdir()) == []
    assert list((tmp_path / "var").iterdir()) == []
