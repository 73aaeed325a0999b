"""Nothing of the machine but what tests/environment.py names reaches the tests."""

import json
import os
import subprocess
import sys
from pathlib import Path

from tests.environment import FIXED, KEPT, STARTED
from tests.house.source import ROOT

SHOW = "import tests.environment, json, os; print(json.dumps(dict(os.environ)))"


def test_the_tests_have_a_home_of_their_own_and_nothing_that_is_not_named() -> None:
    foreign = {
        "PYTHONUNBUFFERED": "1",
        "ARENA_DEBUG": "1",
        "HTTPS_PROXY": "http://nowhere",
        "LANG": "tr_TR.UTF-8",
    }
    shown = subprocess.run(
        [sys.executable, "-c", SHOW],
        cwd=ROOT,
        env={"PATH": os.environ["PATH"], "HOME": "/root", "TZ": "Asia/Tokyo", **foreign},
        capture_output=True,
        text=True,
        check=True,
    )
    found = json.loads(shown.stdout)
    assert not foreign.keys() & found.keys()
    assert found.items() >= FIXED.items()
    own = {name: found[name] for name in ("HOME", "ARENA_VAR_DIR", STARTED)}
    assert not {"/root", os.environ["HOME"], os.environ["ARENA_VAR_DIR"]} & set(own.values())
    assert set(found) <= KEPT.keys() | FIXED.keys() | own.keys()


def test_this_run_is_in_it() -> None:
    assert os.environ["HOME"] == os.environ[STARTED]
    assert not (Path(os.environ["HOME"]) / ".bashrc").exists()
