"""Reports of pairs in which something is wrong."""

import uuid

import pytest

from arena.models import Report, Study, Vote
from tests.api.asking import error_of, signed_in
from tests.study_rows import matchups_of

pytestmark = [pytest.mark.django_db, pytest.mark.urls("tests.api.urls")]


def test_a_report_is_kept_once_and_changes_no_vote(study: Study) -> None:
    matchup = matchups_of(study, "eva")[0]
    client = signed_in("eva")
    body = {
        "key": str(uuid.uuid4()),
        "matchup": str(matchup.code),
        "reason": "picture_wrong",
        "side": "B",
        "comment": "The truck is cut off.",
    }
    for _ in range(2):
        answer = client.post("/api/v1/reports", body, content_type="application/json")
        assert (answer.status_code, answer.json()) == (200, {"saved": True})
    kept = Report.objects.get()
    assert (kept.matchup, kept.reason, kept.comment) == (matchup, body["reason"], body["comment"])
    assert kept.side == "right"
    assert not Vote.objects.exists()


@pytest.mark.parametrize(
    ("whose", "changes", "status", "code"),
    [
        ("finn", {}, 404, "not_found"),
        ("eva", {"reason": "dull"}, 422, "invalid"),
        ("eva", {"comment": "x" * 1001}, 422, "invalid"),
        ("eva", {"side": "left"}, 422, "invalid"),
        ("eva", {"vote": 1}, 422, "invalid"),
    ],
)
def test_a_report_that_can_not_be_kept_says_why(
    study: Study, whose: str, changes: dict[str, object], status: int, code: str
) -> None:
    matchup = matchups_of(study, "eva")[0]
    body = {"key": str(uuid.uuid4()), "matchup": str(matchup.code), "reason": "other", **changes}
    answer = signed_in(whose).post("/api/v1/reports", body, content_type="application/json")
    error_of(answer, status, code)
    assert not Report.objects.exists()
