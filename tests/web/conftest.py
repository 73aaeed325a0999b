"""Who looks at the pages: a client of one account per role."""

import pytest
from django.contrib.auth.models import User
from django.test import Client

from tests.web.cast import people, signed_in


@pytest.fixture
def accounts() -> dict[str, User]:
    return people()


@pytest.fixture
def admin(accounts: dict[str, User]) -> Client:
    return signed_in(accounts["admin"])


@pytest.fixture
def researcher(accounts: dict[str, User]) -> Client:
    return signed_in(accounts["researcher"])
