"""The pages of fault labels."""

import pytest
from django.contrib.auth.models import User
from django.urls import reverse

from arena.jobs.services import open_labelling
from arena.models import FaultLabel, LabellingRound
from augment.models import Augmentation, GenerationJob, Scenario
from augment.services.scenarios.pictures import store
from tests.exports.test_displacement import a_job
from tests.study_rows import expert
from tests.web.cast import people, png, signed_in

pytestmark = pytest.mark.django_db


@pytest.fixture
def job() -> GenerationJob:
    job = a_job()
    Scenario.objects.update(original_image=store(png(5)))
    return job


@pytest.fixture
def eva() -> User:
    return expert("eva")


@pytest.fixture
def labelling(job: GenerationJob, eva: User) -> LabellingRound:
    return open_labelling(name="Faults", job=job, experts=["eva"], seed=1)


def test_an_expert_labels_by_a_press_and_learns_the_guess_only_afterwards(
    labelling: LabellingRound, eva: User
) -> None:
    client, url = signed_in(eva), reverse("label", args=[labelling.code])
    page = client.get(url).content.decode()
    assert "automatic checks" not in page
    assert "Place a traffic cone" in page
    task = labelling.tasks.get(position=1)
    answer = client.post(url, {"task": task.code, "position": "on", "note": "far off"})
    assert answer.headers["Location"] == url
    label = FaultLabel.objects.get()
    assert (label.position, label.heading, label.logic, label.note) == (
        True,
        False,
        False,
        "far off",
    )
    assert "The automatic checks had guessed:" in client.get(url).content.decode()


def test_pictures_go_out_to_their_expert_alone(labelling: LabellingRound, eva: User) -> None:
    task, finn = labelling.tasks.get(position=1), expert("finn")
    for token in (task.token, task.original_token):
        url = reverse("matchup-image", args=[token])
        assert signed_in(eva).get(url).getvalue().startswith(b"\x89PNG")
        assert signed_in(finn).get(url).status_code == 404
    assert signed_in(finn).get(reverse("label", args=[labelling.code])).status_code == 404


def test_the_scene_before_stays_out_where_it_shows_another_window(
    labelling: LabellingRound, eva: User
) -> None:
    page, task = reverse("label", args=[labelling.code]), labelling.tasks.get(position=1)
    url = reverse("matchup-image", args=[task.original_token])
    assert task.original_token in signed_in(eva).get(page).content.decode()
    Scenario.objects.update(original_image=store(png(6), folder="bev/1-new"))
    assert task.original_token not in signed_in(eva).get(page).content.decode()
    assert signed_in(eva).get(url).status_code == 404
    Augmentation.objects.filter(pk=task.augmentation_id).update(
        image=store(png(7), folder="bev/1-new")
    )
    assert signed_in(eva).get(url).getvalue().startswith(b"\x89PNG")


def test_an_admin_opens_a_labelling_that_staff_read(job: GenerationJob, eva: User) -> None:
    accounts, url = people(), reverse("faults", args=[job.code])
    sent = {"name": "Faults", "experts": ["eva"], "seed": "1"}
    assert signed_in(accounts["researcher"]).post(url, sent).status_code == 403
    admin = signed_in(accounts["admin"])
    assert admin.post(url, {**sent, "experts": []}).status_code == 422
    assert "is open" in admin.post(url, {**sent, "sure": "1"}, follow=True).content.decode()
    again = admin.post(url, sent)
    assert (again.status_code, "already" in again.content.decode()) == (422, True)
    labelling = LabellingRound.objects.get()
    signed_in(eva).post(
        reverse("label", args=[labelling.code]), {"task": labelling.tasks.all()[0].code}
    )
    shown = signed_in(accounts["researcher"]).get(url).content.decode()
    assert "Cohen’s kappa" in shown
    assert "1 of 2" in shown
    table = signed_in(accounts["researcher"]).get(
        reverse("job-export", args=[job.code, "faults", "csv"])
    )
    assert table.content.startswith(b"contestant,slug")
