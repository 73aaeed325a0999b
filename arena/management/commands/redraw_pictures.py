"""`manage.py redraw_pictures`: what an earlier version drew, in the window of this one."""

from __future__ import annotations

from typing import Any

from arena.services.redrawing import redraw_pictures
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """Draw pictures of an earlier look anew; a second run changes nothing."""

    help = "Draw pictures that an earlier version drew anew, but for those of open studies."

    def handle(self, *args: Any, **options: Any) -> None:
        """Draw, and say what."""
        for picture in redraw_pictures():
            if picture.needed_by:
                self.stdout.write(
                    f"{picture.scenario}: kept, the study '{picture.needed_by}' is open and "
                    "shows them"
                )
            else:
                self.stdout.write(f"{picture.scenario}: {picture.pictures} drawn anew")
