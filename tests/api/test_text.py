"""The text description on the wire."""

from __future__ import annotations

import time

import pytest
from django.db import connection
from django.test.utils import CaptureQueriesContext

from arena.models import Study, Vote
from arena.queries.showings import as_shown
from augment.services.wording import translate_all
from tests.api.asking import body_for, error_of, post, signed_in
from tests.described import a_described_study, said_of
from tests.study_rows import a_study, matchups_of

pytestmark = [pytest.mark.django_db, pytest.mark.urls("tests.api.urls")]


@pytest.fixture
def described() -> Study:
    return a_described_study()


def test_every_pair_brings_what_its_two_pictures_show(described: Study) -> None:
    client = signed_in("eva")
    mine = matchups_of(described, "eva")
    right = [{"a": said_of(row.left), "b": said_of(row.right)} for row in mine]
    coming = client.get(f"/api/v1/matchups?study={described.code}").json()
    assert [pair["text"] for pair in coming] == right[:4]
    answer = post(client, body_for(mine[0])).json()
    assert [pair["text"] for pair in answer["next"]] == right[1:5]


def test_it_is_in_the_language_of_who_asks(described: Study) -> None:
    client = signed_in("eva")
    asked = f"/api/v1/matchups?study={described.code}&n=1"
    german = client.get(asked, headers={"accept-language": "de"}).json()[0]
    assert german["text"]["a"][0].startswith("Fahrzeug, ")
    assert client.get(asked).json()[0]["text"]["a"][0].startswith("Vehicle, ")


def test_without_it_no_answer_of_the_wire_has_a_trace_of_it() -> None:
    study = a_study()
    client = signed_in("eva")
    asked = [
        client.get(f"/api/v1/matchups?study={study.code}"),
        post(client, body_for(matchups_of(study, "eva")[0])),
    ]
    assert not any("text" in answer.content.decode() for answer in asked)


def test_who_read_it_is_kept_with_the_vote(described: Study) -> None:
    first = matchups_of(described, "eva")[0]
    assert post(signed_in("eva"), body_for(first, aids=["text", "zoom"])).status_code == 200
    assert Vote.objects.get().aids == "zoom text"


def test_nobody_can_have_read_what_the_study_does_not_have() -> None:
    body = body_for(matchups_of(a_study(), "eva")[0], aids=["text"])
    error = error_of(post(signed_in("eva"), body), 422, "invalid")
    assert error["fields"] == {"aids": ["This study has no text description."]}
    assert not Vote.objects.exists()


def test_a_vote_costs_as_many_queries_with_it_as_without(described: Study) -> None:
    client = signed_in("eva")
    first, second, third, *_ = matchups_of(described, "eva")
    post(client, body_for(first))
    with CaptureQueriesContext(connection) as with_it:
        post(client, body_for(second, aids=["text"]))
    described.matchups.update(descriptions=None)
    Study.objects.update(allow_text=False)
    with CaptureQueriesContext(connection) as without:
        post(client, body_for(third))
    assert Vote.objects.count() == 3
    assert len(with_it) == len(without)


def test_putting_a_pair_into_words_takes_less_than_a_millisecond(described: Study) -> None:
    """Twelve agents on either side; the best of many tries, as the machine has other work."""
    matchup = matchups_of(described, "eva")[0]
    matchup.descriptions = [side * 12 for side in matchup.descriptions or []]
    taken = []
    for _ in range(50):
        start = time.perf_counter()
        as_shown(matchup, translate_all)
        taken.append(time.perf_counter() - start)
    assert min(taken) < 0.001
