"""What the votes of a new study will tell, on its form."""

from dataclasses import replace

import pytest
from django.urls import reverse

from arena.studies.services.outlook import StudyEstimate, prospect
from arena.studies.services.plan import PRESETS
from tests import study_rows
from tests.web.cast import people, signed_in
from tests.web.test_questions import text_of

pytestmark = pytest.mark.django_db


def test_the_form_says_what_its_votes_will_tell_and_a_preset_changes_them() -> None:
    cast = study_rows.cast_of()
    cast["scenarios"] = ["finished"]
    admin = signed_in(people()["admin"])
    sent = {**cast, "votes_per_expert": "9", "repeats": "0", "checks": "0", "overlap": "0"}
    shown = text_of(admin.post(reverse("study-new"), {**sent, "estimate": "1"}))
    estimate = StudyEstimate(
        contestants=3, experts=2, scenarios=6, votes_per_expert=9, repeats=0, checks=0, overlap=0
    )
    assert "18 votes 9 from each of 2 experts, about 2 minutes each, on 6 scenarios." in shown
    assert f"±{prospect(estimate).half_width:.0f} Elo" in shown
    pressed = text_of(admin.post(reverse("study-new"), {**sent, "preset": "pilot"}))
    preset = PRESETS["pilot"].quantities
    votes = int(preset["votes_per_expert"])
    pilot = replace(estimate, votes_per_expert=votes, overlap=preset["overlap"])
    assert f"{2 * votes} votes {votes} from each of 2 experts" in pressed
    assert f"±{prospect(pilot).half_width:.0f} Elo" in pressed


def test_a_new_form_is_filled_in_with_what_is_finished() -> None:
    cast = study_rows.cast_of()
    study_rows.contestant("late")
    shown = text_of(signed_in(people()["admin"]).get(reverse("study-new")))
    assert len(cast["contestants"]) == 3
    assert "from each of 3 experts" in shown, "the account of the cast of pages is one, too"
    assert "on 6 scenarios" in shown
