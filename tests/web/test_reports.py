"""A report leads an admin to the pair as it was shown, its mark where the expert set it."""

import re
import uuid

import pytest
from django.urls import reverse

from arena.models import Report, Study
from arena.studies.services.experts import Complaint, report
from tests import study_rows
from tests.web.cast import World, people, signed_in, world

pytestmark = pytest.mark.django_db


def told(here: World, **said: object) -> Report:
    """What eva reports about her second pair."""
    matchup = study_rows.matchups_of(here.study, "eva")[1]
    given = Complaint(reason="picture_wrong", comment="The truck is cut off.", **said)  # type: ignore[arg-type]
    return report(expert=here.expert, matchup_code=matchup.code, key=uuid.uuid4(), said=given)


def address(row: Report) -> str:
    return reverse("report", args=[row.matchup.study.code, row.key])


def test_the_studys_page_names_side_and_mark_and_leads_an_admin_to_the_pair() -> None:
    here = world()
    row = told(here, side="right", mark=(0.25, 0.5))
    page = reverse("study", args=[here.study.code])
    cast = people()
    for_admin = signed_in(cast["admin"]).get(page).content.decode()
    assert "B, marked" in " ".join(re.sub(r"<[^>]+>", " ", for_admin).split())
    assert address(row) in for_admin
    assert address(row) not in signed_in(cast["analyst"]).get(page).content.decode()


def test_an_admin_who_votes_in_the_open_study_is_not_told_who_made_it() -> None:
    here = world()
    row = told(here)
    admin = people()["admin"]
    made = reverse("augmentation", args=[row.matchup.left.code])
    assert made in signed_in(admin).get(address(row)).content.decode()
    here.study.experts.add(admin)
    assert made not in signed_in(admin).get(address(row)).content.decode()


def test_a_report_of_another_study_is_not_found() -> None:
    here = world()
    row = told(here)
    other = Study.objects.create(name="Round 2", votes_per_expert=1, seed=1)
    url = reverse("report", args=[other.code, row.key])
    assert signed_in(people()["admin"]).get(url).status_code == 404
