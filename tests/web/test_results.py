"""The results page: the table, its files, and what is said with them."""

import pytest
from django.contrib.auth.models import User
from django.urls import reverse

from arena.models import Study
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import close_study
from augment.models import Contestant
from tests import study_rows
from tests.opening import open_study
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def judged(**cast: object) -> Study:
    """A closed study in which ann beats everybody and bob beats cid."""
    study = study_rows.a_study(**cast)  # type: ignore[arg-type]
    for matchup in study.matchups.select_related("left__contestant", "right__contestant"):
        is_left = matchup.left.contestant.slug < matchup.right.contestant.slug
        study_rows.vote(matchup, "left" if is_left else "right")
    return close_study(study=study)


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
