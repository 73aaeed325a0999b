from __future__ import annotations

import pytest
from django.contrib.auth.models import User
from django.core.management import call_command
from django.test import Client

from arena.services.people import create_person

pytestmark = pytest.mark.django_db


def test_an_account_made_elsewhere_is_a_person_too(client: Client) -> None:
    call_command("createsuperuser", username="root", email="", interactive=False, verbosity=0)
    root = User.objects.get(username="root")
    assert root.person.pseudonym.startswith("Person ")
    client.force_login(root)
    assert client.get("/").status_code == 200


def test_an_account_without_a_role_is_told_so(client: Client) -> None:
    client.force_login(User.objects.create_user("nobody"))
    assert client.get("/").status_code == 200


def test_a_role_numbers_its_pseudonyms() -> None:
    first = create_person(username="ada", password=None, role="expert")
    second = create_person(username="grace", password=None, role="expert")
    assert (first.person.pseudonym, second.person.pseudonym) == ("Expert 1", "Expert 2")
