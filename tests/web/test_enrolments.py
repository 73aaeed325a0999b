"""Taking part by a link for everybody: from the form to the completion code."""

import csv
import io

import pytest
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse

from arena.models import Enrolment, Person, Study
from arena.studies.services.taking_part import set_enrolment
from tests.study_rows import a_study, matchups_of, vote
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


RULES = {
    "consent": "I agree <fully>.\nReally.",
    "asks_for": "Your Prolific ID",
    "places": 2,
    "votes_each": 6,
    "drop_out_after_h": 24,
}
UNFILLED = (
    "PROLIFIC_PID={{%PROLIFIC_PID%}} PROLIFIC_PID=%7B%7B%25PROLIFIC_PID%25%7D%7D&STUDY_ID=s "
    "id=w-1&SESSION_ID={{%SESSION_ID%}} workerId=${workerId} id=a%0Ab id=" + 121 * "x"
).split()
FROM_PROLIFIC = "?PROLIFIC_PID=w-1&STUDY_ID=s-9&SESSION_ID=secret-3"


@pytest.fixture
def enrolment() -> Enrolment:
    return set_enrolment(study=a_study(votes_per_expert=3), rules=RULES)


def join(client: Client, enrolment: Enrolment, query: str = "", **changes: str) -> int:
    given = {"external_id": "w-1", "agreed": "on", "agreed_sha256": enrolment.consent_sha256}
    url = reverse("enrol", args=[enrolment.token]) + query
    return client.post(url, given | changes).status_code


def test_the_page_says_what_one_agrees_to_and_takes_the_id_from_the_address(
    enrolment: Enrolment,
) -> None:
    page = Client().get(reverse("enrol", args=[enrolment.token]) + "?PROLIFIC_PID=abc")
    text = page.content.decode()
    assert "I agree &lt;fully&gt;." in text
    assert 'value="abc"' in text


@pytest.mark.parametrize(("votes", "pairs"), [(6, 8), (100, 24)])
def test_the_page_promises_as_many_pairs_as_the_ballot_has(
    enrolment: Enrolment, votes: int, pairs: int
) -> None:
    shares = {"repeat_share": 0.34, "check_share": 0.5}  # and nothing to check with
    Study.objects.update(rules=enrolment.study.rules | shares)
    Enrolment.objects.update(votes_each=votes)
    page = Client().get(reverse("enrol", args=[enrolment.token])).content.decode()
    join(Client(), enrolment)
    shown = matchups_of(enrolment.study, enrolment.voters.get().expert.username)
    assert (f"in {pairs} pairs" in page, len(shown)) == (True, pairs)


def test_a_newcomer_votes_at_once_and_is_told_the_code_at_the_end(enrolment: Enrolment) -> None:
    client = Client()
    assert join(client, enrolment) == 302
    study = enrolment.study
    planned = study.matchups.filter(expert__enrolled__isnull=False)
    planned.update(view={})
    page = client.get(reverse("vote", args=[study.code])).content.decode()
    assert "Your next pictures are being drawn" in page
    planned.update(view=None)
    assert 'id="vote"' in client.get(reverse("vote", args=[study.code])).content.decode()
    voter = enrolment.voters.get()
    for matchup in matchups_of(study, voter.expert.username):
        vote(matchup)
    page = client.get(reverse("vote", args=[study.code])).content.decode()
    assert voter.completion_code in page
    again = client.get(reverse("enrol", args=[enrolment.token]))
    assert again["Location"] == reverse("vote", args=[study.code])


def test_ids_that_the_platform_did_not_fill_in_take_nobody_on(enrolment: Enrolment) -> None:
    url = reverse("enrol", args=[enrolment.token])
    for query in UNFILLED:
        assert Client().get(f"{url}?{query}").status_code == 422, query
        assert join(Client(), enrolment, f"?{query}") == 422, query
    assert join(Client(), enrolment, external_id="{{%PROLIFIC_PID%}}") == 422
    assert not enrolment.voters.exists()


def test_a_name_may_hold_joiners_and_spaces(enrolment: Enrolment, admin: Client) -> None:
    set_enrolment(study=enrolment.study, rules=RULES | {"places": 9})
    persian, malayalam = "\u0639\u0644\u06cc\u200c\u0631\u0636\u0627", "\u0d28\u0d4d\u200d"
    right = [persian, malayalam, "Ada  King\u00a0L\u3000X"]
    for number, name in enumerate([*right, "\u200d", "a\u202eb", "a\u2028b"]):
        assert join(Client(), enrolment, external_id=name) == (302 if name in right else 422), name
        admin.post(reverse("people"), {"username": f"x{number}, {name}", "role": "expert"})
    assert [row.external_id for row in enrolment.voters.order_by("pk")] == right
    made = Person.objects.filter(user__username__startswith="x").order_by("pk")
    assert [row.pseudonym for row in made] == right


