"""What the tests of files share."""

import pytest


@pytest.fixture
def drawn_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw every chart that is asked for; no file keeps one."""
    monkeypatch.setattr(
        "arena.exports.drawing.compute_once", lambda suffix, compute, *parts: compute()
    )
