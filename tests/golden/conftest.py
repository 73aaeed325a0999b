"""The option by which the golden files are written instead of compared."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

REWRITE = "--rewrite-golden"
FOLDER = Path(__file__).parent / "files"

Check = Callable[[str, object], None]


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(REWRITE, action="store_true", help="write the golden files anew")


@pytest.fixture
def check(request: pytest.FixtureRequest) -> Check:
    """Compare a text, or what JSON can say, with the golden file of a name."""

    def compare(name: str, value: object) -> None:
        text = value if isinstance(value, str) else json.dumps(value, indent=1) + "\n"
        if request.config.getoption(REWRITE, default=False):
            (FOLDER / name).write_text(text, encoding="utf-8")
        assert text.splitlines() == (FOLDER / name).read_text(encoding="utf-8").splitlines()

    return compare
