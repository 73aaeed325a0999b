"""What the tests of files share."""

import pytest


@pytest.fixture
def drawn_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw every chart that is asked for; no file keeps one."""
    monkeypatch.setattr(
        "arena.exports.drawing.compute_once", lambda suffix, compute, *parts: compute()
    )


@pytest.fixture
def no_charts(monkeypatch: pytest.MonkeyPatch) -> None:
    without_charts(monkeypatch)


def without_charts(patch: pytest.MonkeyPatch) -> None:
    """Draw no chart: for files of which others are looked at."""
    patch.setattr("arena.exports.drawing.compute_once", lambda *_: b"a chart")
