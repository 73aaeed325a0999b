"""The demo refuses numbers that make no sense before it does anything."""

import pytest
from django.core.management import CommandError

from arena.management.commands.demo import Command


@pytest.mark.parametrize(
    ("option", "given", "says"),
    [
        ("--per-type", "-1", "1 or more is needed, not -1"),
        ("--per-type", "0", "1 or more is needed, not 0"),
        ("--per-type", "few", "'few' is no whole number"),
    ],
)
def test_a_number_that_makes_no_sense_is_refused(option: str, given: str, says: str) -> None:
    parser = Command().create_parser("manage.py", "demo")
    parser.called_from_command_line = False
    with pytest.raises(CommandError, match=says):
        parser.parse_args([f"{option}={given}"])
