"""How a page looks: bars, percents and badges, and text that can be read on every ground."""

import re
from pathlib import Path

import pytest
from django.conf import settings

from arena.templatetags.marks import job_mark, percent, segments
from augment.models import Augmentation, GenerationJob
from augment.services.running.progress import JobCounts

State = Augmentation.State


def test_what_waits_leaves_the_bar_empty() -> None:
    assert segments({State.QUEUED: 3, State.DONE: 0}) == []


def test_parts_follow_each_other_and_what_runs_comes_last() -> None:
    parts = segments({State.RUNNING: 1, State.DONE: 2, State.FAILED: 1, State.QUEUED: 4})
    assert [part["tone"] for part in parts] == ["good", "bad", "busy"]
    assert [part["start"] for part in parts] == pytest.approx([0.0, 25.0, 37.5])
    assert sum(part["width"] for part in parts) == pytest.approx(50.0)


def test_all_but_one_is_not_yet_a_hundred_percent() -> None:
    assert percent(999, 1000) == "99&nbsp;%"
    assert percent(0, 0) == "0&nbsp;%"


@pytest.mark.parametrize(
    ("job_state", "cells", "tone", "label"),
    [
        ("finished", {"done": 3}, "good", "Finished"),
        ("finished", {"unreadable": 3}, "warn", "Finished without a modification"),
        ("finished", {"done": 2, "failed": 1}, "warn", "Finished in part"),
        ("finished", {"unreadable": 1, "failed": 2}, "warn", "Finished in part"),
        ("finished", {"failed": 3}, "bad", "Failed"),
        ("running", {"failed": 3}, "busy", "Running"),
        ("cancelled", {"cancelled": 3}, "quiet", "Cancelled"),
        ("cancelled", {"cancelled": 2, "running": 1}, "busy", "Cancelled, 1 running"),
        ("cancelled", {"cancelled": 1, "running": 2}, "busy", "Cancelled, 2 running"),
        ("stopped_at_cap", {"failed": 3}, "warn", "Stopped at cap"),
    ],
)
def test_a_job_is_marked_by_what_became_of_its_rows(
    job_state: str, cells: dict[str, int], tone: str, label: str
) -> None:
    by_state = {state: cells.get(state.value, 0) for state in Augmentation.State}
    job = GenerationJob(name="a job", state=job_state)
    found = job_mark(JobCounts(job=job, by_state=by_state))
    assert (found.tone, found.label) == (tone, label)


SOFT = ("good", "warn", "bad", "busy", "simulated")
PAIRS = [
    *((text, ground) for text in ("ink", "ink-soft") for ground in ("paper", "surface", "sunken")),
    *(("accent", ground) for ground in ("paper", "surface", "sunken")),
    *((tone, f"{tone}-soft") for tone in SOFT),
    *((tone, "surface") for tone in SOFT),
    *(("ink", f"{tone}-soft") for tone in SOFT),
    *(("accent", f"{tone}-soft") for tone in SOFT),
    ("on-accent", "accent"),
    ("on-accent", "accent-strong"),
    ("accent-strong", "accent-soft"),
]


def colours(theme: int) -> dict[str, str]:
    text = (Path(settings.BASE_DIR) / "static/css/tokens.css").read_text()
    found = re.findall(r"--([\w-]+): light-dark\((#\w{6}), (#\w{6})\)", text)
    return {name: pair[theme] for name, *pair in found}


def luminance(colour: str) -> float:
    channels = [int(colour[place : place + 2], 16) / 255 for place in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    light, dark = sorted((luminance(one), luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("theme", [0, 1], ids=["light", "dark"])
def test_text_has_a_contrast_of_four_and_a_half_and_borders_of_fields_of_three(theme: int) -> None:
    known = colours(theme)
    faint = [pair for pair in PAIRS if contrast(*map(known.__getitem__, pair)) < 4.5]
    assert faint == []
    assert contrast(known["line-strong"], known["surface"]) >= 3.0
