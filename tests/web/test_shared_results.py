"""A rating for whoever has its link, and beside another study's."""

import json
from pathlib import Path

import pytest
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse

from arena.models import SharedRating, Snapshot, Study
from arena.results.services.boards import make_board, share_board
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.importing import import_votes
from augment.models import Event
from tests import study_rows
from tests.web.cast import people, signed_in
from tests.web.test_results import judged

pytestmark = pytest.mark.django_db


@pytest.fixture
def rated() -> Snapshot:
    return rate(study=judged(), rounds=50)


def test_a_link_shows_the_table_and_its_data_to_anybody_until_it_is_taken_back(
    rated: Snapshot,
) -> None:
    researcher, place = signed_in(people()["researcher"]), [rated.study.code, rated.code]
    for _ in range(2):
        researcher.post(reverse("results-share", args=place))
    token = SharedRating.objects.get().token
    address, stranger = reverse("shared-results", args=[token]), Client()
    assert address in researcher.get(reverse("results", args=place[:1])).content.decode()
    answer = stranger.get(address)
    assert "noindex" in answer.headers["X-Robots-Tag"]
    page = answer.content.decode()
    assert "Ann" in page
    experts = rated.study.experts.values_list("username", "person__pseudonym")
    assert not any(name in page for names in experts for name in names)
    assert f"/studies/{rated.study.code}" not in page
    data = json.loads(stranger.get(f"{address}table.json").content)
    assert [line["slug"] for line in data["standings"]] == ["ann", "bob", "cid"]
    assert stranger.get(f"{address}table.csv").content.startswith(b"rank,model,elo")
    assert stranger.get(f"{address}table.latex").status_code == 404
    researcher.post(reverse("results-unshare", args=place))
    assert stranger.get(address).status_code == 404
    said = Event.objects.filter(verb__contains="shar").order_by("pk")
    assert [event.verb for event in said] == ["share results", "stop sharing results"]


def test_an_expert_who_still_judges_a_contestant_is_shown_no_shared_result(
    rated: Snapshot,
) -> None:
    eva, study = signed_in(User.objects.get(username="eva")), rated.study
    board = make_board(name="City", study=study)
    share_board(board, is_shared=True)
    board.refresh_from_db()
    link = SharedRating.objects.create(snapshot=rated)
    address = reverse("shared-results", args=[link.token])
    links = [address, f"{address}table.json", reverse("shared-board", args=[board.token])]
    assert [eva.get(link).status_code for link in links] == [200, 200, 200]
    again = Study.objects.create(
        name="Round 2", seed=1, votes_per_expert=1, questions=["instruction"]
    )
    again.contestants.add(*study.contestants.all())
    again.experts.add(*study.experts.all())
    assert [eva.get(link).status_code for link in links] == [403, 403, 403]
    assert [Client().get(link).status_code for link in links] == [200, 200, 200]


def test_an_open_study_is_not_shared() -> None:
    study = study_rows.a_study()
    snapshot = rate(study=study, rounds=50, early=True)
    researcher, place = signed_in(people()["researcher"]), [study.code, snapshot.code]
    researcher.post(reverse("results-open", args=place[:1]))
    researcher.post(reverse("results-share", args=place))
    assert not SharedRating.objects.exists()
    link = SharedRating.objects.create(snapshot=snapshot)
    assert Client().get(reverse("shared-results", args=[link.token])).status_code == 404


def test_two_studies_stand_side_by_side(rated: Snapshot, tmp_path: Path) -> None:
    researcher = signed_in(people()["researcher"])
    address = reverse("results-compare", args=[rated.study.code])
    assert "no other rated study" in researcher.get(address).content.decode()
    path = tmp_path / "votes.csv"
    path.write_text("model_a,model_b,winner\nann,dot,model_a\nann,dot,model_b\n")
    other = import_votes(path=path, name="Elsewhere").study
    rate(study=other, rounds=50)
    answer = researcher.get(address, {"other": str(other.code)})
    assert "its own zero" in answer.content.decode()
    found = [[line and line["row"].slug for _, line in cells] for cells in answer.context["lines"]]
    assert found == [["ann", "ann"], ["bob", None], ["cid", None], [None, "dot"]]
    assert researcher.get(address, {"other": "x"}).status_code == 422
