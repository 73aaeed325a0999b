"""What is sent three times at once, on any page and by any operation, is made once."""

import json
import re
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import timedelta
from typing import Any

import pytest
from django.apps import apps
from django.core.files.base import ContentFile
from django.core.files.uploadedfile import SimpleUploadedFile
from django.db import IntegrityError, connection
from django.test import Client, override_settings
from django.urls import reverse
from django.utils import timezone

from arena.models import ApiToken, Receipt, Study
from arena.results.services.ratings import rate_now
from arena.shell import receipts
from arena.site.api_urls import urlpatterns as OPERATIONS
from arena.site.urls import urlpatterns as PAGES
from arena.studies.services.opening import close_study
from arena.studies.services.taking_part import set_enrolment
from augment.models import (
    Augmentation,
    Benchmark,
    EndpointModel,
    GenerationJob,
    Scenario,
    SceneUpload,
)
from augment.services.benchmarks.benchmarks import BenchmarkRequest, make_benchmark
from augment.services.running import jobs
from augment.services.running.jobs import JobRequest
from augment.services.scenarios.uploads import UPLOADS, keep_upload
from tests import entering, study_rows
from tests.api.asking import error_of
from tests.api.test_resources import CAR, STREET
from tests.api.tokens import secret_of
from tests.board_rows import newcomer
from tests.jobs.models import Model, add_llama, ran
from tests.jobs.rows import add_scenario, only_row
from tests.opening import open_study
from tests.web.addresses import address
from tests.web.cast import World, people, world
from tests.web.test_enrolments import RULES
from tests.web.test_studies import FINE as VOTES

pytestmark = [pytest.mark.django_db(transaction=True), pytest.mark.slow, pytest.mark.timeout(900)]

SWEPT = {"number": "add[0].x_m", "low": 19, "high": 21, "count": 2, "planner": "idm"}
HERE = "http://127.0.0.1:1/v1"
UNTOLD = ("receipt", "event")
"""Rows that every act may add to."""

