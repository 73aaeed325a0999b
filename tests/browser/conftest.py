"""One browser, and a booth: a study with pictures, its expert, and pages to vote on.

The product runs in this process, so that a test can look into its rows.
"""

from collections.abc import Iterator

import pytest
from django.conf import settings
from playwright.sync_api import Browser, expect
from pytest_django.live_server_helper import LiveServer

from arena.models import Study
from tests.browser.booth import Booth, furnish
from tests.browser.chromium import PATIENCE_MS, chromium


@pytest.fixture(scope="session", autouse=True)
def _static_folder() -> None:
    """What a fresh checkout lacks until something is collected; the server warns without it."""
    settings.STATIC_ROOT.mkdir(parents=True, exist_ok=True)


@pytest.fixture(scope="session", autouse=True)
def _patience() -> None:
    expect.set_options(timeout=PATIENCE_MS)


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    """One Chromium for all of these tests."""
    with pytest.MonkeyPatch.context() as patch, chromium() as started:
        # Playwright keeps an event loop in this thread, where Django would refuse to read rows.
        patch.setenv("DJANGO_ALLOW_ASYNC_UNSAFE", "true")
        yield started


@pytest.fixture
def bare_booth(live_server: LiveServer, browser: Browser) -> Iterator[Booth]:
    """A booth whose study the test brings, or that visits other pages."""
    made = Booth(address=live_server.url, browser=browser, study=Study())
    yield made
    made.leave()


@pytest.fixture
def booth(bare_booth: Booth) -> Booth:
    bare_booth.study = furnish()
    return bare_booth
