"""Whatever is made or edited in Django's admin, every page goes on answering."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from sqlite3 import connect
from typing import Any

import pytest
from django.contrib import admin
from django.contrib.auth.models import Group, User
from django.test import Client
from django.urls import reverse

from arena.models import Person
from arena.services.faults import open_labelling
from arena.services.studies import close_study
from augment.models import Contestant, Endpoint, EndpointModel, Event, Scenario
from tests.jobs.rows import add_model
from tests.web.cast import World, people, signed_in, world

pytestmark = pytest.mark.django_db

ODD = "%(name)s %s {{ x }} <b>“é”"
LISTS = ("home", "jobs", "job-new", "scenarios", "studies", "study-new")
OF_STUDY = ("study", "experts", "results", "results-tab", "results-votes")
OF_JOB = ("job", "faults", "displacement-export", "faults-export")
EXPERT_PAGES = ("home", "vote", "vote-help")

Act = Callable[[Client, World], None]


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


def add_account(office: Client, username: str) -> User:
    sent = {"username": username, "usable_password": "false"}
    assert office.post(reverse("admin:auth_user_add"), sent).status_code == 302
    return User.objects.get(username=username)


def with_groups(name: str, *groups: str, **more: Any) -> Act:
    def act(office: Client, here: World) -> None:
        keys = list(Group.objects.filter(name__in=groups).values_list("pk", flat=True))
        edit(office, add_account(office, name), groups=keys, **more)

    return act


def of_eva(**changes: Any) -> Act:
    def act(office: Client, here: World) -> None:
        groups = changes.pop("groups", None)
        if groups is not None:
            keys = Group.objects.filter(name__in=groups).values_list("pk", flat=True)
            changes["groups"] = list(keys)
        edit(office, User.objects.get(username="eva"), **changes)

    return act


def odd_pseudonym(office: Client, here: World) -> None:
    edit(office, Person.objects.get(user__username="finn"), pseudonym=ODD)


def odd_contestant(office: Client, here: World) -> None:
    edit(office, Contestant.objects.get(slug="ann"), name=f"{ODD} ".ljust(120, "x"))


def odd_scenario(office: Client, here: World) -> None:
    edit(office, Scenario.objects.all()[0], catalogue_set="paper")


def model_fields(row: EndpointModel, **values: Any) -> dict[str, Any]:
    return {f"models-0-{name}": value for name, value in {"id": row.pk, **values}.items()}


def endpoint_of_llama() -> Endpoint:
    endpoint, made = Endpoint.objects.get_or_create(
        label="local", defaults={"base_url": "http://127.0.0.1:9/v1"}
    )
    if made:
        EndpointModel.objects.create(endpoint=endpoint, model="llama")
        add_model("llama", endpoint=endpoint, model="llama")
    return endpoint


def odd_model(office: Client, here: World) -> None:
    endpoint = endpoint_of_llama()
    row = endpoint.models.get()
    odd = {"context_tokens": 1, "max_output_tokens": 4_000_000, "reasoning_effort": ODD[:20]}
    edit(office, endpoint, **model_fields(row, **odd))


def free_of_charge(office: Client, here: World) -> None:
    endpoint = endpoint_of_llama()
    price = {"price_in_usd": 0, "price_out_usd": 0, "price_source": ODD}
    row = endpoint.models.get()
    edit(office, endpoint, **model_fields(row, price_as_of="2026-01-01", **price))


def renamed_model(office: Client, here: World) -> None:
    endpoint = endpoint_of_llama()
    edit(office, endpoint, **model_fields(endpoint.models.get(), model=ODD))


def dropped_model(office: Client, here: World) -> None:
    endpoint = endpoint_of_llama()
    edit(office, endpoint, **model_fields(endpoint.models.get(), DELETE="on"))
    assert not endpoint.models.exists()


def new_endpoint(office: Client, here: World) -> None:
    sent = {
        "label": "far",
        "base_url": "https://[2001:db8::1]:8443/a%20b",
        "max_concurrency": 1,
        "models-TOTAL_FORMS": 1,
        "models-INITIAL_FORMS": 0,
        "models-0-model": ODD,
    }
    assert office.post(reverse("admin:augment_endpoint_add"), sent).status_code == 302


def other_group(office: Client, here: World) -> None:
    assert office.post(reverse("admin:auth_group_add"), {"name": ODD}).status_code == 302
    keys = list(Group.objects.values_list("pk", flat=True))
    edit(office, add_account(office, "everything"), groups=keys)


EDITS: dict[str, Act] = {
    "an account without a role": with_groups("nobody"),
    "an expert": with_groups("new-expert", "expert"),
    "an expert with the longest name": with_groups("a@.+-_" * 25, "expert", first_name=ODD),
    "an analyst": with_groups("new-analyst", "analyst"),
    "an admin by group alone": with_groups("new-admin", "admin"),
    "a clerk of the admin": with_groups("clerk", is_staff="on"),
    "an inactive expert": with_groups("gone", "expert", is_active=None),
    "every group at once, one of them no role": other_group,
    "a pseudonym with signs": odd_pseudonym,
    "a contestant's name with signs": odd_contestant,
    "a scenario in the catalogue": odd_scenario,
    "a model with odd limits": odd_model,
    "a model that costs nothing": free_of_charge,
    "a model by another name": renamed_model,
    "a model that is gone": dropped_model,
    "an endpoint with an odd address": new_endpoint,
    "an expert who is an analyst too": of_eva(groups=["expert", "analyst"]),
    "an expert without a role": of_eva(groups=[]),
    "an expert who left": of_eva(is_active=None),
    "an expert who became an admin": of_eva(is_active="on", is_superuser="on", is_staff="on"),
}


def addresses(here: World, names: tuple[str, ...]) -> list[str]:
    found = []
    for name in names:
        given: dict[str, Any] = {}
        if name in OF_JOB:
            given = {"code": here.job.code} | ({"form": "csv"} if "export" in name else {})
        elif name not in LISTS:
            given = {"code": here.study.code} | ({"tab": "table"} if "tab" in name else {})
        found.append(reverse(name, kwargs=given))
    return found


def broken_pages(client: Client, found: list[str]) -> list[str]:
    return [url for url in found if client.get(url).status_code >= 500]


def test_every_page_answers_whatever_is_made_in_the_admin() -> None:
    here, roles = world(), people()
    open_labelling(name="L", job=here.study.matchups.all()[0].left.job, experts=["eva"], seed=1)
    office = signed_in(roles["admin"])
    office.raise_request_exception = False
    for_staff = addresses(here, LISTS + OF_STUDY + OF_JOB)
    for_experts = addresses(here, EXPERT_PAGES)
    with_forms = addresses(here, ("study-new", "study", "faults", "job-new"))
    for name, act in EDITS.items():
        act(office, here)
        assert broken_pages(office, with_forms) == [], name
    finn = signed_in(User.objects.get(username="finn"))
    finn.raise_request_exception = False
    assert broken_pages(office, for_staff) == []
    assert broken_pages(finn, for_experts) == []
    for user in User.objects.filter(is_active=True):
        client = signed_in(user)
        client.raise_request_exception = False
        assert broken_pages(client, addresses(here, ("home", "vote", "study"))) == [], user


def test_who_is_made_in_the_admin_can_be_chosen_by_the_forms() -> None:
    office = signed_in(people()["admin"])
    with_groups("new-expert", "expert")(office, None)  # type: ignore[arg-type]
    account = User.objects.get(username="new-expert")
    assert account.person.pseudonym == f"Person {account.pk}"
    assert "new-expert" in office.get(reverse("study-new")).content.decode()
    logged = Event.objects.filter(object_code=str(account.person.code)).order_by("pk")
    assert [line.verb for line in logged] == ["add", "change"]
    assert [(line.after or {})["groups"] for line in logged] == [[], ["expert"]]


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


def test_the_roles_are_there_after_the_first_migration(migrated: Path) -> None:
    rows = connect(migrated).execute("SELECT name FROM auth_group ORDER BY name").fetchall()
    assert [name for (name,) in rows] == ["admin", "analyst", "expert"]


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
