"""A finding is a value with a sentence."""

from __future__ import annotations

import pytest

from augment.checks import Finding, FindingKind, Severity
from augment.checks.registry import ASKED_CHECKS, CHECKS

OFF = Finding(
    kind=FindingKind.LANE,
    severity=Severity.FACT,
    agents=("Agent2",),
    lanes=("42811-b",),
    measured={"off_m": 7.28, "left_m": -9.0, "along_lanes_m": None},
    template="{agents[0]} is {off_m:.1f} m off {lanes[0]}, {left_m:.1f} m to its right.",
)


def test_its_sentence_tells_sizes_and_leaves_signs_to_the_words() -> None:
    assert OFF.sentence() == "Agent2 is 7.3 m off 42811-b, 9.0 m to its right."


def test_its_sentence_calls_things_what_the_reader_calls_them() -> None:
    assert OFF.sentence({"42811-b": "Lane3"}).startswith("Agent2 is 7.3 m off Lane3,")


def test_a_name_with_braces_is_only_a_name() -> None:
    assert OFF.sentence({"Agent2": "{lanes[0]}"}).startswith("{lanes[0]} is 7.3 m")


def test_its_numbers_stay_what_they_are() -> None:
    with pytest.raises(TypeError):
        OFF.measured["off_m"] = 0.0  # type: ignore[index]
    assert len({OFF, OFF}) == 1


def test_every_kind_has_its_check() -> None:
    asked = {check.__name__.removeprefix("find_") for check in ASKED_CHECKS} | {
        FindingKind.ASKED_SIDE,
        FindingKind.ASKED_CROSSING,
    }
    # They tell sides, headings, crossings and gaps; counts; and what nobody asked for.
    asked -= {"asked_walk", "asked_crash", "asked_changes", "attempted"}
    alone = {check.__name__ for check in CHECKS}
    assert (alone | asked, alone & asked) == ({kind.value for kind in FindingKind}, set())
