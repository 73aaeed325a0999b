"""manage.py check_stopping: take the looks of stopping rules that are due."""

from __future__ import annotations

from typing import Any

from arena.services.looks import stopping_progress, take_due_looks
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """The door to arena.services.looks.take_due_looks."""

    help = (
        "Take the looks of stopping rules that are due, as workers do by themselves; says how "
        "wide intervals were and whether a rule is met, nothing of results."
    )

    def handle(self, *args: Any, **options: Any) -> None:
        """Look, and say at what."""
        looked = take_due_looks()
        for study in looked:
            study.refresh_from_db()
            found = stopping_progress(study)
            look = study.looks[-1]
            wide = "open" if look["widest"] is None else f"±{look['widest']:.0f}"
            self.stdout.write(
                f"{study.name}: look {len(study.looks)} at {look['votes']} votes, widest interval "
                f"{wide}; the rule is {'met' if found and found.is_met else 'not met'}, the study "
                f"is {study.state}."
            )
        if not looked:
            self.stdout.write("No look is due.")
