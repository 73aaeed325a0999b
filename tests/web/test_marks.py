"""The stacked bar of a job."""

from __future__ import annotations

import pytest

from arena.templatetags.marks import percent, segments
from augment.models import Augmentation

State = Augmentation.State


def test_what_waits_leaves_the_bar_empty() -> None:
    assert segments({State.QUEUED: 3, State.DONE: 0}) == []


def test_parts_follow_each_other_and_what_runs_comes_last() -> None:
    parts = segments({State.RUNNING: 1, State.DONE: 2, State.FAILED: 1, State.QUEUED: 4})
    assert [part.tone for part in parts] == ["good", "bad", "busy"]
    assert [part.start for part in parts] == pytest.approx([0.0, 25.0, 37.5])
    assert sum(part.width for part in parts) == pytest.approx(50.0)


def test_all_but_one_is_not_yet_a_hundred_percent() -> None:
    assert percent(999, 1000) == "99&nbsp;%"
    assert percent(0, 0) == "0&nbsp;%"
