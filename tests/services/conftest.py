"""A small study and one of its experts, for tests of services."""

from pathlib import Path

import pytest
from django.contrib.auth.models import User
from pytest_django import Settings

from arena.models import Study


@pytest.fixture
def eva(study: Study) -> User:
    return User.objects.get(username="eva")


@pytest.fixture
def own_folders(tmp_path: Path, settings: Settings) -> None:
    settings.MEDIA_ROOT = tmp_path / "media"
    settings.VAR_DIR = tmp_path / "var"
    (tmp_path / "var").mkdir()
