"""`manage.py doctor`: what is wrong with this installation."""

import json
from dataclasses import asdict
from typing import Any

from django.core.management.base import CommandError

from arena.management.doctor import Ailment, Level, examine
from augment.services import TerminalCommand


class Command(TerminalCommand):
    """Look at every part and say what is wrong with it."""

    help = "Say what is wrong with this installation, and what to do. Ends with 1 where it is bad."
    requires_system_checks: list[str] = []

    arguments = {"--json": {"action": "store_true", "help": "for programs"}}

    def handle(self, *args: Any, **options: Any) -> None:
        """Examine and tell."""
        findings = examine()
        if options["json"]:
            self.stdout.write_data(json.dumps([asdict(finding) for finding in findings], indent=1))
            self.stdout.write_data("\n")
        else:
            for finding in findings:
                self._tell(finding)
        broken = sum(finding.level is Level.BROKEN for finding in findings)
        if broken:
            raise CommandError(f"{broken} broken." if broken > 1 else "One part is broken.")

    def _tell(self, finding: Ailment) -> None:
        self.stdout.write(f"{finding.level:9}{finding.part}: {finding.text}")
        if finding.remedy:
            self.stdout.write(f"         -> {finding.remedy}")
