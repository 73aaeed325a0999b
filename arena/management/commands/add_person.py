"""`manage.py add_person`: an account with a role."""

import getpass
import secrets
import sys
from typing import Any

from django.core.management.base import CommandError

from arena.people.services import create_person
from augment.services import TerminalCommand


class Command(TerminalCommand):
    """Make an account of any role."""

    help = (
        "Make an account. Experts come in by a link and have no password. Else it is asked for; "
        "where nobody can be asked it is made up and printed once."
    )

    arguments = {
        "username": {},
        "--role": {"required": True, "help": "expert, entrant, researcher or admin"},
        "--pseudonym": {"help": "what others see; a numbered one by default"},
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Make the account."""
        is_expert, is_asked = options["role"] == "expert", sys.stdin.isatty()
        password = None
        if not is_expert:
            password = getpass.getpass("Password: ") if is_asked else secrets.token_urlsafe(12)
        if password == "":
            raise CommandError("An empty password is no password; nothing was made.")
        user = create_person(
            username=options["username"],
            password=password,
            role=options["role"],
            pseudonym=options["pseudonym"],
        )
        self.stdout.write(f"Made {options['role']} {user.username} ({user.person.pseudonym}).")
        if is_expert:
            self.stdout.write("Its link: People, or `manage.py invite STUDY` once it takes part.")
        elif not is_asked:
            self.stdout.write(f"Password (shown once): {password}")
