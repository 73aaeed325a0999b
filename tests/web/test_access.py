"""Every page times every role, as one table; and who only looks changes nothing."""

import re
from urllib.parse import parse_qs, urlsplit

import pytest
from django.db import connection
from django.test import Client
from django.test.utils import CaptureQueriesContext
from django.urls import reverse

from arena.site.urls import urlpatterns
from arena.studies.services.opening import close_study
from tests.web.addresses import STRANGER, address
from tests.web.cast import people, signed_in, status, world

pytestmark = pytest.mark.django_db


STAFF, ADMIN = (200, 200, 403), (200, 403, 403)
"""What an admin, a researcher and an expert are answered who take part in nothing."""


def _table(names: dict[tuple[int, int, int], str]) -> dict[str, tuple[int, int, int]]:
    return {name: status for status, of_it in names.items() for name in of_it.split()}


PAGES = _table(
    {
        STAFF: (
            "jobs job job-tab job-progress job-export transcripts-export analyses drives drive "
            "faults augmentation transcript contestants contestant endpoints endpoint "
            "endpoint-model scenes scene upload scenarios scenario intent scenario-edit "
            "scenarios-bulk prompts correct picture studies study preregistration "
            "results results-tab benchmarks benchmark boards board board-export "
            "submissions submission submission-new sweeps sweep sweep-file"
        ),
        ADMIN: (
            "job-new contestant-new endpoint-new endpoint-listed audit people person-forget "
            "import-votes study-new study-draft enrolment benchmark-new"
        ),
        (404, 404, 403): (
            "scenarios-export drive-file asked-image prompt-image study-file benchmark-file "
            "board-file"
        ),
        (403, 403, 403): (
            "results-votes results-votes-file shown-picture results-export results-compare "
            "results-judges judge-answers"
        ),
        (403, 403, 404): "label vote vote-practice vote-skipped",
        (200, 200, 200): "home password api-tokens",
        (200, 401, 401): "metrics",
        (302, 403, 403): "study-draft-preview",
        (404, 403, 403): "enrolment-voters",
        (200, 403, 404): "matchup-image",
        (404, 403, 404): "replay",
    }
)
"""By GET."""

ACTIONS = _table(
    {
        # before anybody looks early
        (403, 403, 403): (
            "study-rate rating-again results-share results-unshare judge-start judge-cancel"
        ),
        (302, 403, 403): (
            "job-retry job-pause contestant-retired endpoint-model-new "
            "endpoint-probe catalogue-load job-simulate person-change revoke author "
            "scenario-retired intent-read job-resume study-again "
            "study-draft-discard study-hand-over first-step benchmark-retired board-batch "
            "submission-decline sweep-start follow-up"
        ),
        (302, 302, 403): (
            "scene-send upload-show scenarios-write study-write set-intent results-open "
            "benchmark-write board-publish board-share board-unshare family-draw"
        ),
        ADMIN: ("scenario-delete scene-delete sweep-remove job-cancel study-close study-cancel"),
        (201, 403, 403): "invite person-link",
        (302, 302, 302): "theme language",
        (422, 422, 403): "edit-check",
        (302, 404, 403): "upload-remove",
        (404, 404, 404): "api-token-revoke",
        (404, 404, 403): "submission-withdraw",
        (404, 403, 403): "labelling-close",
    }
)
"""By POST."""
OPEN_TO_THE_WORLD = {
    *("login", "logout", "enrol", "invitation", "healthz", "readyz", "metrics", "first"),
    *("welcome", "shared-results", "shared-file", "shared-board", "shared-board-file"),
}


def test_every_role_gets_what_the_table_says() -> None:
    here, accounts = world(), people()
    for name, expected in PAGES.items():
        url = address(name, here)
        found = tuple(status(user, url) for user in accounts.values())
        assert found == expected, name
        check_login_alone(name, url)
    for name in ("job", "augmentation", "scenario", "study", "results"):
        url = reverse(name, kwargs={"code": STRANGER})
        assert status(accounts["admin"], url) == 404, name


def check_login_alone(name: str, url: str) -> None:
    """What is open to nobody: programs are told so, people are led to the login."""
    answer = Client().get(url)
    if name in ("job-progress", "metrics"):
        assert answer.status_code in (401, 403)
    else:
        assert answer.status_code == 302, name
        assert answer.headers["Location"].startswith(reverse("login")), name


ASKS_FIRST = {
    **{"scenario-delete": 200, "scene-delete": 200, "sweep-remove": 200},
    **{"study-close": 200, "study-cancel": 200, "job-cancel": 200},
    "labelling-close": 404,
}
"""What a GET of them answers: a question, which changes nothing; here nobody labels."""


def test_every_action_needs_a_post_and_is_for_the_roles_of_the_table() -> None:
    here, accounts = world(), people()
    for name in ACTIONS:
        url = address(name, here)
        assert status(accounts["admin"], url) == ASKS_FIRST.get(name, 405), name
        check_login_alone(name, url)
    for name, expected in ACTIONS.items():
        url = address(name, here)
        found = tuple(signed_in(user).post(url).status_code for user in accounts.values())
        assert found == expected, name


def test_a_button_pressed_after_the_session_ended_leads_back_to_its_page() -> None:
    """The button's own address takes a POST alone: there the browser would show an error."""
    here, admin = world(), people()["admin"]
    page = f"http://testserver{address('job', here)}"
    pause = address("job-pause", here)
    for referer, leads_to in ((page, page), ("http://elsewhere/x/", pause), ("", pause)):
        answer = Client().post(pause, headers={"referer": referer})
        asked = parse_qs(urlsplit(answer.headers["Location"]).query)
        assert asked == {"next": [leads_to]}
    admin.set_password("x")
    admin.save()
    given = {"username": admin.username, "password": "x", "next": page}
    assert Client().post(reverse("login"), given).headers["Location"] == page


def test_the_table_misses_no_page() -> None:
    known = {*PAGES, *ACTIONS, *OPEN_TO_THE_WORLD}
    assert {pattern.name for pattern in urlpatterns} - known == set()


def test_an_account_without_a_role_sees_that_it_has_none() -> None:
    person = people()["expert"]
    person.groups.clear()
    assert "no role yet" in signed_in(person).get(reverse("home")).content.decode()


def test_results_open_to_their_experts_and_to_staff_when_the_study_closes() -> None:
    here, accounts = world(), people()
    close_study(study=here.study)
    url = reverse("results", args=[here.study.code])
    assert signed_in(accounts["researcher"]).get(url).status_code == 200
    assert signed_in(here.expert).get(url).status_code == 200
    assert signed_in(accounts["expert"]).get(url).status_code == 403


WRITES = re.compile(r'^(?:INSERT(?: OR \w+)? INTO|UPDATE|DELETE FROM) "(\w+)"')
ALLOWED = {"django_session"}
"""What a look may write: that its session goes on."""


def test_no_page_of_staff_writes_a_row_when_it_is_read() -> None:
    """An admin opens whatever a researcher opens."""
    here, client, wrote = world(), signed_in(people()["admin"]), {}
    for name in (name for name, answers in PAGES.items() if answers[0] == 200):
        url = address(name, here)
        with CaptureQueriesContext(connection) as seen:
            answer = client.get(url)
            if answer.streaming:
                b"".join(answer)
        written = {found[1] for one in seen if (found := WRITES.match(one["sql"]))}
        if written - ALLOWED:
            wrote[name] = written - ALLOWED
    assert wrote == {}
