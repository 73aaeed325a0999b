"""`manage.py invite`: links for the experts of a study."""

from typing import Any

from arena.people.links import LINK_LIVES, make_link_path
from arena.serving.stack import Web
from arena.studies.queries import expert_lines, expert_named, study_named
from augment.services import TerminalCommand


class Command(TerminalCommand):
    """Make links for the experts of a study."""

    help = (
        "Print a link for every expert of a study who has none that works; each is shown once. "
        "A link for a named expert replaces the one before."
    )

    arguments = {
        "study": {"help": "name or code"},
        "--experts": {"nargs": "+", "metavar": "USERNAME", "help": "all by default"},
        "--address": {
            "default": Web().address,
            "help": "of the pages, as experts reach it; default: %(default)s",
        },
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Make the links and print them."""
        study = study_named(options["study"])
        if options["experts"]:
            chosen = [expert_named(study, username) for username in options["experts"]]
        else:
            chosen = [
                line.tally.expert
                for line in expert_lines(study)
                if line.may_be_invited and not line.has_live_link
            ]
        made = [(expert, make_link_path(expert, study=study)) for expert in chosen]
        for expert, path in made:
            name = f"{expert.username} ({expert.person.pseudonym})"
            self.stdout.write(f"{name}: {options['address'].rstrip('/')}{path}")
        if made:
            self.stdout.write(f"Each works for {LINK_LIVES.days} days and is not shown again.")
        else:
            self.stdout.write("Every expert has a link that works; no link was made.")
