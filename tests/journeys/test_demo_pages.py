"""No page of the demo is long or crowded."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.processes import ROOT
from tests.stack import Home

pytestmark = [pytest.mark.browser, pytest.mark.redis, pytest.mark.slow, pytest.mark.timeout(900)]

LONGEST_PX, MOST_CONTROLS = 2_500, 40

CONTINUOUS = ("job", "job-grid")
"""A table that goes on as one scrolls; each of its cells is a link."""


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
