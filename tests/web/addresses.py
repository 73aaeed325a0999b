"""The address of every page, its parameters filled in from the cast."""

import uuid

from django.urls import reverse

from arena.people.links import invite
from arena.studies.services.drafts import keep_draft
from augment.models import Endpoint, EndpointModel, SceneUpload, Simulation, UploadMoment
from tests.web.cast import World

STRANGER = str(uuid.uuid4())


def address(name: str, here: World) -> str:
    shown = here.study.matchups.filter(expert=here.expert).get(position=1)
    arguments: dict[str, dict[str, object]] = {
        "person-link": {"code": here.expert.person.code},
        "person-change": {"code": here.expert.person.code},
        "person-forget": {"code": here.expert.person.code},
        "api-token-revoke": {"code": STRANGER},
        "job": {"code": here.job.code},
        "contestant": {"code": here.augmentation.contestant.code},
        "contestant-retired": {"code": here.augmentation.contestant.code},
        "job-progress": {"code": here.job.code},
        "job-retry": {"code": here.job.code},
        "job-retry-cause": {"code": here.job.code, "key": "0" * 16},
        "job-pause": {"code": here.job.code},
        "job-simulate": {"code": here.job.code},
        "drives": {"code": here.job.code},
        "job-cancel": {"code": here.job.code},
        "job-resume": {"code": here.job.code},
        "job-export": {"code": here.job.code, "name": "tool-calls", "form": "csv"},
        "transcripts-export": {"code": here.job.code},
        "scenarios-export": {"code": STRANGER},
        "scenarios-write": {"code": here.job.code, "form": "json"},
        "analyses": {"code": here.job.code},
        "faults": {"code": here.job.code},
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
        "prompt-image": {"code": here.augmentation.scenario.code, "number": 0},
        "edit-check": {"code": here.augmentation.scenario.code},
        "correct": {"code": here.augmentation.code},
        "intent": {"code": here.augmentation.scenario.code},
        "set-intent": {"code": here.augmentation.scenario.code},
        "intent-edit": {"code": here.augmentation.scenario.code},
        "scenario-retired": {"code": here.augmentation.scenario.code},
        "scenario-edit": {"code": here.augmentation.scenario.code},
        "scenario-delete": {"code": here.augmentation.scenario.code},
        "scene-delete": {"code": here.augmentation.scenario.base_scene.code},
        "intent-read": {"code": here.augmentation.scenario.code},
        "picture": {"kind": "augmentation", "code": shown.left.code},
        "results-export": {"code": here.study.code, "name": "votes", "form": "csv"},
        "study-file": {"code": here.study.code, "kind": "interplan"},
        "study-write": {"code": here.study.code, "kind": "interplan"},
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
    if name.startswith("study-draft"):
        arguments[name] = {"code": keep_draft(entered={"name": "Round 2"}).code}
    if name == "revoke":
        made = invite(study=here.study, expert=here.expert)
        arguments["revoke"] = {"code": made.invitation.code}
    own = (
        *("study", "preregistration", "experts", "invite", "author", "study-close"),
        *("study-cancel", "study-again"),
        *("study-hand-over", "study-rate", "enrolment", "enrolment-voters"),
    )
    results = ("results", "results-votes", "results-votes-file", "results-open")
    is_of_study = name in own + results or name.startswith("vote")
    found = {"code": here.study.code} if is_of_study else arguments.get(name, {})
    return reverse(name, kwargs=found)
