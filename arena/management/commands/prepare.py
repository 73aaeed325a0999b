"""`manage.py prepare`: bring tables, files and texts up to date; again, it changes nothing."""

from typing import Any

from django.conf import settings
from django.core.management import call_command

from arena.management.catalogue import compile_catalogue
from arena.scenarios.services import redraw_pictures
from augment.services.endpoints.contestants import ensure_builtin
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """What has to be done once after every update, before anything is served."""

    help = (
        "Apply migrations, add contestants that ask no model, collect the static files, compile "
        "the German texts, redraw pictures of earlier versions."
    )

    def handle(self, *args: Any, **options: Any) -> None:
        """Apply and collect."""
        call_command("migrate", interactive=False, verbosity=0)
        ensure_builtin()
        settings.STATIC_ROOT.mkdir(parents=True, exist_ok=True)
        call_command("collectstatic", interactive=False, verbosity=0)
        compile_catalogue()
        for slug, drawn in redraw_pictures():
            self.stdout.write(f"Pictures of {slug} that were drawn anew: {drawn}")
