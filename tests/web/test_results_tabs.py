"""The tabs of the results: what each shows, to whom, and that a page only reads."""

import pytest
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse
from pytest_django import DjangoAssertNumQueries

from arena.models import EarlyLook, Matchup, Study
from arena.results.pages.tabs import FOR_EXPERTS, TABS
from arena.results.queries.votes import Filters
from arena.results.services.questions import compare_questions
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import close_study
from augment.scene.entities import ScenarioType
from tests import study_rows
from tests.full_study import Size, full_study
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

SIZE = Size(scenarios=10, experts=4, votes_per_expert=90)


def page(client: Client, study: Study, tab: str = "table", **query: str) -> str:
    answer = client.get(reverse("results-tab", args=[study.code, tab]), query)
    assert answer.status_code == 200, tab
    return " ".join(answer.content.decode().split())


@pytest.fixture
def study() -> Study:
    found = full_study(size=SIZE)
    rate(study=found, rounds=400, seed=2)
    return found


@pytest.fixture
def reader() -> Client:
    return signed_in(people()["researcher"])


def test_every_tab_reads_the_snapshot_with_few_queries(
    study: Study, reader: Client, django_assert_max_num_queries: DjangoAssertNumQueries
) -> None:
    for seed in range(3):  # the log lists all, and reads no results for it
        rate(study=study, rounds=100, seed=seed)
    for tab in TABS:
        page(reader, study, tab)  # templates are compiled once
        with django_assert_max_num_queries(13):
            page(reader, study, tab)
    with django_assert_max_num_queries(17):  # not one for the type of each vote
        reader.get(reverse("results-votes", args=[study.code]))


def test_slight_preferences_are_held_against_the_order(reader: Client) -> None:
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
    shown = page(reader, study)
    assert "12 preferences are slight, 5 clear; each counts as one win." in shown
    assert "moves no rating by more than" in shown
    assert "In 1 vote</a> (6 %) both miss" in shown


def test_raters_are_pseudonyms_with_repeats_and_checks(reader: Client) -> None:
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
    shown = page(reader, study, "raters")
    assert first.expert.person.pseudonym in shown
    assert "eva" not in shown
    assert "of 1 hidden repeat answered alike" in shown
    assert ">1</a>" in shown.partition("0 / ")[2][:250]


def test_experts_read_the_table_but_nothing_about_each_other(study: Study) -> None:
    expert = signed_in(User.objects.get(username="expert-1"))
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


def test_a_new_rating_is_asked_for_with_method_and_filters(study: Study, reader: Client) -> None:
    person = study.experts.order_by("pk")[0].person
    sent = {
        "method": "bt",
        "resample": "vote",
        "rounds": "160",
        "seed": "9",
        "types": [ScenarioType.NUDGE.value],
        "experts": [str(person.code)],
    }
    reader.post(reverse("study-rate", args=[study.code]), sent)
    made = study.snapshots.order_by("-pk")[0]
    assert (made.rounds, made.seed, made.resampling_unit) == (160, 9, "vote")
    assert made.filters["experts"] == [str(person.code)]
    assert 0 < made.votes_counted < 90
    for refused in ({"rounds": "99"}, {"method": "elo"}):
        reader.post(reverse("study-rate", args=[study.code]), refused)
    assert study.snapshots.count() == 2


def test_an_open_study_shows_a_gate_then_its_results_to_who_opened_them() -> None:
    study = study_rows.a_study()
    for matchup in study.matchups.all():
        study_rows.vote(matchup)
    made = people()
    reader, admin = signed_in(made["researcher"]), signed_in(made["admin"])
    study.experts.add(made["admin"])
    address = reverse("results", args=[study.code])
    assert "Opening results ends your voting" not in reader.get(address).content.decode()
    assert "Opening results ends your voting" in admin.get(address).content.decode()
    assert reader.post(reverse("study-rate", args=[study.code])).status_code == 403
    reader.post(reverse("results-open", args=[study.code]))
    assert EarlyLook.objects.get().user == made["researcher"]
    reader.post(reverse("study-rate", args=[study.code]))
    shown = reader.get(address).content.decode()
    assert "you opened its results early" in shown
    assert "Early look" not in shown, "one note says that the study is open"
    early = study.snapshots.get()
    close_study(study=study)
    shown = reader.get(address, {"rating": str(early.code)}).content.decode()
    assert "Early look: the study was still open." in shown
    Study.objects.filter(pk=study.pk).update(state=Study.State.OPEN)
    assert "still open" in admin.get(address).content.decode(), "each opens for themselves"


def test_questions_stand_side_by_side_and_are_never_averaged(reader: Client) -> None:
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
    shown = page(reader, study)
    assert "Realism is not rated in the same way yet." in shown
    rate(study=study, rounds=50, filters=Filters(question="realism", leave_out_settled=True))
    assert compare_questions(alone).ratings["realism"] is None  # type: ignore[union-attr]
    newest = rate(study=study, rounds=50, filters=Filters(question="realism"))
    (link,) = compare_questions(newest).links  # type: ignore[union-attr]
    assert (link.spearman, link.pairs) == (pytest.approx(-1.0), 17)
    assert link.same.value == pytest.approx(4 / 17), "three slips, and one that both like"
    shown = page(reader, study)
    assert "rank correlation of ratings −1.00 (Spearman)" in shown
    assert "of 17 pairs decided in both" in shown
    assert f'?rating={newest.code}">Realism</a>' in shown
    assert "question realism" not in shown, "the primary question is shown first"
