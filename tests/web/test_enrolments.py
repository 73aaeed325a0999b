"""Taking part by a link for everybody: from the form to the completion code."""

import csv
import io

import pytest
from django.test import Client
from django.urls import reverse

from arena.models import Enrolment, Study
from arena.studies.services.taking_part import set_enrolment
from tests.study_rows import a_study, matchups_of, vote
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


@pytest.fixture
def enrolment() -> Enrolment:
    return set_enrolment(
        study=a_study(votes_per_expert=3),
        rules={
            "consent": "I agree <fully>.\nReally.",
            "asks_for": "Your Prolific ID",
            "places": 2,
            "votes_each": 6,
            "drop_out_after_h": 24,
        },
    )


def join(client: Client, enrolment: Enrolment, **changes: str) -> int:
    given = {"external_id": "w-1", "agreed": "on", "agreed_sha256": enrolment.consent_sha256}
    return client.post(reverse("enrol", args=[enrolment.token]), given | changes).status_code


def test_the_page_says_what_one_agrees_to_and_takes_the_id_from_the_address(
    enrolment: Enrolment,
) -> None:
    page = Client().get(reverse("enrol", args=[enrolment.token]) + "?PROLIFIC_PID=abc")
    text = page.content.decode()
    assert "I agree &lt;fully&gt;." in text
    assert "in 6 pairs" in text
    assert 'value="abc"' in text


def test_a_newcomer_votes_at_once_and_is_told_the_code_at_the_end(enrolment: Enrolment) -> None:
    client = Client()
    assert join(client, enrolment) == 302
    study = enrolment.study
    assert client.get(reverse("vote", args=[study.code])).status_code == 200
    voter = enrolment.voters.get()
    for matchup in matchups_of(study, voter.expert.username):
        vote(matchup)
    page = client.get(reverse("vote", args=[study.code])).content.decode()
    assert voter.completion_code in page
    again = client.get(reverse("enrol", args=[enrolment.token]))
    assert again["Location"] == reverse("vote", args=[study.code])


def test_a_voter_opens_nothing_but_the_own_study(enrolment: Enrolment) -> None:
    client = Client()
    join(client, enrolment)
    for name in ("enrolment", "study"):
        assert client.get(reverse(name, args=[enrolment.study.code])).status_code == 403
    other = Study.objects.create(name="Round 2", votes_per_expert=1, seed=1, state="open")
    assert client.get(reverse("vote", args=[other.code])).status_code == 404


def test_an_admin_makes_the_link_and_changes_it(enrolment: Enrolment) -> None:
    admin, url = people()["admin"], reverse("enrolment", args=[enrolment.study.code])
    given = {
        **{"consent": "Yes.", "asks_for": "ID", "places": 9, "votes_each": 4},
        **{"drop_out_after_h": "", "is_open": "on"},
    }
    assert signed_in(admin).post(url, given).status_code == 302
    enrolment.refresh_from_db()
    assert (enrolment.places, enrolment.drop_out_after_h) == (9, None)
    assert enrolment.token in signed_in(admin).get(url).content.decode()
    assert signed_in(admin).post(url, {**given, "places": 0}).status_code == 422


def test_the_file_says_whom_to_pay_and_holds_no_formula(enrolment: Enrolment) -> None:
    join(Client(), enrolment, external_id="=1+1")
    join(Client(), enrolment, external_id="w-2")
    done = enrolment.voters.get(external_id="w-2")
    for matchup in matchups_of(enrolment.study, done.expert.username):
        vote(matchup)
    url = reverse("enrolment-voters", args=[enrolment.study.code])
    text = signed_in(people()["admin"]).get(url).content.decode()
    first, second = csv.DictReader(io.StringIO(text))
    assert (first["id"], first["is_done"], first["completion_code"]) == ("'=1+1", "0", "")
    assert (second["id"], second["answered"]) == ("w-2", "6")
    assert second["completion_code"] == done.completion_code
