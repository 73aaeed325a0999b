"""Whatever is made or edited in Django's admin, every page goes on answering."""

from __future__ import annotations

from typing import Any

import pytest
from django.contrib import admin
from django.contrib.auth.models import Group, User
from django.test import Client
from django.urls import reverse

from arena.studies.services.opening import close_study
from augment.models import Contestant, Scenario
from tests.web.cast import people, signed_in, world

pytestmark = pytest.mark.django_db


def fields_of(page: Any) -> dict[str, Any]:
    """What the form of an admin page would send if nobody touched it."""
    form = page.context["adminform"].form
    forms = [form]
    for formset in page.context["inline_admin_formsets"]:
        forms += [formset.formset.management_form, *formset.formset.forms]
    sent: dict[str, Any] = {}
    for one in forms:
        for field in one:
            value = field.value()
            if value is None or value is False:
                continue
            if isinstance(value, list):
                value = [getattr(item, "pk", item) for item in value]
            sent[field.html_name] = value
    return sent


def edit(office: Client, row: Any, **changes: Any) -> None:
    """Change a row by its form; what can't be edited stays."""
    meta = row._meta
    address = reverse(f"admin:{meta.app_label}_{meta.model_name}_change", args=[row.pk])
    sent = fields_of(office.get(address)) | changes
    kept = {name: value for name, value in sent.items() if value is not None}
    answer = office.post(address, kept)
    assert answer.status_code == 302, answer.context["errors"]


def test_names_that_plans_and_roles_hang_on_stay() -> None:
    here, roles = world(), people()
    office = signed_in(roles["admin"])
    eva = User.objects.get(username="eva")
    edit(office, eva, username="eve")
    edit(office, Group.objects.get(name="expert"), name="judge")
    assert User.objects.filter(username="eva").exists()
    assert Group.objects.filter(name="expert").exists()
    kept = [eva, eva.person, Group.objects.get(name="expert"), Contestant.objects.get(slug="ann")]
    kept += [Scenario.objects.all()[0], Scenario.objects.all()[0].base_scene]
    for row in kept:
        name = f"admin:{row._meta.app_label}_{row._meta.model_name}"
        gone = reverse(f"{name}_delete", args=[row.pk])
        assert office.post(gone, {"post": "yes"}).status_code == 403, name
        several = {"action": "delete_selected", "_selected_action": [row.pk], "post": "yes"}
        office.post(reverse(f"{name}_changelist"), several)
        assert type(row)._default_manager.filter(pk=row.pk).exists(), name
    assert here.study.experts.filter(pk=eva.pk).exists()


def test_every_list_and_every_row_of_arena_can_be_opened() -> None:
    here = world()
    close_study(study=here.study)
    office = signed_in(people()["admin"])
    for model in admin.site._registry:
        if model._meta.app_label not in ("arena", "auth"):
            continue
        name = f"admin:{model._meta.app_label}_{model._meta.model_name}"
        assert office.get(reverse(f"{name}_changelist"), {"q": "x"}).status_code == 200, name
        for row in model._default_manager.all()[:1]:
            assert office.get(reverse(f"{name}_change", args=[row.pk])).status_code == 200, name
