"""`manage.py prepare`: bring tables, files and texts up to date; again, it changes nothing."""

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path
from typing import Any

import polib
from django.conf import settings
from django.core.management import call_command
from django.db import connection
from django.utils import timezone

from arena.exports.files import write_whole
from arena.scenarios.services import redraw_pictures
from augment.errors import MediaFault
from augment.services import TerminalCommand
from augment.services.endpoints import ensure_builtin
from augment.services.judging import delete_computed

GERMAN = settings.BASE_DIR / "arena" / "locale" / "de" / "LC_MESSAGES" / "django.po"
"""The German texts of voters' pages."""
ADVISORY_LOCK = 7_264_101
"""Of PostgreSQL, per database; any number that nothing else on it uses."""


KEPT = timedelta(days=30)
"""Older charts and bootstraps are computed again; most are of numbers that have changed since."""


class Command(TerminalCommand):
    """Do once after every update what must precede serving."""

    help = (
        "Apply migrations, add contestants that ask no model, collect the static files, compile "
        "the German texts, redraw pictures of earlier versions, delete old charts and sessions."
    )

    def handle(self, *args: Any, **options: Any) -> None:
        """Apply and collect, one process after the other."""
        with _lock_database():
            call_command("migrate", interactive=False, verbosity=0)
            call_command("clearsessions")
            ensure_builtin()
            settings.STATIC_ROOT.mkdir(parents=True, exist_ok=True)
            call_command("collectstatic", interactive=False, verbosity=0)
            compile_catalogue()
            try:
                delete_computed(before=timezone.now() - KEPT)
            except (MediaFault, OSError) as fault:  # pages are served all the same
                self.stderr.write(f"Old charts stay: {fault}")
            for slug, drawn in redraw_pictures():
                self.stdout.write(f"Pictures of {slug} that were drawn anew: {drawn}")


def compile_catalogue() -> None:
    """Write the German texts to where Django looks; whoever reads meanwhile has a whole file."""
    target = settings.LOCALE_PATHS[0] / "de" / "LC_MESSAGES" / "django.mo"
    target.parent.mkdir(parents=True, exist_ok=True)
    write_whole(target, polib.pofile(str(GERMAN)).to_binary())


@contextmanager
def _lock_database() -> Iterator[None]:
    """Keep out every other `prepare` on this database; a killed one lets the next in."""
    if connection.vendor == "sqlite":
        with Path(f"{connection.settings_dict['NAME']}-prepare").open("a") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield
        return
    with connection.cursor() as cursor:
        cursor.execute("SELECT pg_advisory_lock(%s)", [ADVISORY_LOCK])
        try:
            yield
        finally:
            cursor.execute("SELECT pg_advisory_unlock(%s)", [ADVISORY_LOCK])
