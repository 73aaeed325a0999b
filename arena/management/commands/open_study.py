"""manage.py open_study: plan a study and open it."""

from __future__ import annotations

from typing import Any

from django.core.management.base import BaseCommand, CommandError, CommandParser

from arena.errors import ArenaError
from arena.services.studies import open_study
from augment.errors import AugmentError
from augment.services.choosing import chosen_contestants, chosen_scenarios


class Command(BaseCommand):
    """The door to arena.services.studies.open_study."""

    help = "Plan blind, balanced matchups for experts and open the study."

    def add_arguments(self, parser: CommandParser) -> None:
        """Who takes part, and the rules of the plan."""
        parser.add_argument("name", help="the study's name, unique")
        parser.add_argument("--contestants", nargs="+", required=True, metavar="SLUG")
        parser.add_argument("--scenarios", nargs="+", required=True, metavar="SLUG")
        parser.add_argument("--experts", nargs="+", required=True, metavar="USERNAME")
        parser.add_argument("--votes-per-expert", type=int, required=True, metavar="N")
        parser.add_argument("--seed", type=int, required=True, metavar="S")
        parser.add_argument(
            "--allow-simulated",
            action="store_true",
            help="let simulated contestants and experts take part; everything then says so",
        )

    def handle(self, *args: Any, **options: Any) -> None:
        """Open the study and say what was planned."""
        try:
            study = open_study(
                name=options["name"],
                contestants=chosen_contestants(options["contestants"]),
                scenarios=chosen_scenarios(options["scenarios"]),
                experts=options["experts"],
                votes_per_expert=options["votes_per_expert"],
                seed=options["seed"],
                allow_simulated=options["allow_simulated"],
            )
        except (ArenaError, AugmentError) as error:
            raise CommandError(str(error)) from error
        rules = study.rules
        self.stdout.write(
            f"Opened {study.name!r} ({study.code}): {study.matchups.count()} matchups for "
            f"{len(rules['experts'])} experts."
        )
        if rules["scenario_gap_kept"] < rules["scenario_gap"]:
            self.stdout.write(
                f"A scenario comes again after {rules['scenario_gap_kept']} others instead of "
                f"{rules['scenario_gap']}: there are too few scenarios for more."
            )
        if rules["identical"]:
            self.stdout.write(f"{len(rules['identical'])} identical pairs are never shown.")
