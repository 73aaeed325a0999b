"""The address of every page, its parameters filled in from the cast."""

import uuid
from typing import Any

from django.urls import reverse

from arena.models import Authorship, Board
from arena.people.links import invite, mark_author
from arena.site.api_urls import urlpatterns as API
from arena.site.urls import urlpatterns
from arena.studies.services.drafts import keep_draft
from augment.models import (
    Benchmark,
    Endpoint,
    EndpointModel,
    Scenario,
    SceneUpload,
    Simulation,
    Submission,
    Sweep,
    UploadMoment,
)
from augment.services.benchmarks.benchmarks import BenchmarkRequest, make_benchmark
from tests.entering import entrant, read, sent
from tests.web.cast import World

STRANGER = str(uuid.uuid4())
ROUTES = {pattern.name: str(pattern.pattern) for pattern in (*API, *urlpatterns)}
FORMS = {"job-export": "tool-calls", "results-export": "votes", "first-step": "experts"}
"""What has a name is called."""


def address(name: str, here: World) -> str:
    shown = here.study.matchups.filter(expert=here.expert).get(position=1)
    route = ROUTES[name]
    given: dict[str, Any] = {
        "form": "json" if name == "scenarios-write" else "csv",
        "name": FORMS.get(name, ""),
        "kind": "augmentation" if name == "picture" else "interplan",
        "key": "0" * 16,
        "digest": "0" * 64,
        "number": 0,
        "vote": STRANGER,
        "rating": STRANGER,
        "judge": STRANGER,
        "matchup": shown.code,
        "side": "left",
        "tab": "grid" if name == "job-tab" else "pairs",
        "token": shown.left_token,
    }
    if "<uuid:code>" in route:
        given["code"] = code_of(route.partition("/")[0], here, name)
    return reverse(name, kwargs={part: given[part] for part in given if f":{part}>" in route})


def code_of(word: str, here: World, name: str = "") -> object:
    """Return the code of a row of the kind that an address begins with, of a page by its name."""
    row, scenario = here.augmentation, here.augmentation.scenario
    match word:
        case "studies" if name.startswith("study-draft"):
            return keep_draft(entered={"name": "Round 2"}).code
        case "endpoints" | "models":
            defaults = {"base_url": "http://127.0.0.1:1/v1"}
            site, _ = Endpoint.objects.get_or_create(label="here", defaults=defaults)
            model, _ = EndpointModel.objects.get_or_create(endpoint=site, model="m")
            return site.code if word == "endpoints" else model.code
        case "drives" | "sweeps":
            return _driven(word, scenario).code
        case "uploads" | "moments":
            upload, _ = SceneUpload.objects.get_or_create(
                name="log.zip", size_bytes=1, state="failed"
            )
            moment, _ = UploadMoment.objects.get_or_create(upload=upload)
            return upload.code if word == "uploads" else moment.code
        case "benchmarks" | "submissions":
            return _entered(word, scenario).code
        case "boards":
            board, _ = Board.objects.get_or_create(name="City")
            board.studies.add(here.study)
            return board.code
        case "invitations":
            return invite(study=here.study, expert=here.expert).invitation.code
        case "authorships":
            mark_author(study=here.study, expert=here.expert, contestant="ann")
            return Authorship.objects.get().code
        case "d":
            return here.study.matchups.filter(expert=here.expert).get(position=1).code
    rows: dict[str, Any] = {
        "people": here.expert.person,
        "jobs": here.job,
        "snapshots": here.study.snapshots.first(),
        "label": here.job,
        "studies": here.study,
        "contestants": row.contestant,
        "augmentations": row,
        "pictures": here.study.matchups.earliest("pk").left,
        "scenarios": scenario,
        "scenes": scenario.base_scene,
    }
    found = rows.get(word)
    return found.code if found else STRANGER


def _driven(word: str, scenario: Scenario) -> Simulation | Sweep:
    """Return a drive, or a sweep with a value that fits nowhere."""
    how: dict[str, Any] = {"scenario": scenario, "planner": "idm", "offsets": "paper"}
    if word == "drives":
        subject = Simulation.Subject.UNMODIFIED
        return Simulation.objects.get_or_create(subject=subject, **how)[0]
    sweep, _ = Sweep.objects.get_or_create(number="add[0].x_m", **how)
    sweep.values.get_or_create(value=20.0, defaults={"reason": "The lane ends."})
    return sweep


def _entered(word: str, scenario: Scenario) -> Benchmark | Submission:
    """Return a benchmark, or a submission that was read, to one that nobody retires."""
    known = Benchmark.objects.filter(slug=word).first()
    asked = BenchmarkRequest(slug=word, title="Set", scenarios=[scenario.slug])
    benchmark = known or make_benchmark(asked)
    if word == "benchmarks":
        return benchmark
    return Submission.objects.first() or read(sent(benchmark, entrant()))
