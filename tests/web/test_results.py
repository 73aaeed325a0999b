"""The results page: its table and tabs, what each shows, to whom, and what is shared of it."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse
from pytest_django import DjangoAssertNumQueries

from arena.models import EarlyLook, Matchup, SharedRating, Snapshot, Study
from arena.results.pages.tabs import FOR_EXPERTS, TABS
from arena.results.queries.votes import Filters
from arena.results.services.boards import make_board, share_board
from arena.results.services.questions import compare_questions
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.importing import import_votes
from arena.studies.services.opening import close_study
from augment.models import Augmentation, Contestant, Event
from augment.scene.entities import ScenarioType
from tests import study_rows
from tests.drives import drive_pictures
from tests.full_study import Size, full_study
from tests.opening import open_study
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def judged(**cast: object) -> Study:
    """A closed study in which ann beats everybody and bob beats cid."""
    study = study_rows.a_study(**cast)  # type: ignore[arg-type]

    def outcome(pair: Matchup) -> str:
        return "left" if pair.left.contestant.slug < pair.right.contestant.slug else "right"

    return study_rows.vote_all(study, outcome)


def shown(study: Study, user: User | None = None, tab: str = "table") -> str:
    reader = user or people()["researcher"]
    answer = signed_in(reader).get(reverse("results-tab", args=[study.code, tab]))
    assert answer.status_code == 200
    return answer.content.decode()


def test_the_table_says_rank_rating_interval_and_votes_with_the_method_beneath() -> None:
    study = judged()
    rate(study=study, rounds=50)
    page = shown(study)
    order = [page.index(f'<th scope="row">{name}') for name in ("Ann", "Bob", "Cid")]
    assert order == sorted(order)
    for said in ("Bradley-Terry on the Elo scale", "50 rounds", "seed 0", "SHA-256", "one plus"):
        assert said in page


def test_what_is_simulated_is_said_on_every_page_of_the_study() -> None:
    cast = study_rows.cast_of(kind=Contestant.Kind.SIMULATED, simulated_experts=True)
    study = open_study(name="Round 1", votes_per_expert=9, seed=7, allow_simulated=True, **cast)
    for matchup in study.matchups.all():
        study_rows.vote(matchup)
    study = close_study(study=study)
    rate(study=study, rounds=50)
    reader = people()["researcher"]
    page = shown(study, reader)
    assert "Simulated votes and contestants count in this study." in page
    assert page.count("simulated</span>") == 3
    for name in ("studies", "home"):
        assert "simulated</span>" in signed_in(reader).get(reverse(name)).content.decode()
    overview = signed_in(reader).get(reverse("study", args=[study.code])).content.decode()
    assert "Simulated votes and contestants count in this study." in overview


def test_an_expert_reads_results_only_once_no_open_study_has_the_same_contestants() -> None:
    study = judged()
    eva = User.objects.get(username="eva")
    url = reverse("results", args=[study.code])
    assert signed_in(eva).get(url).status_code == 200
    second = open_study(
        name="Round 2",
        votes_per_expert=3,
        seed=1,
        experts=["eva"],
        contestants=["ann", "bob"],
        scenarios=["place-0", "place-1", "place-2"],
    )
    assert signed_in(eva).get(url).status_code == 403
    assert url not in signed_in(eva).get("/").content.decode()
    close_study(study=second)
    assert signed_in(eva).get(url).status_code == 200


SIZE = Size(scenarios=6, experts=3, votes_per_expert=40)


def page(client: Client, study: Study, tab: str = "table", **query: str) -> str:
    answer = client.get(reverse("results-tab", args=[study.code, tab]), query)
    assert answer.status_code == 200, tab
    return " ".join(answer.content.decode().split())


def test_every_tab_reads_the_snapshot_with_few_queries(
    researcher: Client, django_assert_max_num_queries: DjangoAssertNumQueries
) -> None:
    study = full_study(size=SIZE)
    for seed in range(3):  # the log lists all, and reads no results for it
        rate(study=study, rounds=100, seed=seed)
    for tab in TABS:
        page(researcher, study, tab)  # templates are compiled once
        with django_assert_max_num_queries(13):
            page(researcher, study, tab)
    with django_assert_max_num_queries(17):  # not one for the type of each vote
        researcher.get(reverse("results-votes", args=[study.code]))


def test_slight_preferences_are_held_against_the_order(researcher: Client) -> None:
    study = study_rows.a_study(votes_per_expert=9)
    Study.objects.update(ask_strength=True, allow_both_miss=True)
    for number, matchup in enumerate(study.matchups.order_by("pk")):
        said = {"strength": "slightly"} if number % 3 else {"strength": "clearly"}
        outcome = "left" if number % 2 else "right"
        if number:
            study_rows.vote(matchup, outcome, **said)
        else:
            study_rows.vote(matchup, "equal", both_miss=True)
    rate(study=close_study(study=study), rounds=50)
    shown = page(researcher, study)
    assert "12 preferences are slight, 5 clear; each counts as one win." in shown
    assert "moves no rating by more than" in shown
    assert "In 1 vote</a> (6 %) both miss" in shown


def test_raters_are_pseudonyms_with_repeats_and_checks(researcher: Client) -> None:
    study = study_rows.a_study(votes_per_expert=9)
    first, second, third, *rest = study_rows.matchups_of(study, "eva")
    Matchup.objects.filter(pk=second.pk).update(
        kind="repeat", repeat_of=first, left=first.right, right=first.left, scenario=first.scenario
    )
    Matchup.objects.filter(pk=third.pk).update(kind="check")
    second.refresh_from_db()
    for matchup in (first, second, third, *rest, *study_rows.matchups_of(study, "finn")):
        study_rows.vote(matchup, "left")
    study = close_study(study=study)
    snapshot = rate(study=study, rounds=50)
    repeats = snapshot.results.trust.repeats
    assert repeats is not None
    assert (repeats.number, repeats.same.value) == (1, 0.0), "left both times"
    shown = page(researcher, study, "raters")
    assert first.expert.person.pseudonym in shown
    assert "eva" not in shown
    assert "of 1 hidden repeat answered alike" in shown
    assert ">1</a>" in shown.partition("0 / ")[2][:250]


def test_experts_read_the_table_but_nothing_about_each_other(rated: Snapshot) -> None:
    study, expert = rated.study, signed_in(User.objects.get(username="eva"))
    shown = page(expert, study)
    assert "Raters" not in shown
    assert "Export" not in shown
    assert "results/votes" not in page(expert, study, "pairs")
    for tab in TABS:
        status = expert.get(reverse("results-tab", args=[study.code, tab])).status_code
        assert status == (200 if tab in FOR_EXPERTS else 403), tab
    for name, form in (("all", "zip"), ("votes", "csv"), ("leaderboard", "json")):
        address = reverse("results-export", args=[study.code, name, form])
        assert expert.get(address).status_code == 403
    chart = reverse("results-export", args=[study.code, "leaderboard", "svg"])
    assert expert.get(chart).status_code == 200


def test_a_new_rating_is_asked_for_with_method_and_filters(
    rated: Snapshot, researcher: Client
) -> None:
    study = rated.study
    person = study.experts.order_by("pk")[0].person
    sent = {
        "method": "bt",
        "resample": "vote",
        "rounds": "160",
        "seed": "9",
        "types": [ScenarioType.NUDGE.value],
        "experts": [str(person.code)],
    }
    researcher.post(reverse("study-rate", args=[study.code]), sent)
    made = study.snapshots.order_by("-pk")[0]
    assert (made.rounds, made.seed, made.resampling_unit) == (160, 9, "vote")
    assert made.filters["experts"] == [str(person.code)]
    assert made.votes_counted == 9
    for refused in ({"rounds": "99"}, {"method": "elo"}):
        researcher.post(reverse("study-rate", args=[study.code]), refused)
    assert study.snapshots.count() == 2


def test_an_open_study_shows_a_gate_then_its_results_to_who_opened_them() -> None:
    study = study_rows.a_study()
    for matchup in study.matchups.all():
        study_rows.vote(matchup)
    made = people()
    researcher, admin = signed_in(made["researcher"]), signed_in(made["admin"])
    study.experts.add(made["admin"])
    rate(study=study, rounds=50, early=True)
    for tab in TABS:
        assert 'class="standings"' not in page(researcher, study, tab)
    address = reverse("results", args=[study.code])
    assert "Opening results ends your voting" not in researcher.get(address).content.decode()
    assert "Opening results ends your voting" in admin.get(address).content.decode()
    assert researcher.post(reverse("study-rate", args=[study.code])).status_code == 403
    researcher.post(reverse("results-open", args=[study.code]))
    assert EarlyLook.objects.get().user == made["researcher"]
    researcher.post(reverse("study-rate", args=[study.code]))
    shown = researcher.get(address).content.decode()
    assert "you opened its results early" in shown
    votes = reverse("results-votes", args=[study.code])
    eva = signed_in(study.experts.get(username="eva"))
    assert (researcher.get(votes).status_code, eva.get(votes).status_code) == (200, 403)
    assert "Early look" not in shown, "one note says that the study is open"
    early = study.snapshots.latest("pk")
    close_study(study=study)
    shown = researcher.get(address, {"rating": str(early.code)}).content.decode()
    assert "Early look: the study was still open." in shown
    Study.objects.filter(pk=study.pk).update(state=Study.State.OPEN)
    assert "still open" in admin.get(address).content.decode(), "each opens for themselves"


def test_questions_stand_side_by_side_and_are_never_averaged(researcher: Client) -> None:
    study = study_rows.a_study(votes_per_expert=9, questions=("instruction", "realism"))
    for number, matchup in enumerate(study.matchups.order_by("pk")):
        best = min(matchup.left.contestant.slug, matchup.right.contestant.slug)
        better = "left" if matchup.left.contestant.slug == best else "right"
        worse = "right" if better == "left" else "left"
        study_rows.vote(matchup, better if number % 6 else worse)
        other = better if number == 1 else "equal" if number == 2 else worse
        study_rows.vote(matchup, other, question="realism")
    study = close_study(study=study)
    alone = rate(study=study, rounds=50)
    shown = page(researcher, study)
    assert "Realism is not rated in the same way yet." in shown
    rate(study=study, rounds=50, filters=Filters(question="realism", leave_out_settled=True))
    assert compare_questions(alone).ratings["realism"] is None  # type: ignore[union-attr]
    newest = rate(study=study, rounds=50, filters=Filters(question="realism"))
    (link,) = compare_questions(newest).links  # type: ignore[union-attr]
    assert (link.spearman, link.pairs) == (pytest.approx(-1.0), 17)
    assert link.same.value == pytest.approx(4 / 17), "three slips, and one that both like"
    apart = replace(newest.results.board, parts={"ann": 0, "bob": 0, "cid": 1})
    newest.results = replace(newest.results, board=apart)
    (link,) = compare_questions(newest).links  # type: ignore[union-attr]
    assert link.spearman is None, "of ratings that can't be compared"
    shown = page(researcher, study)
    assert "rank correlation of ratings −1.00 (Spearman)" in shown
    assert "of 17 pairs decided in both" in shown
    assert f'?rating={newest.code}">Realism</a>' in shown
    assert "question realism" not in shown, "the primary question is shown first"


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


def test_two_studies_stand_side_by_side(
    rated: Snapshot, tmp_path: Path, researcher: Client
) -> None:
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


def test_drives_of_another_planner_than_the_papers_are_shown(rated: Snapshot) -> None:
    drive_pictures(Augmentation.objects.all(), planner="idm")
    text = shown(rated.study, tab="driving")
    assert "by the planner idm" in text
    assert "Nothing was driven" not in text
