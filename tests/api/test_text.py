"""The text description on the wire."""

import pytest

from arena.models import Study, Vote
from tests.api.asking import body_for, post, signed_in
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
