"""The pages on which references are drawn and augmentations corrected."""

import json

import pytest
from django.test import Client
from django.urls import reverse

from augment.models import Augmentation, Scenario
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from augment.services.running import runner
from augment.services.scenarios.pictures import draw_scenario, draw_scene
from tests.jobs.rows import add_scenario, launch
from tests.scenes import scene, vehicle
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db
CAR = json.dumps(modification_to_document(Modification(added=(vehicle("Added1", 20.0, 0.4),))))


@pytest.fixture
def researcher(monkeypatch: pytest.MonkeyPatch) -> Client:
    """Signed in; what is sent to a worker is done at once."""
    monkeypatch.setattr("arena.scenarios.pages.editor.enqueue_scene", draw_scene)
    monkeypatch.setattr("arena.scenarios.pages.editor.enqueue_scenario", draw_scenario)
    monkeypatch.setattr("arena.scenarios.pages.scenarios.enqueue_scenario", draw_scenario)
    monkeypatch.setattr("arena.scenarios.pages.editor.enqueue_job", run_job)
    monkeypatch.setattr("arena.shell.acts.transaction.on_commit", lambda done: done())
    return signed_in(people()["researcher"])


def run_job(job_pk: int) -> None:
    for row in Augmentation.objects.filter(job=job_pk):
        runner.AUGMENTATIONS.perform(row.pk)


def busy(slug: str = "street") -> Scenario:
    traffic = (vehicle("Agent2", 40.0, 3.5, 3.14),)
    return add_scenario(slug, scene=scene(agents=traffic), reference=None, keep_traffic=True)


def test_a_drawn_reference_is_kept_and_shown(researcher: Client) -> None:
    here = busy()
    url = reverse("scenario-edit", args=[here.code])
    wanted = {"type": here.type, "instruction": here.instruction, "keep_traffic": "on"}
    given = wanted | {"modification": CAR, "derives": "on", "density": "none"}
    shown = researcher.post(url, given, follow=True).content.decode()
    assert "is changed" in shown
    assert reverse("picture", args=["reference", here.code]) in shown
    here.refresh_from_db()
    assert here.reference is not None
    assert here.reference["add"][0]["lane_id"] == "Lane1"
    assert here.intent_origin == "derived"
    asked = {"modification": json.loads(CAR), "derives": True, "keep_traffic": True}
    check = reverse("edit-check", args=[here.base_scene.code])
    found = researcher.post(check, asked, content_type="application/json").json()
    assert "20.0 m ahead of the ego" in found["sentence"]
    assert "vehicle: in the own lane" in found["statements"]


def test_an_augmentation_is_corrected_and_both_say_so(researcher: Client) -> None:
    row = launch().augmentations.get()
    runner.AUGMENTATIONS.perform(row.pk)
    draw_scene(row.scenario.base_scene_id)
    url = reverse("correct", args=[row.code])
    page = reverse("augmentation", args=[row.code])
    assert url in researcher.get(page).content.decode()
    assert "&quot;add&quot;" in researcher.get(url).content.decode()
    refused = researcher.post(url, {"modification": CAR, "contestant": row.contestant.slug})
    assert refused.status_code == 422
    shown = researcher.post(
        url, {"modification": CAR, "contestant": "Zoë 王", "notes": "too far left"}, follow=True
    ).content.decode()
    made = Augmentation.objects.get(corrects=row)
    assert (made.state, made.contestant.kind, made.notes) == ("done", "human", "too far left")
    assert (made.contestant.slug, made.contestant.name) == ("zoe", "Zoë 王")
    assert "Corrected by hand by the-researcher" in shown
    assert page in shown
    picture = researcher.get(reverse("picture", args=["augmentation", made.code]))
    assert b"".join(picture).startswith(b"\x89PNG")
    assert reverse("augmentation", args=[made.code]) in researcher.get(page).content.decode()
