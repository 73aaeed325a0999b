"""Django's admin tells of an open study no more than the pages do before an early look."""

from __future__ import annotations

from typing import Any

import pytest
from django.contrib import admin
from django.contrib.auth.models import Permission, User
from django.test import Client
from django.urls import reverse

from arena.models import Matchup, Snapshot, Standing, Study, Vote
from arena.results.services.ratings import open_early
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import close_study
from augment.models import Augmentation, Contestant
from tests import study_rows
from tests.web.cast import people, signed_in, world

pytestmark = pytest.mark.django_db

TELLING = (Vote, Snapshot, Matchup)


def voted() -> Study:
    """An open study in which ann wins, rated early by somebody at the command line."""
    study = world().study
    for matchup in study.matchups.all()[:6]:
        sides = matchup.left.contestant.slug, matchup.right.contestant.slug
        study_rows.vote(matchup, "left" if sides[0] < sides[1] else "right")
    rate(study=study, early=True, rounds=20)
    return study


def rows_of(client: Client, model: Any, **asked: str) -> int | None:
    """How many rows the list shows; None where it refuses the question."""
    answer = client.get(address(model), asked)
    if answer.status_code != 200:
        return None
    return int(answer.context["cl"].result_count)


def address(model: Any, what: str = "changelist", *args: object) -> str:
    name = f"admin:{model._meta.app_label}_{model._meta.model_name}_{what}"
    return reverse(name, args=args)


@pytest.mark.parametrize("model", TELLING)
def test_rows_of_an_open_study_are_shown_after_an_early_look_alone(model: Any) -> None:
    study, accounts = voted(), people()
    office = signed_in(accounts["admin"])
    row = model.objects.all()[0]
    one = [address(model, what, row.pk) for what in ("change", "history")]
    assert rows_of(office, model) == 0
    assert [office.get(url).status_code for url in one] == [302, 302]  # as if it were not there
    assert study.name in office.get(address(model)).content.decode()
    open_early(study=study, actor=accounts["admin"])
    assert rows_of(office, model) == model.objects.count()
    assert [office.get(url).status_code for url in one] == [200, 200]
    other = signed_in(User.objects.create_superuser("other", password="x"))
    assert rows_of(other, model) == 0


@pytest.mark.parametrize("model", TELLING)
def test_they_are_shown_once_the_study_is_closed(model: Any) -> None:
    study = voted()
    office = signed_in(people()["admin"])
    close_study(study=study)
    assert rows_of(office, model) == model.objects.count()
    assert "Not shown here" not in office.get(address(model)).content.decode()


def test_a_clerk_with_rights_but_no_role_sees_none_either() -> None:
    study = voted()
    clerk = User.objects.create_user("clerk", is_staff=True)
    clerk.user_permissions.set(Permission.objects.filter(codename__startswith="view_"))
    open_early(study=study, actor=clerk)
    assert [rows_of(signed_in(clerk), model) for model in TELLING] == [0, 0, 0]


@pytest.mark.parametrize(
    ("model", "asked"),
    [
        (Augmentation, {"wins__isnull": "0"}),
        (Augmentation, {"wins__outcome": "left"}),
        (Augmentation, {"shown_left__votes__outcome": "left"}),
        (Contestant, {"standings__rank": "1"}),
        (Contestant, {"standings__rating__gt": "1000"}),
        (Study, {"snapshots__votes_counted__gt": "1"}),
        (Study, {"matchups__votes__outcome": "left"}),
        (Matchup, {"votes__outcome": "left"}),
        (User, {"votes__outcome": "left"}),
    ],
)
def test_no_list_can_be_filtered_by_what_it_does_not_show(
    model: Any, asked: dict[str, str]
) -> None:
    voted()
    assert rows_of(signed_in(people()["admin"]), model, **asked) is None


def test_no_search_and_no_filter_finds_a_vote_of_an_open_study() -> None:
    voted()
    office = signed_in(people()["admin"])
    vote = Vote.objects.all()[0]
    for asked in (
        {"outcome__exact": vote.outcome},
        {"is_simulated__exact": "0"},
        {"expert": str(vote.expert_id)},
        {"q": "eva"},
        {"at__year": str(vote.at.year)},
        {"_facets": "True"},
    ):
        assert rows_of(office, Vote, **asked) == 0, asked


def test_the_page_that_refuses_to_delete_lists_no_ranks() -> None:
    voted()
    office = signed_in(people()["admin"])
    first = Standing.objects.get(slug="ann")
    assert str(first) == f"{first.rank} ann"
    page = office.get(address(Contestant, "delete", first.contestant_id))
    assert page.status_code == 403


def test_every_class_of_the_admin_refuses_such_filters() -> None:
    for model, found in admin.site._registry.items():
        backwards = [one.name for one in model._meta.related_objects]
        for name in backwards:
            assert not found.lookup_allowed(f"{name}__pk", "1", None), (model, name)  # type: ignore[arg-type]
