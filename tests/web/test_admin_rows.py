"""Django's admin shows scenes and contestants, and nothing that tells how a study stands."""

from typing import Any

import pytest
from django.contrib import admin
from django.contrib.auth.models import User
from django.urls import reverse

from arena.models import Standing
from arena.results.services.ratings import rate_now as rate
from augment.models import Contestant, Scenario
from tests import study_rows
from tests.web.cast import people, signed_in, world

pytestmark = pytest.mark.django_db


def address(model: Any, what: str = "changelist", *args: object) -> str:
    name = f"admin:{model._meta.app_label}_{model._meta.model_name}_{what}"
    return reverse(name, args=args)


def test_nothing_of_people_and_studies_is_in_it() -> None:
    apps = {model._meta.app_label for model in admin.site._registry}
    assert "augment" in apps
    assert not apps & {"arena", "auth"}


def test_rows_that_plans_hang_on_stay() -> None:
    world()
    office = signed_in(people()["admin"])
    scenario = Scenario.objects.all()[0]
    for row in (Contestant.objects.get(slug="ann"), scenario, scenario.base_scene):
        gone = address(type(row), "delete", row.pk)
        assert office.post(gone, {"post": "yes"}).status_code == 403
        several = {"action": "delete_selected", "_selected_action": [row.pk], "post": "yes"}
        office.post(address(type(row)), several)
        assert type(row)._default_manager.filter(pk=row.pk).exists()


@pytest.mark.parametrize("asked", ["standings__rank", "standings__rating__gt"])
def test_no_list_can_be_filtered_by_what_it_does_not_show(asked: str) -> None:
    world()
    office = signed_in(people()["admin"])
    assert office.get(address(Contestant), {asked: "1"}).status_code != 200


def test_every_class_of_the_admin_refuses_such_filters() -> None:
    for model, page in admin.site._registry.items():
        if model._meta.app_label != "augment":
            continue
        for name in (related.name for related in model._meta.related_objects):
            assert not page.lookup_allowed(f"{name}__pk", "1", None), (model, name)  # type: ignore[arg-type]


def test_the_page_that_refuses_to_delete_lists_no_ranks() -> None:
    study = world().study
    study_rows.vote(study.matchups.all()[0], "left")
    rate(study=study, early=True, rounds=20)
    office = signed_in(User.objects.get(username=people()["admin"].username))
    key = Standing.objects.get(slug="ann").contestant_id
    assert office.get(address(Contestant, "delete", key)).status_code == 403
