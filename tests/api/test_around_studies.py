"""Around the votes: previews, handing over, labelling, an expert's own results, the log."""

from __future__ import annotations

import csv
import io
import json
from typing import Any

import pytest
from django.test import Client

from arena.models import FaultLabel, LabellingRound, Study
from arena.services.authorships import mark_author
from arena.services.ratings import plan_snapshot, rate
from arena.services.studies import close_study
from augment.models import Event, Scenario
from augment.services.scenarios.pictures import store
from tests.api.asking import error_of
from tests.api.tokens import program_of
from tests.exports.test_displacement import a_job
from tests.study_rows import a_study, cast_of, expert, matchups_of, vote
from tests.web.cast import people, png

pytestmark = pytest.mark.django_db

API = "/api/v1/"


def send(client: Client, path: str, **body: object) -> Any:
    return client.post(API + path, body, content_type="application/json")


# --- Before and while it is open ---------------------------------------------------------------


def test_a_preview_counts_what_opening_would_make_and_keeps_nothing() -> None:
    given = {**cast_of(), "name": "Round 1", "votes_per_expert": 8, "repeat_share": 0.25}
    admin = program_of(people()["admin"])
    found = send(admin, "studies/preview", **given).json()
    counted = {name: found[name] for name in ("experts", "contestants", "scenarios", "votes")}
    assert counted == {"experts": 2, "contestants": 3, "scenarios": 6, "votes": 16}
    assert (found["repeats"], found["minutes"]) == (4, 2)
    assert not Study.objects.exists()
    assert not Event.objects.filter(verb="open").exists()
    wrong = send(admin, "studies/preview", **(given | {"contestants": ["nobody"]}))
    assert "nobody" in error_of(wrong, 400, "refused")["message"]


def test_unjudged_pairs_go_to_somebody_else() -> None:
    study = a_study()
    vote(matchups_of(study, "eva")[0])
    admin = program_of(people()["admin"])
    path = f"studies/{study.code}/hand-over"
    error_of(send(admin, path, giver="eva", takers=["eva"]), 409, "conflict")
    taken = send(admin, path, giver="eva", takers=["finn"]).json()["taken"]
    assert taken == {"finn": 8}
    lines = admin.get(f"{API}studies/{study.code}/progress").json()["experts"]
    assert {line["expert"]: line["left"] for line in lines} == {"eva": 0, "finn": 17}


def test_the_frozen_file_is_that_of_the_page() -> None:
    study, analyst = a_study(), program_of(people()["analyst"])
    answer = analyst.get(f"{API}studies/{study.code}/preregistration")
    assert answer.content == study.preregistration.encode()
    assert json.loads(answer.content)["format"] == "scenario-arena/preregistration"


def test_a_draft_is_kept_changed_and_opened() -> None:
    chosen = cast_of()
    accounts = people()
    admin, analyst = program_of(accounts["admin"]), program_of(accounts["analyst"])
    draft = send(admin, "study-drafts", entered={"name": "Round 1", "repeats": "5"}).json()
    assert (draft["revision"], draft["entered"]["repeats"], draft["missing"]) == (1, "5", [])
    here = f"study-drafts/{draft['code']}"
    entered = {"name": "Round 1", "contestants": ["ann", "zoe"]}
    changed = send(admin, here, entered=entered, revision=1).json()
    assert [line["name"] for line in changed["missing"]] == ["zoe"]
    error_of(send(admin, here, entered={}, revision=1), 409, "conflict")
    error_of(send(admin, here, entered={"colour": "red"}, revision=2), 400, "refused")
    assert [line["name"] for line in analyst.get(API + "study-drafts").json()["results"]] == [
        "Round 1"
    ]
    error_of(analyst.get(API + here), 403, "forbidden")
    rules = {**chosen, "name": "Round 1", "votes_per_expert": 6}
    error_of(send(admin, here + "/open", **rules, revision=1), 409, "conflict")
    study = send(admin, here + "/open", **rules, revision=2)
    assert (study.status_code, study.json()["state"]) == (201, "open")
    error_of(admin.get(API + here), 404, "not_found")
    like = send(admin, f"studies/{study.json()['code']}/draft").json()
    assert (like["name"], like["entered"]["votes_per_expert"]) == ("Round 1 (2)", "6")
    assert send(admin, f"study-drafts/{like['code']}/discard").json()["name"] == "Round 1 (2)"
    assert admin.get(API + "study-drafts").json()["results"] == []


def test_a_cancelled_study_has_no_results() -> None:
    study, admin = a_study(), program_of(people()["admin"])
    answer = send(admin, f"studies/{study.code}/cancel", why="A wrong scene.")
    assert answer.json()["state"] == "cancelled"
    after = Event.objects.get(verb="cancel").after
    assert after is not None
    assert after["why"] == "A wrong scene."
    error_of(send(admin, f"studies/{study.code}/close"), 410, "study_not_open")
    error_of(admin.get(f"{API}studies/{study.code}/snapshots"), 404, "not_found")


# --- What an expert reads ----------------------------------------------------------------------


