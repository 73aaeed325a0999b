"""Add scenarios with numbers drawn from the ranges of one's intent."""

from typing import Any

from augment.services.driving.sweeps import add_family
from augment.services.scenarios.scenes import scenario_named
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """sample_family SCENARIO COUNT [--seed N]."""

    help = (
        "Draw a number from each range of a scenario's intent, so many times, and add each draw "
        "as a scenario with exact numbers and the rule placer's reference."
    )
    arguments = {
        "scenario": {"help": "its slug"},
        "count": {"type": int, "help": "how many are drawn"},
        "--seed": {"type": int, "default": 0, "help": "the same for the same draws"},
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Add them, and say which fit nowhere."""
        scenario = scenario_named(options["scenario"])
        rows, refused = add_family(scenario=scenario, count=options["count"], seed=options["seed"])
        for row in rows:
            self.stdout.write(f"{row.slug}: {row.instruction}")
        for member in refused:
            self.stdout.write(f"Refused: {member.refusal}")
