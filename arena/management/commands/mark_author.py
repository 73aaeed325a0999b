"""manage.py mark_author: say who made which contestant of a study."""

from typing import Any

from django.contrib.auth.models import User

from arena.models import Study
from arena.people.links import mark_author, take_back_author
from arena.studies.queries import study_named
from augment.errors import UnknownName
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """The door to arena.people.services."""

    help = "Mark an expert of a study as author of a contestant; experts see nothing of it."

    arguments = {
        "study": {"help": "its name or its code"},
        "expert": {"metavar": "USERNAME"},
        "contestant": {"metavar": "SLUG"},
        "--take-back": {"action": "store_true", "help": "forget it again; the log keeps both"},
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Mark or take back, and say so."""
        username, slug = options["expert"], options["contestant"]
        study = study_named(options["study"])
        expert = _expert(study, username)
        if options["take_back"]:
            _check_contestant(study, slug)
            for row in study.authorships.filter(expert=expert, contestant__slug=slug):
                take_back_author(authorship=row)
        else:
            mark_author(study=study, expert=expert, contestant=slug)
        state = "not marked" if options["take_back"] else "marked"
        self.stdout.write(f"{username} is {state} as author of {slug}.")


def _check_contestant(study: Study, slug: str) -> None:
    known = list(study.contestants.order_by("slug").values_list("slug", flat=True))
    if slug not in known:
        raise UnknownName("contestant", slug, known)


def _expert(study: Study, username: str) -> User:
    expert = study.experts.filter(username=username).first()
    if expert is None:
        known = study.experts.order_by("username").values_list("username", flat=True)
        raise UnknownName("expert", username, list(known))
    return expert
