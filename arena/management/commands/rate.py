"""manage.py rate: freeze a rating of a study and print it."""

from typing import Any

from arena.rating.rules import Intervals, Unit
from arena.results.exports.tables import leaderboard_table
from arena.results.exports.writers import plain_text
from arena.results.queries.votes import Filters
from arena.results.services.ratings import DEFAULT_ROUNDS, log_early_look
from arena.results.services.ratings import rate_now as rate
from arena.studies.queries import study_named
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """The door to arena.results.services.ratings.rate."""

    help = "Rate the contestants of a study by its votes and keep the result."

    arguments = {
        "study": {"help": "its name or its code"},
        "--method": {"default": "bt", "help": "bt (Bradley-Terry), davidson or elo"},
        "--rounds": {"type": int, "default": DEFAULT_ROUNDS, "help": "of the bootstrap"},
        "--seed": {"type": int, "default": 0},
        "--resample": {
            "choices": [unit.value for unit in Unit],
            "help": "what is resampled: vote (the paper's), scenario, expert or two-way; two-way "
            "where votes name experts and scenarios, unless given",
        },
        "--intervals": {
            "choices": [interval.value for interval in Intervals],
            "help": "closed (form, the default where votes hang together) or resamples",
        },
        "--leave-out-own": {
            "action": "store_true",
            "help": "votes of authors on their own contestants do not count",
        },
        "--early": {"action": "store_true", "help": "rate an open study; this is logged"},
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Rate, then print the table."""
        study = study_named(options["study"])
        snapshot = rate(
            study=study,
            method=options["method"],
            rounds=options["rounds"],
            seed=options["seed"],
            unit=options["resample"],
            intervals=options["intervals"],
            filters=Filters(leave_out_own=options["leave_out_own"]),
            early=options["early"],
        )
        if snapshot.is_early:
            log_early_look(study=study, actor=None, what="rating, printed")
        self.stdout.write(plain_text(leaderboard_table(snapshot)))
