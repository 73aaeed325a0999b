"""`manage.py redraw_pictures`: what an earlier version drew, in the window of this one."""

from __future__ import annotations

from typing import Any

from arena.services.redrawing import redraw_pictures
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """Draw pictures of an earlier look anew; a second run changes nothing."""

    help = "Draw pictures anew that do not show today's window of their scenario."

    def handle(self, *args: Any, **options: Any) -> None:
        """Draw, and say what."""
        for found in redraw_pictures():
            (self.stderr if found.fault else self.stdout).write(found.says)
