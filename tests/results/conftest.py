"""One small study for all that checks its numbers."""

from typing import Any

import pytest
from django.conf import settings
from django.db import transaction
from django.test import override_settings

from tests.results.raw import Shown, a_rated_study


@pytest.fixture(scope="package")
def shown(django_db_setup: None, django_db_blocker: Any) -> Shown:
    # What tests/conftest.py sets for every test is not set yet.
    plain = {"BACKEND": "django.contrib.staticfiles.storage.StaticFilesStorage"}
    files = override_settings(
        WHITENOISE_AUTOREFRESH=True, STORAGES={**settings.STORAGES, "staticfiles": plain}
    )
    with django_db_blocker.unblock(), files, transaction.atomic():
        found = a_rated_study()
        transaction.set_rollback(True)
    return found