def test_who_comes_again_from_prolific_goes_on_at_that_device_alone(enrolment: Enrolment) -> None:
    first, second, stranger = Client(), Client(), Client()
    assert join(first, enrolment, FROM_PROLIFIC) == 302
    set_enrolment(study=enrolment.study, rules={**RULES, "places": 1})
    url = reverse("enrol", args=[enrolment.token])
    ballot = reverse("vote", args=[enrolment.study.code])
    for query in ("?PROLIFIC_PID=w-1", f"{FROM_PROLIFIC}4", "?SESSION_ID=secret-3"):
        assert stranger.post(url + query, {"go_on": "1"}).status_code == 422
    page = second.get(url + FROM_PROLIFIC)
    assert page.headers["Referrer-Policy"] == "strict-origin"
    assert "Go on here" in page.content.decode()
    assert join(second, enrolment, FROM_PROLIFIC) == 200, "asks as well"
    assert [one.get(ballot).status_code for one in (first, second)] == [200, 302]
    assert second.post(url + FROM_PROLIFIC, {"go_on": "1"})["Location"] == ballot
    assert [one.get(ballot).status_code for one in (first, second)] == [302, 200]
    User.objects.filter(enrolled__isnull=False).update(is_active=False)
    assert "Go on here" not in stranger.get(url + FROM_PROLIFIC).content.decode()


def test_a_form_whose_answer_was_lost_lets_its_sender_in_when_it_is_sent_again(
    enrolment: Enrolment,
) -> None:
    sent = {"csrfmiddlewaretoken": 64 * "x"}
    assert join(Client(), enrolment, **sent) == 302
    client = Client()
    assert join(client, enrolment, csrfmiddlewaretoken=64 * "y") == 422, "another form"
    assert join(client, enrolment, **sent) == 302
    ballot = reverse("vote", args=[enrolment.study.code])
    assert (client.get(ballot).status_code, enrolment.voters.count()) == (200, 1)
    User.objects.filter(enrolled__isnull=False).update(is_active=False)
    assert join(Client(), enrolment, **sent) == 404


@pytest.mark.parametrize("text", ["C1ABCD", "https://app.prolific.com/submissions/complete?cc=C1"])
def test_a_study_has_its_own_code_or_return_address(
    enrolment: Enrolment, admin: Client, text: str
) -> None:
    url, given = reverse("enrolment", args=[enrolment.study.code]), RULES | {"is_open": "on"}
    for wrong in ("javascript:alert(1)", "http://x.org/", "www.x.org/done"):
        assert admin.post(url, given | {"completes_with": wrong}).status_code == 422, wrong
    assert admin.post(url, given | {"completes_with": text}).status_code == 302
    enrolment.refresh_from_db()
    voter = Client()
    join(voter, enrolment)
    row = enrolment.voters.get()
    for matchup in matchups_of(enrolment.study, row.expert.username):
        vote(matchup)
    page = voter.get(reverse("vote", args=[enrolment.study.code])).content.decode()
    assert (f'href="{text}"' if "/" in text else f">{text}<") in page
    assert row.completion_code not in page


def test_a_voter_opens_nothing_but_the_own_study(enrolment: Enrolment) -> None:
    client = Client()
    join(client, enrolment)
    for name in ("enrolment", "study"):
        assert client.get(reverse(name, args=[enrolment.study.code])).status_code == 403
    other = Study.objects.create(name="Round 2", votes_per_expert=1, seed=1, state="open")
    assert client.get(reverse("vote", args=[other.code])).status_code == 404


def test_an_admin_makes_the_link_and_changes_it(enrolment: Enrolment) -> None:
    admin, url = people()["admin"], reverse("enrolment", args=[enrolment.study.code])
    given = RULES | {"places": 9, "drop_out_after_h": "", "is_open": "on"}
    assert signed_in(admin).post(url, given).status_code == 302
    enrolment.refresh_from_db()
    assert (enrolment.places, enrolment.drop_out_after_h) == (9, None)
    assert enrolment.token in signed_in(admin).get(url).content.decode()
    assert signed_in(admin).post(url, {**given, "places": 0}).status_code == 422


def test_the_file_says_whom_to_pay_and_holds_no_formula(enrolment: Enrolment) -> None:
    join(Client(), enrolment, external_id="=1+1")
    join(Client(), enrolment, FROM_PROLIFIC, external_id="w-2")
    done = enrolment.voters.get(external_id="w-2")
    for matchup in matchups_of(enrolment.study, done.expert.username):
        vote(matchup)
    url = reverse("enrolment-voters", args=[enrolment.study.code])
    text = signed_in(people()["admin"]).get(url).content.decode()
    first, second = csv.DictReader(io.StringIO(text))
    assert (first["id"], first["is_done"], first["completion_code"]) == ("'=1+1", "0", "")
    assert (second["id"], second["answered"]) == ("w-2", "6")
    assert second["completion_code"] == done.completion_code
    assert [(row["study_id"], row["session_id"]) for row in (first, second)] == [
        ("", ""),
        ("s-9", "secret-3"),
    ]
