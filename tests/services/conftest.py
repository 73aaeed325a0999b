"""A small study and one of its experts, for tests of services."""

from __future__ import annotations

import pytest
from django.contrib.auth.models import User

from arena.models import Study
from tests.study_rows import a_study


@pytest.fixture
def study() -> Study:
    return a_study()


@pytest.fixture
def eva(study: Study) -> User:
    return User.objects.get(username="eva")
