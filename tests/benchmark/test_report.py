"""The report on a submission as a document, and the card as it comes in."""

import json
from dataclasses import replace

import pytest

from augment.benchmark.report import (
    CARD,
    describe_report,
    report_from_document,
    report_to_document,
)
from augment.benchmark.values import EntryStatus, SubmissionReport, SubmittedEntry
from augment.checks import Ground
from augment.errors import InvalidDocument
from augment.metrics.displacement import displacement
from augment.scene.entities import Modification
from augment.scene.planned_motion import AtTime
from tests.metrics.test_over_time import starts
from tests.scene.test_planned_motion import two_lanes
from tests.scenes import vehicle

CARD_PARTS = {
    **{"name": "DiffScene", "authors": ["A. Author"], "method": "Diffusion over vectors."},
    **{"models": [], "is_open": True, "samples": 1, "cost_usd": 1.5, "made_on": "2026-11-20"},
}


def report() -> SubmissionReport:
    change = Modification(added=(vehicle("Agent2", 1 / 3, 2.0),))
    found = displacement(change, Modification(added=(vehicle("Agent2", 0.0, 0.0),)))
    read = SubmittedEntry(
        task="near",
        sample=1,
        status=EntryStatus.READ,
        file="near.json",
        modification=change,
        displacement=found,
    )
    missing = SubmittedEntry(task="far", sample=2, status=EntryStatus.MISSING, reason="no file")
    return SubmissionReport(
        benchmark="streets",
        version=1,
        checksum="ab" * 32,
        card=CARD.from_parts(CARD_PARTS),
        entries=(read, missing),
    )


def test_a_report_comes_back_from_json_to_the_last_digit() -> None:
    text = json.dumps(report_to_document(report()))
    assert report_from_document(json.loads(text)) == report()
    assert "average_m" not in text
    lines = list(describe_report(report()))
    assert lines[0] == "near    read        near.json  2.0275875100994067 m, 0 missing, 0 surplus"
    assert lines[1] == "far--2  missing     no file"
    assert "1 read, 0 refused, 0 unreadable, 1 missing" in lines
    assert not any("wish" in line for line in lines)
    read = report().entries[0]
    wished = replace(
        report(), entries=(replace(read, wish=replace(read.displacement, matches=())),)
    )
    assert report_from_document(report_to_document(wished)) == wished
    lines = list(describe_report(wished))
    assert lines[0].endswith("m, 0 missing, 0 surplus  wish 0 missing, 0 surplus")
    assert "Distance to the wish on practice: nothing matched, 0 matched, 0 missing" in lines[-1]


def test_what_moves_is_told_over_time_and_comes_back() -> None:
    one, other = starts(AtTime(after_s=3.0)), starts(AtTime(after_s=2.0))
    found = displacement(one, other, Ground.of(two_lanes()))
    moving = replace(report(), entries=(replace(report().entries[0], displacement=found),))
    assert report_from_document(report_to_document(moving)) == moving
    lines = list(describe_report(moving))
    over_time = "0.0 m at t0, 5.0"
    assert over_time in lines[0]
    assert over_time in lines[-1]


def test_a_card_is_strict_and_names_the_field() -> None:
    for change, reason in (
        ({"samples": 0}, "samples: Input should be greater than or equal to 1, got 0"),
        ({"is_open": "yes"}, "is_open: Input should be a valid boolean, got 'yes'"),
        ({"made_on": 20261120}, "made_on: Input should be a date such as 2026-11-20"),
        ({"cost_usd": float("nan")}, "cost_usd: Input should be a finite number, got nan"),
        ({"licence": "MIT"}, "licence: is not a field of this format"),
    ):
        with pytest.raises(InvalidDocument) as fault:
            CARD.from_parts(CARD_PARTS | change)
        assert reason in str(fault.value)
