"""Simulated errors in a job: seeded, labelled, and the label is nobody's but the analyst's."""

from __future__ import annotations

from pathlib import Path

import pytest
from django.conf import LazySettings
from django.urls import reverse

from augment.baselines.simulated import Rates
from augment.models import Augmentation
from augment.services.endpoints import contestants
from augment.services.running import jobs, runner
from tests.jobs import rows
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


@pytest.fixture(autouse=True)
def _media(settings: LazySettings, tmp_path: Path) -> None:
    settings.MEDIA_ROOT = tmp_path


def ran(rates: Rates) -> Augmentation:
    contestants.add_simulated(slug="sim", rates=rates)
    row = rows.only_row(rows.launch(contestants=("sim",)))
    assert runner.work_on(augmentation_pk=row.pk)
    row.refresh_from_db()
    return row


def test_a_wrong_answer_carries_its_true_label() -> None:
    row = ran(Rates(position=1.0))
    assert row.state == "done"
    assert row.injected is not None
    assert row.injected["class"] == "position"
    assert row.injected["fault"]
    analyst = signed_in(people()["analyst"])
    page = analyst.get(reverse("augmentation", args=[row.code])).content.decode()
    assert f"Wrong on purpose: position, {row.injected['fault']}." in page
    record = analyst.get(reverse("transcript", args=[row.code])).json()
    assert record["augmentation"]["injected"] == row.injected


def test_the_same_contestant_answers_the_same_in_every_job() -> None:
    first = ran(Rates(logic=1.0))
    again = jobs.launch(name="Again", contestants=["sim"], scenarios=["street-1"])
    row = rows.only_row(again)
    runner.work_on(augmentation_pk=row.pk)
    row.refresh_from_db()
    assert (row.modification, row.injected) == (first.modification, first.injected)