Body = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Cast:
    """A study that is closed and rated, and one that is open; what else requests are about.

    Attributes:
        answer: Can be changed further.
        ranged: A scenario whose intent has a range.
        streets: A benchmark.
        upload: A recording that was read.
    """

    here: World
    answer: Augmentation
    ranged: Scenario
    open_study: Study
    streets: Benchmark
    upload: SceneUpload

    def url(self, name: str) -> str:
        if name == "invite":
            return reverse(name, args=[self.open_study.code])
        if name == "enrol":
            return reverse(name, args=[self.open_study.enrolment.token])
        if name.endswith(("correct", "follow-up", "follow-ups")):
            return reverse(name, args=[self.answer.code])
        if name in ("faults", "job-simulate"):
            return reverse(name, args=[self.answer.job.code])
        if name in ("upload-show", "api-moments"):
            return reverse(name, args=[self.upload.code])
        if name == "results-share":
            rating = self.here.study.snapshots.get()
            return reverse(name, args=[self.here.study.code, rating.code])
        if "family" in name:
            return reverse(name, args=[self.ranged.code])
        return address(name, self.here)

    @staticmethod
    def study() -> Body:
        scenarios = [f"place-{number}" for number in range(6)]
        who = {"contestants": ["ann", "bob"], "experts": ["eva"], "scenarios": scenarios}
        return who | {"name": "Third", "votes_per_expert": 4}

    def job(self) -> Body:
        return {"name": "Twice", "contestants": ["llama"], "scenarios": ["far"]}

    def page_forms(self) -> dict[str, tuple[dict[str, int], Body]]:
        """By page: how many rows its form makes, and what is sent."""
        judge = str(EndpointModel.objects.get(model="llama3.1").code)
        tasks = {"scenarios": "place-*", "practice": "20", "seed": "1"}
        packed = entering.packed(**{"far": entering.ONE_CONE}).read()
        rows = b"scene,type,instruction,slug\nstreet,cut_in,Let a car cut in.,one\n"
        drawn = {"type": "jaywalking_pedestrian", "instruction": "Let somebody cross."}
        moved = json.dumps(entering.ONE_CONE)
        return {
            "author": ({"authorship": 1}, {"expert": "eva", "contestant": "ann"}),
            "benchmark-new": ({"benchmark": 1}, tasks | {"slug": "places", "title": "Places"}),
            "benchmark-write": ({"benchmarkfile": 1}, {}),
            "board-publish": ({"boardtable": 1}, {}),
            "board-batch": (
                {"study": 1},
                {"newcomers": ["dot"], "experts": ["eva"], "votes_per_expert": "4"},
            ),
            "contestant-new": (
                {"contestant": 1},
                {"model": "local|llama3.1", "variant": "fc", "slug": "newest"},
            ),
            "correct": ({"augmentation": 1, "generationjob": 1}, {"modification": moved}),
            "enrol": (
                {"enrolledvoter": 1, "user": 1},
                {
                    **{"external_id": "w-1", "agreed": "on"},
                    "agreed_sha256": self.open_study.enrolment.consent_sha256,
                },
            ),
            "endpoint-model-new": ({"endpointmodel": 1, "probe": 1}, {"model": "newest"}),
            "endpoint-probe": ({"probe": 1}, {}),
            "faults": ({"labellinground": 1}, {"name": "Faults", "experts": "eva", "seed": "1"}),
            "import-votes": ({"study": 1}, {"name": "Elsewhere", "file": ("votes.csv", VOTES)}),
            "invite": ({"invitation": 3}, {}),
            "job-simulate": ({"simulation": 3}, {}),
            "results-share": ({"sharedrating": 1}, {}),
            "scenarios-bulk": ({"scenario": 1}, {"file": ("rows.csv", rows)}),
            "scenarios-write": ({"scenariofile": 1}, {}),
            "scene": ({"scenario": 1}, drawn),
            "study-write": ({"studyfile": 1}, {}),
            "upload-show": ({"uploadmoment": 1}, {"stop": "0"}),
            "submission-new": (
                {"submission": 1},
                {"benchmark": str(self.streets.code), "file": ("ours.zip", packed)},
            ),
            "api-tokens": ({"apitoken": 1}, {"name": "Mine", "role": "admin", "days": "7"}),
            "boards": (
                {"board": 1},
                {"name": "Town", "study": str(self.here.study.code), "provisional_above": "50"},
            ),
            "endpoint-new": (
                {"endpoint": 1},
                {"label": "x", "base_url": HERE, "max_concurrency": 4},
            ),
            "family-draw": ({"scenario": 1}, {"count": "1", "seed": "3"}),
            "first-step": ({"person": 5}, {}),
            "follow-up": ({"generationjob": 1}, {"instruction": "Further.", "cap_calls": "2"}),
            "job-new": ({"generationjob": 1}, self.job() | {"cap_calls": "5"}),
            "judge-start": ({"judgerun": 1}, {"judge": judge, "sure": "1"}),
            "people": ({"user": 1}, {"username": "ada", "role": "expert"}),
            "scene-send": ({"sceneupload": 1}, {"file": ("street.json", STREET), "format": ""}),
            "study-again": ({"studydraft": 1}, {}),
            "study-new": ({"studydraft": 1}, {"name": "Round 3", "keep": "1"}),
            "study-rate": ({"snapshot": 1}, {}),
            "sweep-start": ({"sweep": 1}, SWEPT | {"offsets": "paper"}),
        }

    def api_bodies(self) -> dict[str, tuple[dict[str, int], Body]]:
        """By operation: how many rows it makes, and what is sent."""
        model = {"slug": "new", "variant": "otm", "endpoint": "local", "model": "llama3.1"}
        edit = {"scene": "street-1-scene", "instruction": "A car.", "reference": CAR}
        return {
            "api-contestants": ({"contestant": 1}, model),
            "api-endpoint-models": ({"endpointmodel": 1, "probe": 1}, {"model": "new"}),
            "api-endpoints": ({"endpoint": 1}, {"label": "far", "base_url": HERE}),
            "api-family": ({"scenario": 1}, {"count": 1, "seed": 5}),
            "api-follow-ups": ({"generationjob": 1}, {"instruction": "Nearer.", "cap_calls": 2}),
            "api-jobs": ({"generationjob": 1}, self.job()),
            "api-moments": ({"uploadmoment": 1}, {"item": "", "frame": 0}),
            "api-people": ({"user": 1}, {"username": "bob", "role": "expert"}),
            "api-probe": ({"probe": 1}, {}),
            "api-scenarios": ({"scenario": 1}, edit | {"type": "construction_zone"}),
            "api-studies": ({"study": 1}, self.study()),
            "api-submissions": (
                {"submission": 1},
                {
                    "benchmark": "streets",
                    "file": ("ours.zip", entering.packed(far=entering.EMPTY).read()),
                },
            ),
            "api-snapshots": ({"snapshot": 1}, {"rounds": 100}),
            "api-sweeps": ({"sweep": 1}, SWEPT),
            "api-uploads": ({"sceneupload": 1}, {"file": ("street.json", STREET)}),
        }


