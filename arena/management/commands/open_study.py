"""manage.py open_study: plan a study and open it."""

from __future__ import annotations

from collections import Counter
from typing import Any

from django.core.management.base import CommandError, CommandParser

from arena.errors import ArenaError
from arena.models import Study
from arena.pairing.target_lines import read_targets
from arena.queries.coverage import shared_units
from arena.queries.inventory import CHECK_PERCENT, usual_checks
from arena.services.preregistration import preregistration_sha256
from arena.services.shown_pictures import SampleRule
from arena.services.studies import PlanOptions, open_study
from augment.errors import AugmentError
from augment.services.running.choosing import resolve_contestants, resolve_scenarios
from augment.services.terminal import TerminalCommand

SAMPLES = {
    "one": "of several samples one for each scenario, drawn by the seed",
    "all": "every sample, each on its own",
}


class Command(TerminalCommand):
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
            "--targets",
            nargs="+",
            default=[],
            metavar="TARGET",
            help='"SLUG=N": in how many votes a contestant appears; or "SLUG vs SLUG=N": votes '
            "of a pair; one for each",
        )
        parser.add_argument(
            "--repeats", type=float, default=5.0, metavar="PERCENT", help="hidden repeats"
        )
        parser.add_argument(
            "--checks",
            type=float,
            default=None,
            metavar="PERCENT",
            help="attention checks, with pictures that draw_checks has drawn (default: "
            f"{CHECK_PERCENT} where it has drawn any, else 0)",
        )
        parser.add_argument(
            "--overlap",
            type=float,
            default=0.0,
            metavar="PERCENT",
            help="of the judged pairs, those that two experts or more judge at least, so that "
            "their agreement can be computed (at most 80)",
        )
        parser.add_argument(
            "--adaptive",
            type=float,
            default=0.0,
            metavar="PERCENT",
            help="the last share of the votes, planned in batches by the votes before",
        )
        parser.add_argument(
            "--both-miss",
            action="store_true",
            help="let experts add to Equal that both miss the instruction",
        )
        parser.add_argument(
            "--text",
            action="store_true",
            help="let experts read a text description of what was changed",
        )
        self._add_aims(parser)
        self._add_picture_arguments(parser)

    def _add_aims(self, parser: CommandParser) -> None:
        """What is expected."""
        parser.add_argument(
            "--hypothesis",
            action="append",
            default=[],
            metavar="LINE",
            help='what is expected, frozen with the study; "SLUG above SLUG" is answered by the '
            "results; may be given several times",
        )

    def _add_picture_arguments(self, parser: CommandParser) -> None:
        """Whose pictures take part."""
        parser.add_argument(
            "--samples",
            choices=[one.value for one in SampleRule],
            default=SampleRule.ONE.value,
            help="where contestants were asked several times: one of each scenario, drawn by the "
            "seed, or all, each against the same sample of the others",
        )
        parser.add_argument(
            "--jobs",
            nargs="+",
            default=[],
            metavar="JOB",
            help="names or codes of the jobs whose augmentations are shown; default: all, the "
            "latest of each cell",
        )
        parser.add_argument(
            "--replay",
            action="store_true",
            help="let experts play the drives of both scenes under the pictures, where every "
            "picture of a scenario was driven",
        )
        parser.add_argument(
            "--no-measures",
            action="store_true",
            help="do not let experts lay lines and rings of what the instruction asks for over "
            "both pictures, nor read distances to lane edges under the ruler",
        )
        parser.add_argument(
            "--practice",
            action="store_true",
            help="let every expert practise on five pairs, a reference beside a broken picture, "
            "before the first pair of the study; nothing of it counts",
        )
        parser.add_argument(
            "--show-alike",
            action="store_true",
            help="also show pairs that differ by at most 0.15 m and 2 degrees in every object; "
            "without it they are settled as ties, but for a tenth that is shown as a check",
        )
        parser.add_argument(
            "--allow-simulated",
            action="store_true",
            help="let simulated contestants and experts take part; everything then says so",
        )

    def handle(self, *args: Any, **options: Any) -> None:
        """Open the study and say what was planned."""
        try:
            appearances, pair_votes = read_targets(options["targets"])
            study = open_study(
                name=options["name"],
                contestants=resolve_contestants(options["contestants"]),
                scenarios=resolve_scenarios(options["scenarios"]),
                experts=options["experts"],
                votes_per_expert=options["votes_per_expert"],
                seed=options["seed"],
                allow_simulated=options["allow_simulated"],
                options=PlanOptions(
                    repeat_share=options["repeats"] / 100,
                    check_share=self._checks(options["checks"]) / 100,
                    overlap_share=options["overlap"] / 100,
                    adaptive_share=options["adaptive"] / 100,
                    appearances=appearances,
                    pair_votes=pair_votes,
                    hypotheses=tuple(options["hypothesis"]),
                    allow_both_miss=options["both_miss"],
                    allow_text=options["text"],
                    settle_alike=not options["show_alike"],
                    allow_replay=options["replay"],
                    allow_measures=not options["no_measures"],
                    practice=options["practice"],
                    samples=SampleRule(options["samples"]),
                    jobs=tuple(options["jobs"]),
                ),
            )
        except (ArenaError, AugmentError) as error:
            raise CommandError(str(error)) from error
        self._say(study)

    def _checks(self, asked: float | None) -> float:
        """The percentage; without one it depends on what was drawn, and that is said."""
        if asked is not None:
            return asked
        usual = usual_checks()
        if not usual:
            self.stdout.write(
                "No attention checks: nobody has drawn pictures for them (manage.py draw_checks)."
            )
        return usual

    def _say(self, study: Study) -> None:
        rules = study.rules
        self.stdout.write(
            f"Opened {study.name!r} ({study.code}): {study.matchups.count()} matchups for "
            f"{len(rules['experts'])} experts."
        )
        self.stdout.write(f"Preregistration: sha256 {preregistration_sha256(study)}.")
        names = ", ".join(repr(job["name"]) for job in rules["jobs"])
        self.stdout.write(f"It shows augmentations of {names}; {SAMPLES[rules['samples']]}.")
        kinds = Counter(study.matchups.values_list("kind", flat=True))
        self.stdout.write(
            f"{kinds['main']} votes, {kinds['repeat']} hidden repeats, {kinds['check']} attention "
            f"checks; {sum(study.votes_to_plan.values())} votes are planned later."
        )
        judged, shared = shared_units(study)
        self.stdout.write(f"{shared} of {judged} pairs of a scenario are judged by two or more.")
        if rules["scenario_gap_kept"] < rules["scenario_gap"]:
            self.stdout.write(
                f"A scenario comes again after {rules['scenario_gap_kept']} others instead of "
                f"{rules['scenario_gap']}: there are too few scenarios for more."
            )
        if rules["identical"]:
            self.stdout.write(
                f"{len(rules['identical'])} pairs that nobody can tell apart are never shown."
            )
