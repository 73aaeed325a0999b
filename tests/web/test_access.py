"""Every page times every role, as one table."""

import pytest
from django.test import Client
from django.urls import reverse

from arena.site.urls import urlpatterns
from arena.studies.services.opening import close_study
from tests.web.addresses import STRANGER, address
from tests.web.cast import people, signed_in, status, world

pytestmark = pytest.mark.django_db

PAGES: dict[str, tuple[int, int, int]] = {
    # address: admin, analyst, expert
    "home": (200, 200, 200),
    "jobs": (200, 200, 403),
    "job-new": (200, 403, 403),
    "job": (200, 200, 403),
    "job-progress": (200, 200, 403),
    "metrics": (200, 401, 401),
    "job-export": (200, 200, 403),
    "transcripts-export": (200, 200, 403),
    "scenarios-export": (404, 404, 403),  # nothing was written yet
    "analyses": (200, 200, 403),
    "drives": (200, 200, 403),
    "drive": (200, 200, 403),
    "drive-file": (404, 404, 403),  # nothing was driven yet
    "faults": (200, 200, 403),
    "label": (403, 403, 404),
    "augmentation": (200, 200, 403),
    "transcript": (200, 200, 403),
    "asked-image": (404, 404, 403),
    "contestants": (200, 200, 403),
    "contestant-new": (200, 403, 403),
    "contestant": (200, 200, 403),
    "endpoints": (200, 200, 403),
    "endpoint-new": (200, 403, 403),
    "endpoint": (200, 200, 403),
    "endpoint-model": (200, 200, 403),
    "audit": (200, 403, 403),
    "audit-export": (200, 403, 403),
    "people": (200, 403, 403),
    "person-forget": (200, 403, 403),  # a question
    "password": (200, 200, 200),
    "scenes": (200, 200, 403),
    "scene": (200, 200, 403),
    "upload": (200, 200, 403),
    "api-tokens": (200, 200, 200),
    "scenarios": (200, 200, 403),
    "scenario": (200, 200, 403),
    "intent": (200, 200, 403),
    "scenario-new": (200, 200, 403),
    "intent-edit": (200, 200, 403),
    "scenario-edit": (200, 200, 403),
    "scenarios-bulk": (200, 200, 403),
    "prompts": (200, 200, 403),
    "prompt-image": (404, 404, 403),  # a modifier is shown none
    "reference-edit": (200, 200, 403),
    "correct": (200, 200, 403),
    "picture": (200, 200, 403),
    "studies": (200, 200, 403),
    "study-plan": (200, 200, 403),
    "import-votes": (200, 403, 403),
    "study-new": (200, 403, 403),
    "study-draft": (200, 403, 403),
    "study": (200, 200, 403),
    "preregistration": (200, 200, 403),
    "experts": (200, 403, 403),
    "enrolment": (200, 403, 403),
    "enrolment-voters": (404, 403, 403),  # no link was made
    "results": (200, 200, 403),  # a page that asks whether to look early
    "results-tab": (200, 200, 403),
    "results-votes": (403, 403, 403),
    "results-votes-file": (403, 403, 403),
    "results-vote": (403, 403, 403),
    "shown-picture": (403, 403, 403),
    "results-export": (403, 403, 403),
    "study-file": (404, 404, 403),  # nothing was written yet
    "vote": (403, 403, 404),
    "vote-practice": (403, 403, 404),
    "vote-skipped": (403, 403, 404),
    "matchup-image": (200, 403, 404),
    "replay": (404, 403, 404),  # the study plays no drives
}
ACTIONS: dict[str, tuple[int, int, int]] = {
    "job-retry": (302, 403, 403),
    "job-retry-cause": (302, 403, 403),
    "job-pause": (302, 403, 403),
    "contestant-retired": (302, 403, 403),
    "endpoint-model-new": (302, 403, 403),
    "endpoint-probe": (302, 403, 403),
    "catalogue-load": (302, 403, 403),
    "scene-send": (302, 302, 403),
    "edit-check": (422, 422, 403),
    "upload-show": (302, 302, 403),
    "upload-remove": (302, 404, 403),  # gone by then
    "moment-keep": (302, 302, 403),
    "job-simulate": (302, 403, 403),
    "scenarios-write": (302, 302, 403),
    "study-write": (302, 302, 403),
    "invite": (200, 403, 403),
    "person-link": (200, 403, 403),
    "person-change": (302, 403, 403),
    "api-token-revoke": (404, 404, 404),  # somebody else's
    "revoke": (302, 403, 403),
    "author": (302, 403, 403),
    "set-intent": (302, 302, 403),
    "scenario-retired": (302, 403, 403),
    "scenario-delete": (200, 403, 403),
    "scene-delete": (200, 403, 403),
    "intent-read": (302, 403, 403),
    "job-cancel": (200, 403, 403),
    "job-resume": (302, 403, 403),
    "study-rate": (403, 403, 403),
    "rating-again": (403, 403, 403),
    "results-open": (302, 302, 403),
    "checks-draw": (302, 403, 403),
    "study-close": (200, 403, 403),
    "study-cancel": (200, 403, 403),
    "study-again": (302, 403, 403),
    "study-draft-discard": (302, 403, 403),
    "study-hand-over": (302, 403, 403),
    "labelling-close": (404, 403, 403),
    "theme": (302, 302, 302),
    "language": (302, 302, 302),
}
OPEN_TO_THE_WORLD = {
    "login",
    "logout",
    "enrol",
    "invitation",
    "healthz",
    "readyz",
    "metrics",
    "first",
    "welcome",
}


def test_every_role_gets_what_the_table_says() -> None:
    here, accounts = world(), people()
    for name, expected in PAGES.items():
        url = address(name, here)
        found = tuple(status(user, url) for user in accounts.values())
        assert found == expected, name


def test_every_action_is_for_the_roles_of_the_table() -> None:
    here, accounts = world(), people()
    for name, expected in ACTIONS.items():
        url = address(name, here)
        found = tuple(signed_in(user).post(url).status_code for user in accounts.values())
        assert found == expected, name


ASKS_FIRST = {
    **{"scenario-delete": 200, "scene-delete": 200},
    **{"study-close": 200, "study-cancel": 200, "job-cancel": 200},
    "labelling-close": 404,
}
"""What a GET of them answers: a question, which changes nothing; here nobody labels."""


def test_an_action_needs_a_post() -> None:
    here, admin = world(), people()["admin"]
    for name in ACTIONS:
        answer = signed_in(admin).get(address(name, here))
        assert answer.status_code == ASKS_FIRST.get(name, 405), name


def test_the_login_alone_is_open_to_the_world() -> None:
    here = world()
    for name in {**PAGES, **ACTIONS}.keys() - {"job-progress", "metrics"}:
        answer = Client().get(address(name, here))
        assert answer.status_code == 302, name
        assert answer.headers["Location"].startswith(reverse("login")), name
    assert Client().get(address("job-progress", here)).status_code in (401, 403)
    assert Client().get(reverse("metrics")).status_code == 401
    assert Client().get(reverse("login")).status_code == 200


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
    assert signed_in(accounts["analyst"]).get(url).status_code == 200
    assert signed_in(here.expert).get(url).status_code == 200
    assert signed_in(accounts["expert"]).get(url).status_code == 403


@pytest.mark.parametrize("name", ["job", "augmentation", "scenario", "study", "results"])
def test_an_unknown_code_is_404_even_for_an_admin(name: str) -> None:
    url = reverse(name, kwargs={"code": STRANGER})
    assert signed_in(people()["admin"]).get(url).status_code == 404
