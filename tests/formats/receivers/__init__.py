"""The receivers' own software, run in its own environment on what our writers wrote."""

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[3]
PYTHON = ROOT / ".bench" / "receivers" / "bin" / "python"
HERE = Path(__file__).parent


def told_by(*files: Path) -> list[dict[str, Any]]:
    """What the script beside this file prints about each of the files."""
    lines = run(HERE / "script.py", *(str(file) for file in files)).splitlines()
    return [json.loads(line) for line in lines]


def run(script: Path, *arguments: str) -> str:
    """What a script prints.

    Without the environment (`make receivers`) a named skip, in CI a failure.
    """
    if not PYTHON.exists():
        if os.environ.get("CI"):
            pytest.fail("make receivers was not run, and in CI nothing is skipped")
        pytest.skip("the receivers are not installed: make receivers")
    command = [str(PYTHON), "-I", str(script), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout
