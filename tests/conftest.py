"""What every test shares: recorded data by its variable, and no key of anybody's."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from pytest_django import Settings

from tests.stack import SMALL_DEMO, Home

ON_POSTGRES = {"api", "exports", "jobs", "services", "studies", "votes", "web"}
"""Folders whose tests are about rows: `make test` runs them on PostgreSQL as well."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        folder = item.path.relative_to(Path(__file__).parent).parts[0]
        if folder in ON_POSTGRES and item.get_closest_marker("django_db"):
            item.add_marker(pytest.mark.postgres)


@pytest.fixture(scope="session")
def realdata() -> Path:
    """The recorded scenes; without REALDATA_DIR a named skip, in CI a failure."""
    folder = os.environ.get("REALDATA_DIR")
    if not folder:
        if os.environ.get("CI"):
            pytest.fail("REALDATA_DIR is not set, and in CI nothing is skipped")
        pytest.skip("REALDATA_DIR is not set: recorded scenes are not here")
    path = Path(folder)
    assert path.is_dir(), f"REALDATA_DIR={folder} is not a folder"
    return path


@pytest.fixture(autouse=True)
def _no_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    """No test can spend anybody's money."""
    for name in ("OPENAI_API_KEY", "OPENAI_ORG_ID", "OPENAI_PROJECT_ID", "OPENAI_BASE_URL"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture(autouse=True)
def _own_files(settings: Settings, tmp_path: Path) -> None:
    """Pictures go to a folder of the test's own, static files need no collecting."""
    settings.MEDIA_ROOT = tmp_path / "media"
    settings.STORAGES = {
        **settings.STORAGES,
        "staticfiles": {"BACKEND": "django.contrib.staticfiles.storage.StaticFilesStorage"},
    }
    settings.WHITENOISE_AUTOREFRESH = True
    settings.PASSWORD_HASHERS = ["django.contrib.auth.hashers.MD5PasswordHasher"]


@pytest.fixture(scope="session")
def demo_home(tmp_path_factory: pytest.TempPathFactory) -> Home:
    """What a small `make demo SERVE=0` leaves behind; tests that change it take a copy."""
    home = Home.at(tmp_path_factory.mktemp("demo"))
    home.must(*SMALL_DEMO)
    return home
