"""What the tests of commands share."""

from pathlib import Path
from typing import Any

import pytest

from tests.management.votes import write_votes


@pytest.fixture
def votes(tmp_path: Path) -> Any:
    """Writes lines of votes into a file; returns its path as a command takes it."""
    return lambda *lines, **how: str(write_votes(tmp_path, *lines, **how))