@pytest.fixture
def cast() -> Cast:
    here = world()
    for matchup in here.study.matchups.all():
        study_rows.vote(matchup, "left")
    add_llama(price="2")
    EndpointModel.objects.update(vision=True)
    ranged = add_scenario("far")
    assert ranged.intent is not None
    ranged.intent["requests"][0]["spot"]["distance"] = {"low_m": 20.0, "high_m": 40.0}
    ranged.save()
    asked = JobRequest(name="Far", contestants=["llama"], scenarios=["far"])
    answer = ran(only_row(jobs.launch(asked)), Model())
    rate_now(study=close_study(study=here.study), rounds=100)
    upload = keep_upload(name="street.json", content=ContentFile(STREET), source="")
    UPLOADS.perform(upload.pk)
    upload.moments.all().delete()  # reading asked for the first
    second = open_study(**Cast.study() | {"name": "Second", "experts": ["eva", "finn"]})
    set_enrolment(study=second, rules=RULES)
    newcomer("dot")
    return Cast(
        here=here,
        answer=answer,
        ranged=ranged,
        open_study=second,
        streets=make_benchmark(
            BenchmarkRequest(slug="streets", title="Streets", scenarios=["far"])
        ),
        upload=upload,
    )


def as_files(body: Body) -> Body:
    """The body, names with contents as files, which are read to their end once sent."""
    return {
        name: SimpleUploadedFile(*value) if isinstance(value, tuple) else value
        for name, value in body.items()
    }


def count_rows() -> Counter[str]:
    models = [apps.get_model("auth", "User"), *apps.get_app_config("arena").get_models()]
    models += apps.get_app_config("augment").get_models()
    numbers = {str(model._meta.model_name): model._default_manager.count() for model in models}
    return Counter({name: numbers[name] for name in numbers if name not in UNTOLD})


def send_thrice(send: Callable[[], Any]) -> tuple[list[Any], Counter[str]]:
    """Send at once, by three connections; returns the answers, and how many rows are new."""

    def send_apart(_: int) -> Any:
        try:
            return send()
        finally:
            connection.close()

    before = count_rows()
    with ThreadPoolExecutor(3) as pool:
        answers = list(pool.map(send_apart, range(3)))
    return answers, count_rows() - before


def check_growth(name: str, made: Counter[str], expected: dict[str, int], answers: Any) -> None:
    told = (
        name,
        made,
        answers[0].status_code,
        re.findall(r'errorlist"[^>]*>(?:<li>)?([^<]*)', answers[0].content.decode())
        or answers[0].content[-300:],
    )
    assert {kind: made[kind] for kind in expected} == expected, told
    assert expected or max(made.values(), default=0) <= 1, told


def test_every_form_counts_once(cast: Cast, admin: Client) -> None:
    forms = cast.page_forms()
    admin.raise_request_exception = False
    for number, pattern in enumerate(PAGES):
        name, url = pattern.name or "", cast.url(pattern.name or "")
        expected, body = forms.pop(name, ({}, {}))

        def send(
            url: str = url, body: Body = body, token: str = f"{number:064d}", name: str = name
        ) -> Any:
            client = Client(raise_request_exception=False)
            if name != "enrol":
                client.cookies = admin.cookies
            return client.post(url, as_files(body) | {"csrfmiddlewaretoken": token})

        if name not in ("logout", "edit-check"):  # which sends JSON and makes nothing
            answers, made = send_thrice(send)
            check_growth(name, made, expected, answers)
            assert name != "enrol" or {answer.status_code for answer in answers} == {302}
    assert not forms


