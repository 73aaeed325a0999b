"""What strangers may hand us: every file ends in our own error, in good time and memory."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from tests.formats.hostile_files import HOSTILE

MOST_CPU_S = 6.0
"""Two seconds are promised (docs/formats.md has what each takes); a busy machine takes longer."""
MOST_MB = 1024


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[str, float, float]]:
    """What a process of a gigabyte made of all of them: what it said, CPU seconds, MB."""
    root = tmp_path_factory.mktemp("hostile")
    plan = []
    for name, make in HOSTILE.items():
        (root / name).mkdir()
        reader, path = make(root / name)
        plan.append([name, reader, str(path)])
    (root / "plan.json").write_text(json.dumps(plan))
    told = subprocess.run(
        [sys.executable, "-m", "tests.formats.hostile_child", str(root / "plan.json")],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert told.returncode == 0, told.stderr
    return {name: tuple(rest) for name, *rest in map(json.loads, told.stdout.splitlines())}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_file_is_refused_in_good_time_and_a_gigabyte(
    outcomes: dict[str, tuple[str, float, float]], name: str
) -> None:
    said, cpu_s, peak_mb = outcomes[name]
    assert said.startswith("refused: This "), said
    assert cpu_s < MOST_CPU_S
    assert peak_mb < MOST_MB
