"""Every page times every role, as one table."""

from __future__ import annotations

import uuid

import pytest
from django.test import Client
from django.urls import reverse

from arena.services.authorships import mark_author
from arena.services.invitations import invite
from arena.services.reports import Complaint, report
from arena.services.studies import close_study
from arena.web.urls import urlpatterns
from augment.models import Endpoint, EndpointModel, SceneUpload, Simulation, UploadMoment
from tests.web.cast import World, people, signed_in, status, world

pytestmark = pytest.mark.django_db

STRANGER = str(uuid.uuid4())
PAGES: dict[str, tuple[int, int, int]] = {
    # address: admin, analyst, expert
    "home": (200, 200, 200),
    "jobs": (200, 200, 403),
    "job-new": (200, 403, 403),
    "job": (200, 200, 403),
    "job-progress": (200, 200, 403),
    "metrics": (200, 401, 401),
    "displacement-export": (200, 200, 403),
    "tool-calls-export": (200, 200, 403),
    "transcripts-export": (200, 200, 403),
    "scenarios-export": (404, 404, 403),  # nothing was written yet
    "analyses": (200, 200, 403),
    "analyses-export": (200, 200, 403),
    "drives": (200, 200, 403),
    "driving-export": (200, 200, 403),
    "drive": (200, 200, 403),
    "drive-file": (404, 404, 403),  # nothing was driven yet
    "faults": (200, 200, 403),
    "faults-export": (200, 200, 403),
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
    "webhooks": (200, 403, 403),
    "webhook": (404, 403, 403),  # there is none
    "webhook-forget": (404, 403, 403),
    "scenarios": (200, 200, 403),
    "scenario": (200, 200, 403),
    "intent": (200, 200, 403),
    "scenario-new": (200, 200, 403),
    "scenarios-bulk": (200, 200, 403),
    "prompts": (200, 200, 403),
    "prompt-file": (200, 200, 403),
    "prompt-image": (404, 404, 403),  # a modifier is shown none
    "reference-edit": (200, 200, 403),
    "correct": (200, 200, 403),
    "picture": (200, 200, 403),
    "studies": (200, 200, 403),
    "study-plan": (200, 200, 403),
    "import-votes": (200, 403, 403),
    "study-new": (200, 403, 403),
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
    "results-disagreement": (403, 403, 403),
    "results-worst": (403, 403, 403),
    "results-sheet": (403, 403, 403),
    "results-sheet-file": (403, 403, 403),
    "shown-picture": (403, 403, 403),
    "results-votes-export": (403, 403, 403),
    "results-export": (403, 403, 403),
    "study-export": (403, 403, 403),
    "results-chart": (403, 403, 403),
    "vote": (403, 403, 404),
    "report": (200, 403, 403),
    "vote-practice": (403, 403, 404),
    "vote-help": (403, 403, 404),
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
    "reference-drop": (302, 302, 403),
    "edit-check": (422, 422, 403),
    "upload-show": (302, 302, 403),
    "upload-again": (302, 302, 403),
    "upload-remove": (302, 404, 403),  # gone by then
    "moment-keep": (302, 302, 403),
    "job-simulate": (302, 403, 403),
    "scenarios-write": (302, 302, 403),
    "invite": (200, 403, 403),
    "person-link": (200, 403, 403),
    "person-change": (302, 403, 403),
    "api-token-revoke": (404, 404, 404),  # somebody else's
    "webhook-change": (404, 403, 403),
    "webhook-repeat": (404, 403, 403),
    "revoke": (302, 403, 403),
    "author": (302, 403, 403),
    "author-back": (302, 403, 403),
    "set-intent": (302, 302, 403),
    "intent-read": (302, 403, 403),
    "job-cancel": (200, 403, 403),
    "job-resume": (302, 403, 403),
    "study-rate": (403, 403, 403),
    "rating-again": (403, 403, 403),
    "results-open": (302, 302, 403),
    "checks-draw": (302, 403, 403),
    "study-close": (200, 403, 403),
    "study-hand-over": (302, 403, 403),
    "labelling-close": (404, 403, 403),
    "enrolment-drop": (404, 403, 403),
    "theme": (302, 302, 302),
    "language": (302, 302, 302),
    "vote-report": (403, 403, 404),
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


def address(name: str, here: World) -> str:
    shown = here.study.matchups.filter(expert=here.expert).get(position=1)
    if name == "report":
        key, said = uuid.uuid4(), Complaint(reason="other")
        report(expert=here.expert, matchup_code=shown.code, key=key, said=said)
        return reverse(name, kwargs={"code": here.study.code, "key": key})
    arguments: dict[str, dict[str, object]] = {
        "person-link": {"code": here.expert.person.code},
        "person-change": {"code": here.expert.person.code},
        "person-forget": {"code": here.expert.person.code},
        "api-token-revoke": {"code": STRANGER},
        "webhook": {"code": STRANGER},
        "webhook-change": {"code": STRANGER},
        "webhook-forget": {"code": STRANGER},
        "webhook-repeat": {"code": STRANGER},
        "job": {"code": here.job.code},
        "contestant": {"code": here.augmentation.contestant.code},
        "contestant-retired": {"code": here.augmentation.contestant.code},
        "job-progress": {"code": here.job.code},
        "job-retry": {"code": here.job.code},
        "job-retry-cause": {"code": here.job.code, "key": "0" * 16},
        "job-pause": {"code": here.job.code},
        "job-simulate": {"code": here.job.code},
        "drives": {"code": here.job.code},
        "driving-export": {"code": here.job.code, "form": "csv"},
        "job-cancel": {"code": here.job.code},
        "job-resume": {"code": here.job.code},
        "displacement-export": {"code": here.job.code, "form": "csv"},
        "tool-calls-export": {"code": here.job.code, "form": "csv"},
        "transcripts-export": {"code": here.job.code},
        "scenarios-export": {"code": STRANGER},
        "scenarios-write": {"code": here.job.code, "form": "json"},
        "analyses": {"code": here.job.code},
        "analyses-export": {"code": here.job.code, "part": "pairs", "form": "csv"},
        "faults": {"code": here.job.code},
        "faults-export": {"code": here.job.code, "form": "csv"},
        "label": {"code": here.job.code},
        "labelling-close": {"code": here.job.code},
        "augmentation": {"code": here.augmentation.code},
        "transcript": {"code": here.augmentation.code},
        "asked-image": {"digest": "0" * 64},
        "scene": {"code": here.augmentation.scenario.base_scene.code},
        "scenario": {"code": here.augmentation.scenario.code},
        "reference-edit": {"code": here.augmentation.scenario.code},
        "scenario-new": {"code": here.augmentation.scenario.base_scene.code},
        "prompts": {"code": here.augmentation.scenario.code},
        "prompt-file": {"code": here.augmentation.scenario.code},
        "prompt-image": {"code": here.augmentation.scenario.code, "number": 0},
        "reference-drop": {"code": here.augmentation.scenario.code},
        "edit-check": {"code": here.augmentation.scenario.code},
        "correct": {"code": here.augmentation.code},
        "intent": {"code": here.augmentation.scenario.code},
        "set-intent": {"code": here.augmentation.scenario.code},
        "intent-read": {"code": here.augmentation.scenario.code},
        "picture": {"kind": "augmentation", "code": shown.left.code},
        "audit-export": {"form": "csv"},
        "results-export": {"code": here.study.code, "form": "csv"},
        "study-export": {"code": here.study.code},
        "results-chart": {"code": here.study.code, "name": "pairs", "form": "svg"},
        "results-votes-export": {"code": here.study.code, "form": "csv"},
        "results-vote": {"code": here.study.code, "vote": STRANGER},
        "shown-picture": {"code": here.study.code, "matchup": shown.code, "side": "left"},
        "results-tab": {"code": here.study.code, "tab": "pairs"},
        "rating-again": {"code": here.study.code, "rating": STRANGER},
        "matchup-image": {"token": shown.left_token},
        "replay": {"code": shown.code},
    }
    if name.startswith("endpoint") and name not in ("endpoints", "endpoint-new"):
        site, _ = Endpoint.objects.get_or_create(
            label="here", defaults={"base_url": "http://127.0.0.1:1/v1"}
        )
        model, _ = EndpointModel.objects.get_or_create(endpoint=site, model="m")
        is_of_site = name in ("endpoint", "endpoint-model-new")
        arguments[name] = {"code": site.code if is_of_site else model.code}
    if name in ("drive", "drive-file"):
        row, _ = Simulation.objects.get_or_create(
            scenario=here.augmentation.scenario,
            subject=Simulation.Subject.UNMODIFIED,
            planner="idm",
            offsets="paper",
        )
        form = {} if name == "drive" else {"form": "json"}
        arguments[name] = {"code": row.code, **form}
    if name.startswith(("upload", "moment-")):
        upload, _ = SceneUpload.objects.get_or_create(name="log.zip", size_bytes=1, state="failed")
        moment, _ = UploadMoment.objects.get_or_create(upload=upload)
        arguments[name] = {"code": moment.code if name == "moment-keep" else upload.code}
    if name == "revoke":
        made = invite(study=here.study, expert=here.expert)
        arguments["revoke"] = {"code": made.invitation.code}
    if name == "author-back":
        marked = mark_author(study=here.study, expert=here.expert, contestant="ann")
        arguments["author-back"] = {"code": marked.code}
    own = (
        *("study", "preregistration", "experts", "invite", "author", "study-close"),
        *("study-hand-over", "study-rate", "enrolment", "enrolment-voters", "enrolment-drop"),
    )
    results = (
        *("results", "results-votes", "results-votes-file", "results-open"),
        *("results-disagreement", "results-worst", "results-sheet", "results-sheet-file"),
    )
    is_of_study = name in own + results or name.startswith("vote")
    found = {"code": here.study.code} if is_of_study else arguments.get(name, {})
    return reverse(name, kwargs=found)


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


ASKS_FIRST = {"study-close": 200, "job-cancel": 200, "labelling-close": 404}
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