def test_every_operation_counts_once(cast: Cast) -> None:
    bodies = cast.api_bodies()
    headers = {"Authorization": f"Bearer {secret_of(people()['admin'])}"}
    for pattern in OPERATIONS:
        if not hasattr(getattr(pattern.callback, "view_class", None), "post"):
            continue
        name, url = pattern.name or "", cast.url(pattern.name or "")
        expected, body = bodies.pop(name, ({}, {}))
        is_form = any(isinstance(value, tuple) for value in body.values())

        def send(
            url: str = url, body: Body = body, key: str = name, is_form: bool = is_form
        ) -> Any:
            client = Client(headers=headers | {"Idempotency-Key": key})
            if is_form:
                return client.post(url, as_files(body))
            return client.post(url, body, content_type="application/json")

        answers, made = send_thrice(send)
        check_growth(name, made, expected, answers)
        assert len({answer.content for answer in answers}) == 1, name
        assert not expected or {answer.status_code for answer in answers} <= {201, 202}, name
    assert not bodies


def test_a_form_sent_again_shows_what_it_made_and_can_be_sent_once_more(
    cast: Cast, admin: Client
) -> None:
    page = admin.get(reverse("job-new")).content.decode()
    token = re.search(r'name="csrfmiddlewaretoken" value="(\w+)"', page)
    form = cast.job() | {"csrfmiddlewaretoken": token and token[1]}
    first = admin.post(reverse("job-new"), form)
    shown = admin.post(reverse("job-new"), form).content.decode()
    assert "This was sent already" in shown
    assert f'href="{first["Location"]}"' in shown
    hidden = re.findall(r'type="hidden" name="(\w+)" value="([^"]*)"', shown)
    assert admin.post(reverse("job-new"), dict(hidden)).status_code == 302
    assert GenerationJob.objects.filter(name="Twice").count() == 2
    changed = form | {"name": "Another"}
    assert admin.post(reverse("job-new"), changed).status_code == 302, "it is another form"


def test_who_waits_while_the_first_is_refused_comes_next(monkeypatch: pytest.MonkeyPatch) -> None:
    refusals, ask = iter([IntegrityError("it is there")]), Receipt.objects.get_or_create

    def refuse_once(**columns: Any) -> Any:
        for refusal in refusals:
            raise refusal
        return ask(**columns)

    monkeypatch.setattr(Receipt.objects, "get_or_create", refuse_once)
    assert receipts.answer_once("key", "body", lambda: "made", lambda _: (201, b"")) == "made"


def test_a_key_is_kept_a_day_and_its_answer_sealed(cast: Cast) -> None:
    headers = {"Authorization": f"Bearer {secret_of(people()['admin'])}", "Idempotency-Key": "k"}
    client, person = Client(headers=headers), {"username": "bob", "role": "expert"}

    def send(path: str, body: Body) -> Any:
        return client.post(f"/api/v1/{path}", body, content_type="application/json")

    made = send("people", person)
    receipt = Receipt.objects.get()
    assert made.json()["link"].encode()[-20:] not in bytes(receipt.answer)
    assert send("people", person).content == made.content
    error_of(send("people", person | {"role": "admin"}), 422, "key_reused")
    error_of(send("jobs", cast.job()), 422, "key_reused")
    with override_settings(SECRET_KEY="another"):
        error_of(send("people", person), 422, "key_reused")
    Receipt.objects.update(received_at=timezone.now() - timedelta(hours=25))
    assert send("people", person).status_code != 201, "the name is taken"
    assert not Receipt.objects.exists(), "what made nothing may be sent again"


def test_a_request_that_is_still_under_way_is_not_carried_out_again(
    admin: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(receipts, "WAIT_S", 0.0)
    form = {"name": "Mine", "role": "admin", "days": "7", "csrfmiddlewaretoken": 64 * "a"}
    admin.post(reverse("api-tokens"), form)
    Receipt.objects.update(status=None)
    waiting = admin.post(reverse("api-tokens"), form)
    assert (waiting.status_code, ApiToken.objects.count()) == (409, 1)
    Receipt.objects.update(received_at=timezone.now() - timedelta(hours=1))
    assert admin.post(reverse("api-tokens"), form).status_code == 201, "its server died"
