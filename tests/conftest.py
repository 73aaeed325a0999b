"""What every test shares: recorded data by its variable, and no key of anybody's."""

import os
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from django.conf import settings
from django.db import connection
from django.test import override_settings
from django.utils import translation
from hypothesis import settings as hypothesis_settings
from xdist.scheduler import LoadScopeScheduling

import tests.properties  # noqa: F401
from arena.management.commands.prepare import compile_catalogue
from arena.models import Study
from augment.fake_llm.server import FakeServer, running
from augment.services.judging import compute_once
from tests.append_only import empty_with_triggers
from tests.brokers import MEMORY, NOWHERE, Broker, broker_at
from tests.intents import known
from tests.on_postgres import FILES
from tests.processes import MIGRATED, copy_database, machine
from tests.stack import SMALL_DEMO, Home
from tests.study_rows import a_study

GROUPS = {
    "tests/journeys/test_demo": "demo_home",
    "tests/browser/": "browser",
    "tests/results/test_every_number": "every_number",
}
"""Files that share a fixture which takes long to make: they run in one process, in this order of
what a test's address begins with."""

hypothesis_settings.load_profile("fixed")  # registered by tests.properties


class Grouped(LoadScopeScheduling):  # type: ignore[misc] # it has no types
    """Sends a group, and any other file, to one process: what it has made once serves all of it.

    xdist_group marks do nothing with pytest 9: the address of a test can't be written any more.
    """

    def _split_scope(self, nodeid: str) -> str:
        fitting = (group for start, group in GROUPS.items() if nodeid.startswith(start))
        return next(fitting, nodeid.partition("::")[0])


def pytest_configure() -> None:
    compile_catalogue()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadScopeScheduling | None:
    config.option.loadscopereorder = False  # in the order of the tests, not by their number
    return Grouped(config, log) if config.getoption("dist") == "loadgroup" else None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    # What takes long starts first, so that no worker is left alone with it in the end.
    items.sort(key=lambda item: not _takes_long(item))
    for item in items:
        file = str(item.path.relative_to(Path(__file__).parent).with_suffix(""))
        is_about_sqlite = item.get_closest_marker("sqlite") is not None
        if file in FILES and item.get_closest_marker("django_db") and not is_about_sqlite:
            item.add_marker(pytest.mark.postgres)


def _takes_long(item: pytest.Item) -> bool:
    return item.get_closest_marker("slow") is not None or item.nodeid.startswith(tuple(GROUPS))


@pytest.fixture(scope="session")
def server() -> Iterator[FakeServer]:
    """The stand-in, which knows the catalogue; its slow model takes longer than any test."""
    with running(slow_s=3600.0, known=known) as serving:
        yield serving


@pytest.fixture
def study() -> Study:
    """An open study of three contestants, six scenarios and two experts."""
    return a_study()


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
def _own_language() -> Iterator[None]:
    """A request in German leaves its thread speaking German; no other test may notice."""
    yield
    translation.deactivate()


@pytest.fixture(scope="session", autouse=True)
def _charts_drawn_once() -> Iterator[None]:
    """A chart of the same content is drawn once for all tests; each stores it as if it drew it."""
    drawn: dict[str, bytes] = {}

    def draw(suffix: str, compute: Callable[[], bytes], *parts: object) -> bytes:
        def compute_first() -> bytes:
            key = repr((suffix, *parts))
            if key not in drawn:
                drawn[key] = compute()
            return drawn[key]

        return compute_once(suffix, compute_first, *parts)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("arena.exports.drawing.compute_once", draw)
        yield


@pytest.fixture(scope="session", autouse=True)
def _quick_settings(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Static files need no collecting, passwords no strength, pictures a folder of the run."""
    with override_settings(
        MEDIA_ROOT=tmp_path_factory.mktemp("media"),
        STORAGES={
            **settings.STORAGES,
            "staticfiles": {"BACKEND": "django.contrib.staticfiles.storage.StaticFilesStorage"},
        },
        WHITENOISE_AUTOREFRESH=True,
        PASSWORD_HASHERS=["django.contrib.auth.hashers.MD5PasswordHasher"],
    ):
        yield


@pytest.fixture(autouse=True)
def _own_pictures(request: pytest.FixtureRequest) -> Iterator[None]:
    """Pictures of rows go to a folder of the test's own."""
    if request.node.get_closest_marker("django_db") is None:
        yield
        return
    with override_settings(MEDIA_ROOT=request.getfixturevalue("tmp_path") / "media"):
        yield


@pytest.fixture(scope="session")
def django_db_setup(django_db_setup: None, tmp_path_factory: pytest.TempPathFactory) -> None:
    """The database of the tests; on SQLite a copy is kept of what it is before any test."""
    empty_with_triggers()
    database = connection.settings_dict
    is_made = database["NAME"] == database["TEST"]["NAME"]  # only where some test asks for it
    if is_made and connection.vendor == "sqlite":
        _start_keys_apart(Path(database["NAME"]))
        copy_database(Path(database["NAME"]), tmp_path_factory.getbasetemp() / MIGRATED)


def _start_keys_apart(database: Path) -> None:
    """Start each table's keys at thousands of its own, as if many tests had come before.

    Otherwise a test that needs small keys, or takes one table's for another's, passes by luck.
    """
    with closing(sqlite3.connect(database)) as direct, direct:
        kept = "SELECT name FROM sqlite_schema WHERE sql LIKE '%AUTOINCREMENT%' ORDER BY name"
        for place, (table,) in enumerate(direct.execute(kept).fetchall(), start=1):
            direct.execute("DELETE FROM sqlite_sequence WHERE name = ?", [table])
            direct.execute("INSERT INTO sqlite_sequence VALUES (?, ?)", [table, 1_000 * place])


@pytest.fixture(scope="session")
def migrated(django_db_setup: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An empty, migrated SQLite file; what changes it takes a copy."""
    kept = tmp_path_factory.getbasetemp() / MIGRATED
    if not kept.exists():
        with machine() as made:
            copy_database(made.database, kept)
    return kept


@pytest.fixture(scope="session")
def demo_home(tmp_path_factory: pytest.TempPathFactory) -> Home:
    """What a small `make demo SERVE=0` leaves behind; tests that change it take a copy."""
    home = Home.at(tmp_path_factory.mktemp("demo"))
    (home.folder / "demo.log").write_text(home.must(*SMALL_DEMO))
    return home


@pytest.fixture
def broker() -> Iterator[Broker]:
    """A broker in memory, with nothing waiting."""
    with broker_at(MEMORY):
        made = Broker()
        made.purge()
        yield made
    with broker_at(MEMORY):  # the test may have looked elsewhere meanwhile
        made.purge()


@pytest.fixture
def no_broker() -> Iterator[None]:
    """An address where nobody listens."""
    with broker_at(NOWHERE):
        yield
