"""`manage.py add_person`: an account with a role."""

import getpass
import secrets
import sys
from typing import Any

from django.core.management.base import CommandError

from arena.people.services import create_person
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """Make an account of any role."""

    help = (
        "Make an account. The password is asked for; where nobody can be asked it is made up and "
        "printed once."
    )

    arguments = {
        "username": {},
        "--role": {"required": True, "help": "expert, entrant, researcher or admin"},
        "--pseudonym": {"help": "what others see; a numbered one by default"},
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Make the account."""
        asked = sys.stdin.isatty()
        password = getpass.getpass("Password: ") if asked else secrets.token_urlsafe(12)
        if not password:
            raise CommandError("An empty password is no password; nothing was made.")
        user = create_person(
            username=options["username"],
            password=password,
            role=options["role"],
            pseudonym=options["pseudonym"],
        )
        self.stdout.write(f"Made {options['role']} {user.username} ({user.person.pseudonym}).")
        if not asked:
            self.stdout.write(f"Password (shown once): {password}")
