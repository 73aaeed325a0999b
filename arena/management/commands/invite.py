"""`manage.py invite`: links for the experts of a study."""

from typing import Any

from django.urls import reverse
from django.utils import timezone

from arena.models import Study
from arena.people.links import LINK_LIVES, invite
from arena.serving.stack import Web
from arena.studies.queries import ExpertLine, expert_lines, study_named
from augment.errors import UnknownName
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """The door to arena.people.services.invite."""

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
        made = [
            (line, invite(study=study, expert=line.tally.expert))
            for line in _chosen(study, options["experts"])
        ]
        for line, fresh in made:
            path = reverse("invitation", args=[fresh.token])
            name = f"{line.tally.expert.get_username()} ({line.tally.pseudonym})"
            self.stdout.write(f"{name}: {options['address'].rstrip('/')}{path}")
        if made:
            self.stdout.write(f"Each works for {LINK_LIVES.days} days and is not shown again.")
        else:
            self.stdout.write("Every expert has a link that works; no link was made.")


def _chosen(study: Study, usernames: list[str] | None) -> list[ExpertLine]:
    lines = {
        line.tally.expert.get_username(): line for line in expert_lines(study, timezone.now())
    }
    if usernames is None:
        return [line for line in lines.values() if line.may_be_invited and not line.has_live_link]
    for username in usernames:
        if username not in lines:
            raise UnknownName("expert", username, sorted(lines))
    return [lines[username] for username in usernames]
