"""A study that was cancelled: no votes, no results, its votes stay."""

import pytest
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse

from arena.errors import NoSnapshot, StudyNotOpen
from arena.models import Study, Vote
from arena.results.queries.access import snapshot_to_export
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import cancel_study, close_study
from arena.voting.queries.blinding import ResultsAccess, results_access
from augment.errors import Conflict
from augment.models import Event
from tests import study_rows
from tests.web.cast import people, signed_in
from tests.web.test_questions import text_of

pytestmark = pytest.mark.django_db


@pytest.fixture
def study() -> Study:
    """Open, with three votes and a skip of eva's."""
    study = study_rows.a_study()
    first, *rest = study_rows.matchups_of(study, "eva")
    study_rows.vote(first, "skip", reason="unclear")
    for matchup in rest[:3]:
        study_rows.vote(matchup)
    return study


@pytest.fixture
def admin() -> Client:
    return signed_in(people()["admin"])


def test_cancelling_needs_the_name_and_says_how_it_differs_from_closing(
    study: Study, admin: Client
) -> None:
    page = reverse("study-cancel", args=[study.code])
    assert page in admin.get(reverse("study", args=[study.code])).content.decode()
    asked = text_of(admin.get(page))
    assert "Cancel the study “Round 1”?" in asked
    assert "nobody ever sees results" in asked
    assert "exported as votes: 3." in asked
    assert "To end it with results, close it instead." in asked
    for typed in ("", "Round", "round 12"):
        answer = admin.post(page, {"sure": "1", "typed": typed, "why": "Wrong pictures."})
        assert answer.status_code == 422, typed
        assert "That is another name; nothing was done." in text_of(answer)
        assert "Wrong pictures." in answer.content.decode(), "nothing is lost"
        assert Study.objects.get().state == "open"
    answer = admin.post(page, {"sure": "1", "typed": "round-1", "why": "Wrong pictures."})
    assert answer.headers["Location"] == reverse("study", args=[study.code])
    event = Event.objects.get(verb="cancel")
    assert event.after == {"state": "cancelled", "why": "Wrong pictures."}
    assert event.actor == User.objects.get(username="the-admin")
    assert admin.get(page).status_code == 302, "there is nothing more to ask"


def test_an_expert_reads_a_calm_sentence_and_can_vote_no_more(study: Study) -> None:
    eva = signed_in(User.objects.get(username="eva"))
    waiting = study_rows.matchups_of(study, "eva")[5]
    cancel_study(study=study)
    shown = text_of(eva.get(reverse("vote", args=[study.code])))
    assert "This study was cancelled" in shown
    assert "There is nothing left for you to do. Your 3 answers are saved, thank you." in shown
    assert "This study was cancelled" in text_of(eva.get("/"))
    with pytest.raises(StudyNotOpen):
        study_rows.vote(waiting)
    assert Vote.objects.count() == 4


def test_it_has_no_results_for_anybody_also_where_somebody_rated_early(
    study: Study, admin: Client
) -> None:
    early = rate(study=study, early=True, rounds=20)
    cancel_study(study=study)
    study.refresh_from_db()
    for user in User.objects.all():
        assert results_access(user=user, study=study) is ResultsAccess.NONE, user
    for name in ("results", "study-rate"):
        address = reverse(name, args=[study.code])
        answer = admin.post(address) if name == "study-rate" else admin.get(address)
        assert answer.status_code == 403, name
    with pytest.raises(NoSnapshot):
        snapshot_to_export(study, early.code)
    with pytest.raises(Conflict):
        rate(study=study, early=True, rounds=20)
    shown = admin.get(reverse("studies")).content.decode()
    assert "Cancelled" in shown
    assert reverse("results", args=[study.code]) not in shown


def test_closed_and_cancelled_exclude_each_other(study: Study) -> None:
    for _ in range(2):
        assert cancel_study(study=study).state == "cancelled"
    assert Event.objects.filter(verb="cancel").count() == 1
    with pytest.raises(StudyNotOpen, match="is cancelled already"):
        close_study(study=study)
    Study.objects.update(state="closed")
    with pytest.raises(StudyNotOpen, match="is closed"):
        cancel_study(study=study)
