"""Displacement and findings on the pages of a job and of an augmentation."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from django.urls import reverse

from arena.exports.displacement_table import displacement_table
from arena.web.boxes import LEFT, RIGHT, box_sheet
from augment.models import Augmentation, GenerationJob
from augment.scene.codec import modification_to_document
from augment.scene.modification import Modification
from augment.services.judging.displacement import By
from augment.services.judging.findings import check_augmentation
from tests.exports.test_displacement import a_job
from tests.jobs import rows
from tests.scenes import vehicle
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def page(job: GenerationJob, query: str = "") -> str:
    shown = signed_in(people()["analyst"]).get(reverse("job", args=[job.code]) + query)
    text = re.sub(r"<[^>]+>", " ", shown.content.decode())
    return re.sub(r"\s+", " ", text)


def page_of(row: Augmentation, role: str = "analyst") -> str:
    return signed_in(people()[role]).get(reverse("augmentation", args=[row.code])).content.decode()


def crash() -> Augmentation:
    """A car that stands in the ego, where the reference has two cones."""
    job = GenerationJob.objects.create(name="Round 1")
    into_the_ego = Modification(added=(vehicle("Agent2", 1.0, 0.0),))
    return Augmentation.objects.create(
        job=job,
        scenario=rows.add_scenario("one"),
        contestant=rows.add_kind("ann"),
        state="done",
        modification=modification_to_document(into_the_ego),
        image="bev/x.png",
    )


def test_a_jobs_page_shows_the_error_of_every_contestant_and_marks_the_simulated() -> None:
    shown = page(a_job())
    assert "ann 2.00 2.00 to 2.00 2.00 2 2 0" in shown
    assert "sim simulated – – – 0 4 0" in shown
    assert "All five scenario types." in shown


def test_by_variant_it_says_which_types_are_left_out_and_where_the_papers_boxes_are_from() -> None:
    shown = page(a_job(), "?by=variant")
    assert "Read from the paper’s figure GPT-4o OTM 1.50 1.20 to 2.10" in shown
    assert "construction zone and accident site are left out" in shown


def test_by_variant_all_five_types_are_one_click_away_and_go_into_the_files() -> None:
    job = a_job()
    analyst = signed_in(people()["analyst"])
    shown = analyst.get(reverse("job", args=[job.code]) + "?by=variant&types=all")
    text = shown.content.decode()
    assert "Read from the paper" not in text
    assert "All five scenario types." in text
    assert "Only the three types of the paper" in text
    url = reverse("displacement-export", args=[job.code, "csv"])
    assert f"{url}?by=variant&amp;types=all" in text
    answer = analyst.get(url, {"by": "variant", "types": "all"})
    assert 'round-1-displacement-by-variant-all-types.csv"' in answer["Content-Disposition"]


def test_an_unknown_grouping_in_the_address_shows_contestants() -> None:
    assert "Displacement error by contestant" in page(a_job(), "?by=month")


def test_a_job_that_is_under_way_measures_nothing_yet() -> None:
    assert "Displacement error" not in page(rows.launch())


def test_a_job_without_any_measure_says_why() -> None:
    job = a_job()
    job.augmentations.update(state="failed")
    assert "Nothing can be measured: Augmentations not measured: 4 (waits" in page(job)


def test_the_files_of_the_page_are_grouped_as_the_page_is() -> None:
    job, analyst = a_job(), signed_in(people()["analyst"])
    url = reverse("displacement-export", args=[job.code, "csv"])
    answer = analyst.get(url + "?by=type")
    assert answer.content.startswith(b"group,contestant")
    assert b"Construction zone" in answer.content
    name = 'filename="round-1-displacement-by-type.csv"'
    assert name in answer.headers["Content-Disposition"]
    assert analyst.get(url.replace(".csv", ".gif")).status_code == 404


def test_all_boxes_stand_on_one_axis_and_what_is_farther_out_is_counted() -> None:
    table = displacement_table(a_job(aside_m=4.0), by=By.CONTESTANT)
    group = table.groups[0]
    assert group.summary.box is not None
    far = replace(group.summary.box, outliers_m=(1.0, 90.0))
    wide = replace(group, summary=replace(group.summary, box=far))
    sheet = box_sheet(replace(table, groups=(wide, table.groups[1])))
    assert sheet is not None
    assert sheet.end_m == 4.0
    ann, sim = sheet.parts[0].lines
    assert ann.drawn is not None
    assert (ann.drawn.median, ann.drawn.outliers, ann.drawn.beyond) == (
        RIGHT,
        (LEFT + (RIGHT - LEFT) / 4.0,),
        1,
    )
    assert (sim.drawn, sim.is_simulated) == (None, True)


def test_an_augmentations_page_says_what_is_wrong_with_it_and_how_far_it_is() -> None:
    shown = page_of(crash())
    assert "Agent2 and the ego overlap by" in shown
    assert "No object could be matched with the reference; 2 missing; 1 more" in shown
    assert "plain measurement" in shown


def test_an_expert_sees_no_findings() -> None:
    assert "overlap" not in page_of(crash(), "expert")


def test_the_worst_finding_comes_first() -> None:
    found = check_augmentation(crash())
    assert found is not None
    assert found.lines[0].severity == "wrong"
    assert found.lines[-1].severity == "fact"
    assert len(found.faults) + len(found.facts) == len(found.lines)


def test_a_row_that_cannot_be_read_says_so_instead_of_breaking_its_page() -> None:
    row = crash()
    Augmentation.objects.filter(pk=row.pk).update(modification={})
    shown = page_of(row)
    assert "The checks could not run." in shown
    assert "its stored modification can&#x27;t be read" in shown


def test_an_answer_without_a_modification_has_no_findings() -> None:
    row = crash()
    Augmentation.objects.filter(pk=row.pk).update(state="refused", modification=None)
    row.refresh_from_db()
    assert check_augmentation(row) is None
    assert "No object could be matched" in page_of(row)


def test_the_page_offers_one_row_an_object_and_its_files_open() -> None:
    job = a_job()
    analyst = signed_in(people()["analyst"])
    shown = analyst.get(reverse("job", args=[job.code])).content.decode()
    for form, kind in (("csv", "text/csv"), ("json", "application/json"), ("parquet", "parquet")):
        url = reverse("displacement-export", args=[job.code, form]) + "?by=object"
        assert url in shown
        answer = analyst.get(url)
        assert kind in answer["Content-Type"]
        assert f"displacement-objects.{form}" in answer["Content-Disposition"]
    missing = reverse("displacement-export", args=[job.code, "pdf"]) + "?by=object"
    assert analyst.get(missing).status_code == 404
