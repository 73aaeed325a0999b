"""The base of every command: it prints nothing that steers a terminal, and no traceback of ours.

Names come out of files and rows, and answers out of models; a control character in one of them
would move the cursor, recolour or rewrite what stands on the screen. So each text is escaped on
its way out, whoever wrote the command.
"""

from argparse import ArgumentTypeError
from collections.abc import Callable, Mapping
from typing import Any

from django.core.management.base import BaseCommand, CommandError, CommandParser, OutputWrapper
from django.db import OperationalError

from augment.errors import AugmentError
from augment.escaping import escape_controls
from augment.services.inputs import add_options, to_inputs


class TerminalOutput(OutputWrapper):
    """Standard output or error with control characters escaped."""

    def write(  # type: ignore[override]
        self,
        msg: str = "",
        style_func: Callable[[str], str] | None = None,
        ending: str | None = None,
    ) -> None:
        """Write the text with its control characters escaped."""
        super().write(escape_controls(msg), style_func, ending)

    def write_data(self, text: str) -> None:
        """Write a file's content, escaped only if this is a terminal."""
        if self.isatty():
            self.write(text, ending="")
        else:
            super().write(text, ending="")


class TerminalCommand(BaseCommand):
    """A command whose output is safe to look at, and whose foreseen errors are one sentence.

    Attributes:
        arguments: What argparse's `add_argument` takes, by the argument's name or flag.
        request: A dataclass of inputs, each of which becomes an option; None for none.
        failure: What that sentence begins with, such as "Nothing was restored.".
    """

    arguments: Mapping[str, Mapping[str, Any]] = {}
    request: type | None = None
    failure = ""

    def add_arguments(self, parser: CommandParser) -> None:
        """Add the arguments that the class lists."""
        for name, options in self.arguments.items():
            parser.add_argument(name, **options)
        if self.request is not None:
            add_options(parser, to_inputs(self.request))

    stdout: TerminalOutput
    stderr: TerminalOutput

    def __setattr__(self, name: str, value: Any) -> None:
        """Set an attribute; Django sets its streams again where it is called with some."""
        is_stream = name in ("stdout", "stderr")
        super().__setattr__(name, _wrap(value) if is_stream else value)

    def execute(self, *args: Any, **options: Any) -> str | None:
        """Run the command; an AugmentError ends it as a CommandError with the same sentence.

        So does a file or a disk that can't be used, and a database that is full, locked or gone.
        """
        try:
            return super().execute(*args, **options)
        except (AugmentError, OSError, OperationalError) as error:
            text = str(error)
            if isinstance(error, OperationalError):
                text = f"The database: {error}; `manage.py doctor` looks at all parts."
            elif isinstance(error, OSError) and error.strerror:
                text = f"{error.filename or ''}: {error.strerror}.".removeprefix(": ")
            raise CommandError(f"{self.failure} {text}".lstrip()) from error


def _wrap(stream: OutputWrapper) -> TerminalOutput:
    made = TerminalOutput(stream._out, ending=stream.ending)  # type: ignore[arg-type]
    made.style_func = stream.style_func
    return made


def at_least(least: int) -> Callable[[str], int]:
    """Return a reader of whole numbers from so many on, for argparse."""

    def read(text: str) -> int:
        try:
            number = int(text)
        except ValueError:
            raise ArgumentTypeError(f"{text!r} is no whole number") from None
        if number < least:
            raise ArgumentTypeError(f"{least} or more is needed, not {number}")
        return number

    return read
