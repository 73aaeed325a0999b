"""What the tests of commands share."""

from pathlib import Path
from typing import Any

import pytest

from tests.management.votes import HEAD


@pytest.fixture
def votes(tmp_path: Path) -> Any:
    def written(*lines: str, head: str = HEAD, start: str = "", end: str = "\n") -> str:
        path = tmp_path / "votes.csv"
        path.write_bytes((start + end.join([head, *lines]) + end).encode())
        return str(path)

    return written
