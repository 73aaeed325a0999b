"""Displacement and findings on the pages of a job and of an augmentation."""

import re

import pytest
from django.urls import reverse
from django.utils.html import escape
from pytest_django import DjangoAssertNumQueries

from augment.models import Augmentation, GenerationJob
from augment.scene.codec import intent_to_document, modification_to_document
from augment.scene.entities import Modification
from augment.services.judging.analyses import count_unmeasured
from augment.services.judging.findings import check_augmentation
from augment.tasks import draw, measure
from tests.exports.test_displacement import a_job, add_moving
from tests.intents import parked
from tests.jobs import rows
from tests.scenes import vehicle
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def page(job: GenerationJob, query: str = "") -> str:
    measure(job.pk)
    shown = signed_in(people()["researcher"]).get(f"/jobs/{job.code}/displacement/{query}")
    text = re.sub(r"<[^>]+>", " ", shown.content.decode())
    return re.sub(r"\s+", " ", text)


def page_of(row: Augmentation, role: str = "researcher") -> str:
    return signed_in(people()[role]).get(reverse("augmentation", args=[row.code])).content.decode()


def crash() -> Augmentation:
    """A car that stands in the ego, where the reference has two cones."""
    job = GenerationJob.objects.create(name="Round 1")
    into_the_ego = Modification(added=(vehicle("Agent2", 1.0, 0.0),))
    return rows.add_answer(job, rows.add_scenario("one"), rows.add_kind("ann"), into_the_ego)


def test_a_jobs_page_shows_the_error_of_every_contestant_and_marks_the_simulated() -> None:
    shown = page(a_job())
    assert re.search(r"ann 0\.75 0\.75 \d, \d 2\.00 2\.00 to 2\.00 2\.00 2 2 0", shown)
    assert re.search(r"sim simulated – – [1-9], 0 – – – 0 4 0", shown)
    assert "All five scenario types." in shown


def test_what_is_not_measured_yet_is_left_to_a_worker_and_then_kept(
    django_assert_max_num_queries: DjangoAssertNumQueries, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = a_job()
    reader = signed_in(people()["researcher"])
    address = f"/jobs/{job.code}/displacement/"
    assert "A worker measures the results: 4 of 4 are left" in reader.get(address).content.decode()
    for name in ("displacement-by-type", "realism", "augmentations"):
        file = reader.get(f"/jobs/{job.code}/files/{name}.csv")
        assert (file.status_code, file["Location"]) == (302, address)
    measure(job.pk)
    with django_assert_max_num_queries(40):
        assert "A worker measures" not in reader.get(address).content.decode()
    draw("job", job.pk)
    monkeypatch.setattr("augment.metrics.paired.compare_all", None)  # no bootstrap, no drawing
    monkeypatch.setattr("arena.jobs.exports.displacement.write_figure", None)
    for path in (
        *("analyses/", "files/analyses-pairs.csv", "files/displacement-by-contestant.svg"),
        *("files/displacement-by-type.png", "files/displacement-by-variant.pdf"),
    ):
        assert reader.get(f"/jobs/{job.code}/{path}").status_code == 200, path
    scenario = job.augmentations.earliest("pk").scenario
    scenario.reference = modification_to_document(Modification(added=(vehicle("c", 9.0, 0.0),)))
    scenario.save()
    stale = job.augmentations.filter(scenario=scenario).count()
    assert count_unmeasured(job) == stale  # another reference: what it was held against is gone


def test_what_moves_has_columns_of_its_own() -> None:
    job, reader = a_job(), signed_in(people()["researcher"])

    def read(path: str) -> str:
        text = re.sub(r"<[^>]+>", " ", reader.get(path).content.decode())
        return re.sub(r"\s+", " ", text)

    measure(job.pk)
    assert "At t0 (m)" not in read(f"/jobs/{job.code}/displacement/")
    row = add_moving(job)
    measure(job.pk)
    shown = read(f"/jobs/{job.code}/displacement/")
    assert "Mean (m) At t0 (m) After 6 s (m) Starts apart (s) Matched" in shown
    assert "bea – – – 2.91 2.91 to 2.91 2.91 0.00 5.00 1.00 1 0 0" in shown
    assert re.search(r"ann 0\.75 .* 2\.00 2\.00 to 2\.00 2\.00 – – – 2 2 0", shown)
    found = read(reverse("augmentation", args=[row.code]))
    assert "and the 6 s after t0; at t0 0.00 m, after them 5.00 m" in found
    assert "The motion of Agent2 begins after 3.0 s" in found


def test_an_augmentations_page_says_what_is_wrong_with_it_and_how_far_it_is() -> None:
    shown = page_of(crash())
    assert "Agent2 and Agent1 overlap by" in shown
    assert "Nothing stands for what the instruction asks for; 1 missing; 1 more than" in shown
    assert "No object could be matched with the reference; 2 missing; 1 more" in shown
    assert "plain measurement" in shown


def test_a_row_that_cannot_be_read_says_so_instead_of_breaking_its_page() -> None:
    row = crash()
    Augmentation.objects.filter(pk=row.pk).update(modification={})
    shown = page_of(row)
    assert "The checks could not run." in shown
    assert "its stored modification can&#x27;t be read" in shown


FAR = intent_to_document(parked(40.0))


@pytest.fixture
def row() -> Augmentation:
    """Two cones where a parked car is asked for."""
    found = rows.only_row(rows.launch())
    rows.leased(found).settle(rows.done(), now=rows.NOON)
    found.scenario.intent = FAR
    found.scenario.save(update_fields=["intent"])
    return Augmentation.objects.select_related("contestant", "scenario__base_scene").get()


def test_the_page_names_everybody_in_a_picture_for_staff_alone(row: Augmentation) -> None:
    staff, url = people(), reverse("augmentation", args=[row.code])
    researcher = signed_in(staff["researcher"])
    page = researcher.get(url).content.decode()
    picture = reverse("picture", args=["labelled", row.code])
    assert picture in page
    found = check_augmentation(row)
    assert found is not None
    assert [line.kind for line in found.faults][:2] == ["asked_count", "asked_type"]
    assert all(escape(line.sentence()) in page for line in found.faults)
    assert researcher.get(picture).content[:4] == b"\x89PNG"
    assert signed_in(staff["expert"]).get(picture).status_code == 403
