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
from tests.web.cast import ROLES, look, people, signed_in, world

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
WRITES = re.compile(r'^(?:INSERT(?: OR \w+)? INTO|UPDATE|DELETE FROM) "(\w+)"')
ALLOWED = {"django_session"}
"""What a look may write: that its session goes on."""

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


def clients() -> list[Client]:
    """One of each role, in the order of the table."""
    made = [Client() for _ in ROLES]
    for client, user in zip(made, people().values(), strict=True):
        client.force_login(user)
    return made


def test_every_role_gets_what_the_table_says() -> None:
    """And what an admin looks at, which a researcher may as well, stays as it is."""
    here, wrote = world(), {}
    admin, *others = clients()
    for name, expected in PAGES.items():
        url = address(name, here)
        with CaptureQueriesContext(connection) as seen:
            status = look(admin, url)
        assert (status, *(look(client, url) for client in others)) == expected, name
        check_login_alone(name, url)
        written = {match[1] for one in seen if (match := WRITES.match(one["sql"]))}
        if expected[0] == 200 and written - ALLOWED:
            wrote[name] = written - ALLOWED
    assert wrote == {}
    for name in ("job", "augmentation", "scenario", "study", "results"):
        assert look(admin, reverse(name, kwargs={"code": STRANGER})) == 404, name


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
    here, of_roles = world(), clients()
    for name in ACTIONS:
        url = address(name, here)
        assert look(of_roles[0], url) == ASKS_FIRST.get(name, 405), name
        check_login_alone(name, url)
    for name, expected in ACTIONS.items():
        url = address(name, here)
        assert tuple(client.post(url).status_code for client in of_roles) == expected, name


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
