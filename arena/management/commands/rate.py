"""manage.py rate: freeze a rating of a study and print it."""

from typing import Any

from arena.results.exports.tables import leaderboard_table
from arena.results.exports.writers import plain_text
from arena.results.services.rating_request import RatingRequest
from arena.results.services.ratings import log_early_look
from arena.results.services.ratings import rate_now as rate
from arena.studies.queries import study_named
from augment.services import TerminalCommand, read_request


class Command(TerminalCommand):
    """Entry point of arena.results.services.ratings.rate_now."""

    help = "Rate the contestants of a study by its votes and keep the result."

    arguments = {
        "study": {"help": "its name or its code"},
        "--early": {"action": "store_true", "help": "rate an open study; this is logged"},
    }
    request = RatingRequest

    def handle(self, *args: Any, **options: Any) -> None:
        """Rate, then print the table."""
        study = study_named(options["study"])
        choices = read_request(RatingRequest, options).choices()
        choices |= {"early": options["early"]}
        snapshot = rate(study=study, **choices)
        if snapshot.is_early:
            log_early_look(study=study, actor=None, what="rating, printed")
        self.stdout.write(plain_text(leaderboard_table(snapshot)))
