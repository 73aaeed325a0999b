"""A new job by its page: the matrix, the estimate, one try first."""

import re
from typing import Any

import pytest
from django.test import Client
from django.urls import reverse

from augment.models import Contestant, Endpoint, EndpointModel, GenerationJob
from augment.services.running import jobs
from augment.services.running.entering import AcceptRequest, accept_submission
from augment.services.running.jobs import JobRequest
from tests.entering import a_benchmark, entrant, read, sent
from tests.jobs import rows
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db
ACCEPTED = AcceptRequest(slug="theirs", name="Theirs", runs=False)
OTM, VQA, FC = "otm|here|seer", "vqa|here|seer", "fc|here|seer"


@pytest.fixture
def admin() -> Client:
    return signed_in(people()["admin"])


@pytest.fixture
def models() -> Endpoint:
    site = Endpoint.objects.create(label="here", base_url="http://127.0.0.1:9/v1")
    EndpointModel.objects.create(endpoint=site, model="seer", vision=True)
    EndpointModel.objects.create(endpoint=site, model="blind", vision=False)
    EndpointModel.objects.create(endpoint=site, model="unknown")
    for slug in ("one", "two"):
        rows.add_scenario(slug)
    return site


def send(admin: Client, **given: Any) -> str:
    sent = {"name": "Round 2", "scenarios": ["one", "two"], **given}
    return admin.post(reverse("job-new"), sent, follow=True).content.decode()


def test_impossible_cells_are_disabled_and_say_why_in_the_text(
    admin: Client, models: Endpoint
) -> None:
    shown = admin.get(reverse("job-new")).content.decode()
    boxes = dict(re.findall(r'name="cells" value="([^"]+)"( disabled)?', shown))
    assert {key for key, off in boxes.items() if off} == {
        f"{variant}|here|{model}"
        for variant in ("vqa", "fc+vqa", "fc-plus+vqa")
        for model in ("blind", "unknown")
    }
    assert shown.count("needs vision, and it sees text alone") == 3
    assert shown.count("nobody knows whether it sees pictures: probe it") == 3
    assert "is not one of the available choices" in send(admin, cells=["vqa|here|blind"])
    assert not GenerationJob.objects.exists()


def test_whoever_can_not_run_on_every_scenario_is_not_ticked_at_first(
    admin: Client, models: Endpoint
) -> None:
    """A scenario that is only a sentence has no reference, a submission answers its own alone."""
    for slug, kind in (("reference", "reference"), ("rule-placer", "rule")):
        rows.add_kind(slug, kind)

    def ticked() -> list[str]:
        shown = admin.get(reverse("job-new")).content.decode()
        return re.findall(r'name="contestants"\s+value="([^"]+)" checked', shown)

    assert ticked() == ["reference", "rule-placer"]
    rows.add_scenario("sentence", reference=None)
    assert ticked() == ["rule-placer"]
    enno = entrant()
    accept_submission(read(sent(a_benchmark(), enno)), ACCEPTED, actor=enno)
    assert ticked() == ["rule-placer"]


def test_a_cell_becomes_its_contestant_once_and_other_options_another(
    admin: Client, models: Endpoint
) -> None:
    send(admin, cells=[OTM, FC])
    send(admin, cells=[OTM])
    assert Contestant.objects.filter(endpoint=models).count() == 2
    send(admin, cells=[OTM], temperature="0.7", rounds="2", protocol="native")
    warm = Contestant.objects.get(endpoint=models, options={"temperature": 0.7})
    assert (warm.variant, warm.kind) == ("otm", "llm"), "otm has no use for rounds or a protocol"
    first, second, third = GenerationJob.objects.order_by("pk")
    assert first.augmentations.count() == 4
    assert set(second.contestants.all()) < set(first.contestants.all())
    assert list(third.contestants.all()) == [warm]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, "Choose at least one contestant."),
        ({"cells": ["otm|here"]}, "is not one of the available choices"),
        ({"cells": [OTM], "temperature": "3"}, "less than or equal to 2"),
        ({"cells": [OTM], "scenarios": []}, "Choose at least one scenario."),
    ],
)
def test_what_can_not_be_launched_is_said_and_nothing_is_made(
    admin: Client, models: Endpoint, given: dict[str, object], words: str
) -> None:
    assert words in send(admin, **given)
    assert not GenerationJob.objects.exists()
    assert not Contestant.objects.filter(endpoint=models).exists()


def test_one_scenario_is_tried_first_and_the_rest_is_remembered(
    admin: Client, models: Endpoint
) -> None:
    shown = send(admin, cells=[OTM, VQA], samples="3", cap_usd="", cap_calls="500", **{"try": "1"})
    job = GenerationJob.objects.get()
    assert (job.name, job.samples, job.cap_calls) == ("Round 2, first try", 1, 500)
    assert job.augmentations.count() == 2, "one scenario, two contestants, one sample"
    assert "Launch all of it" in shown
    address = f"{reverse('job-new')}?like={job.code}&amp;all=1"
    assert f'href="{address}"' in shown
    form = admin.get(address.replace("&amp;", "&")).content.decode()
    assert 'value="Round 2"' in form
    ticked = re.findall(r'name="(contestants|scenarios)" value="([^"]+)" checked', form)
    slugs = set(job.contestants.values_list("slug", flat=True))
    assert {value for name, value in ticked if name == "contestants"} == slugs
    assert {value for name, value in ticked if name == "scenarios"} == {"one", "two"}
    assert 'type="number" name="samples" value="3"' in form
    assert 'type="number" name="cap_calls" value="500"' in form


def test_a_duplicate_fills_the_form_with_what_the_job_had(admin: Client, models: Endpoint) -> None:
    rows.add_kind("reference")
    job = jobs.launch(
        JobRequest(
            name="Old",
            contestants=["reference"],
            scenarios=["two"],
            cap_tokens=7,
            samples=2,
            is_fresh=True,
        )
    )
    form = admin.get(f"{reverse('job-new')}?like={job.code}").content.decode()
    for part in (
        'value="Old (2)"',
        'name="contestants" value="reference" checked',
        'name="scenarios" value="two" checked',
        'type="number" name="cap_tokens" value="7"',
        'name="is_fresh" value="on" checked',
    ):
        assert part in form
    assert 'name="scenarios" value="one" checked' not in form
    for nobody in ("no-code", "00000000-0000-0000-0000-000000000000"):
        assert admin.get(f"{reverse('job-new')}?like={nobody}").status_code == 200
