"""Who is signed in comes with the roles, by two queries."""

import pytest
from django.contrib.auth.models import Group, User
from pytest_django import DjangoAssertNumQueries

from arena.people.queries import AccountBackend, has_admin
from arena.people.services import create_person
from arena.shell.accounts import top_role

pytestmark = pytest.mark.django_db


@pytest.mark.parametrize("role", ["expert", "researcher"])
def test_an_account_comes_with_its_role_by_two_queries(
    role: str, django_assert_num_queries: DjangoAssertNumQueries
) -> None:
    person = create_person(username="eva", password=None, role=role)
    with django_assert_num_queries(2):
        found = AccountBackend().get_user(person.pk)
        assert found == person
        assert top_role(found) == role


def test_of_several_roles_the_most_powerful_counts() -> None:
    person = create_person(username="eva", password=None, role="expert")
    person.groups.add(Group.objects.get_or_create(name="researcher")[0])
    found = AccountBackend().get_user(person.pk)
    assert top_role(found) == "researcher"


def test_an_account_that_is_gone_or_not_active_is_nobody() -> None:
    person = create_person(username="eva", password=None, role="expert")
    person.is_active = False
    person.save()
    assert AccountBackend().get_user(person.pk) is None
    assert AccountBackend().get_user(person.pk + 1) is None
    assert top_role(person) is None


def test_a_paused_admin_administrates_nothing() -> None:
    admin = create_person(username="ada", password=None, role="admin")
    assert has_admin()
    User.objects.filter(pk=admin.pk).update(is_active=False)
    assert not has_admin()