def test_an_expert_reads_the_results_of_a_closed_study_and_nothing_of_authors() -> None:
    study = a_study()
    mark_author(study=study, expert=study.experts.get(username="eva"), contestant="ann")
    for matchup in [*matchups_of(study, "eva"), *matchups_of(study, "finn")]:
        vote(matchup)
    finn = program_of(study.experts.get(username="finn"))
    path = f"studies/{study.code}/snapshots"
    early = rate(study=study, rounds=20, early=True)
    for address in (path, f"snapshots/{early.code}"):
        error_of(finn.get(API + address), 404, "not_found")
    study = close_study(study=study)
    rated = rate(study=study, rounds=20)
    waiting = plan_snapshot(study=study, rounds=20)
    listed = finn.get(API + path).json()["results"]
    assert [line["code"] for line in listed] == [str(rated.code), str(early.code)]
    assert all(set(line["filters"]) == {"types", "kinds", "leave_out_settled"} for line in listed)
    shown = finn.get(f"{API}snapshots/{rated.code}")
    assert {row["slug"] for row in shown.json()["table"]["rows"]} == {"ann", "bob", "cid"}
    assert b"author" not in shown.content
    error_of(finn.get(f"{API}snapshots/{waiting.code}"), 404, "not_found")
    error_of(send(finn, path), 403, "forbidden")
    error_of(finn.get(f"{API}snapshots/{rated.code}/exports/leaderboard.csv"), 403, "forbidden")
    error_of(program_of(expert("zoe")).get(API + path), 404, "not_found")
    staff = program_of(people()["analyst"]).get(f"{API}snapshots/{rated.code}").json()
    assert staff["filters"]["authors"], "staff read who was author"


# --- Labelling ---------------------------------------------------------------------------------


def test_faults_are_labelled_by_the_wire() -> None:
    job, eva = a_job(), expert("eva")
    Scenario.objects.update(original_image=store(png(5)))
    admin, asking = program_of(people()["admin"]), program_of(eva)
    given = {"job": str(job.code), "name": "Faults", "experts": ["eva"]}
    error_of(send(asking, "labellings", **given), 403, "forbidden")
    made = send(admin, "labellings", **given)
    assert (made.status_code, made.json()["planned"], made.json()["left"]) == (201, 2, 2)
    here = f"labellings/{made.json()['code']}"
    task = asking.get(f"{API}{here}/next").json()["next"]
    assert (task["position"], task["instruction"]) == (1, Scenario.objects.first().instruction)  # type: ignore[union-attr]
    for side in ("picture", "original"):
        token = task[side].rpartition("/")[2]
        assert asking.get(f"{API}pictures/{token}").content.startswith(b"\x89PNG")
    wrong = send(asking, "labels", task=task["task"], faults=["colour"])
    assert list(error_of(wrong, 422, "invalid")["fields"]) == ["faults"]
    saved = send(asking, "labels", task=task["task"], faults=["position"], note="far off")
    assert saved.json()["saved"] is True
    assert send(asking, "labels", task=task["task"], faults=["position"]).status_code == 200
    another = send(asking, "labels", task=task["task"], faults=[])
    error_of(another, 409, "already_labelled")
    label = FaultLabel.objects.get()
    assert (label.position, label.heading, label.note) == (True, False, "far off")
    (line,) = asking.get(API + "labellings").json()["results"]
    assert (line["labelled"], line["left"]) == (1, 1)
    task = asking.get(f"{API}{here}/next").json()["next"]
    assert send(admin, here + "/close").json()["left"] == 0
    error_of(send(admin, here + "/close"), 410, "labelling_closed")
    error_of(send(asking, "labels", task=task["task"], faults=[]), 410, "labelling_closed")
    assert asking.get(f"{API}{here}/next").json() == {"next": None}


def test_a_labelling_is_its_own_experts_alone() -> None:
    job, eva, finn = a_job(), expert("eva"), expert("finn")
    admin = program_of(people()["admin"])
    send(admin, "labellings", job=str(job.code), name="Faults", experts=["eva"])
    other = program_of(finn)
    assert other.get(API + "labellings").json()["results"] == []
    error_of(
        other.get(f"{API}labellings/{LabellingRound.objects.get().code}/next"), 404, "not_found"
    )
    task = eva.label_tasks.all()[0]
    error_of(send(other, "labels", task=str(task.code), faults=[]), 404, "not_found")
    (line,) = admin.get(API + "labellings").json()["results"]
    assert line["planned"] == 2


# --- The log -----------------------------------------------------------------------------------


def test_the_log_is_paged_and_what_is_done_meanwhile_moves_no_page() -> None:
    study = a_study()
    accounts = people()
    admin = program_of(accounts["admin"])
    everything = Event.objects.count()
    assert everything > 3
    first = admin.get(API + "audit", {"limit": 2}).json()
    close_study(study=study, actor=accounts["admin"])
    read, page = list(first["results"]), first
    while page["next"]:
        page = admin.get(page["next"]).json()
        read += page["results"]
    keys = [(act["at"], act["verb"], act["object_code"]) for act in read]
    assert (len(keys), len(set(keys))) == (everything, everything)
    asked = {"verb": "close", "object": "Round 1", "actor": str(accounts["admin"].person.code)}
    (act,) = admin.get(API + "audit", asked).json()["results"]
    assert (act["actor"], act["before"]) == (accounts["admin"].person.pseudonym, {"state": "open"})
    machine = admin.get(API + "audit", {"actor": "machine"}).json()["results"]
    assert {act["actor"] for act in machine} == {None}
    wrong = admin.get(API + "audit", {"actor": "ada"})
    assert list(error_of(wrong, 422, "invalid")["fields"]) == ["actor"]
    text = admin.get(API + "audit.csv", {"verb": "close"}).getvalue().decode()
    (row,) = csv.DictReader(io.StringIO(text))
    assert row["object_code"] == str(study.code)
    error_of(admin.get(API + "audit.docx"), 404, "not_found")
    for path in ("audit", "audit.csv"):
        error_of(program_of(accounts["analyst"]).get(API + path), 403, "forbidden")
