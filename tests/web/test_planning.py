"""Planning a study by its page and its command, with and without a study at hand."""

from io import StringIO

import pytest
from django.core.management import CommandError, call_command
from django.urls import reverse

from arena.models import Study
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.outlook import StudyEstimate, known_of, prospect
from tests import study_rows
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def _page(role: str = "admin", **asked: str | int) -> str:
    person = people()[role]
    answer = signed_in(person).get(reverse("study-plan"), asked)
    return answer.content.decode()


def _voted() -> Study:
    """Two experts who do not agree on everything, with nine votes each."""
    study = study_rows.a_study()
    for number, matchup in enumerate(study.matchups.order_by("pk")):
        slug = matchup.left.contestant.slug
        good = "left" if slug == "ann" else "right"
        odd = "right" if good == "left" else "left"
        outcome = "equal" if number % 4 == 0 else odd if number % 3 == 0 else good
        study_rows.vote(matchup, outcome, ms_visible=4000)
    return study


def test_the_page_is_usable_without_any_study() -> None:
    shown = _page(votes_per_expert=100)
    expected = prospect(StudyEstimate(), 100)
    assert f'<td class="num">{expected.minutes:.0f}</td>' in shown
    assert f"±{expected.widest:.0f}" in shown
    assert "No number of votes reaches it" in shown  # ±25 with effects so large


def test_an_open_study_gives_its_numbers_but_nothing_of_its_results() -> None:
    study = _voted()
    rate(study=study, early=True)
    known = known_of(study, people()["researcher"])
    assert known == {"contestants": 3, "experts": 2, "scenarios": 6}


def test_the_command_says_the_same_numbers() -> None:
    out = StringIO()
    call_command("plan_study", "--votes-per-expert", "100", stdout=out)
    expected = prospect(StudyEstimate(), 100)
    said = out.getvalue()
    assert f"100 votes per expert, 900 in all, {expected.minutes:.0f} minutes each" in said
    assert "expert sd: 30 (guessed)" in said
    assert "No number of votes reaches it" in said
    with pytest.raises(CommandError, match="gap: goes from 1 to 2000, not 0"):
        call_command("plan_study", "--gap", "0")
