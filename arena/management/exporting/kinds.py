"""What a kind of export is: arguments, and a function from them to a file's bytes."""

from __future__ import annotations

from argparse import ArgumentParser
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, TypeVar

from arena.exports.formats import Format, format_named
from augment.models import GenerationJob
from augment.services.running.choosing import find_job

Table = TypeVar("Table")
Chosen = dict[str, Any]
"""The arguments of the command line by name."""

Say = Callable[[str], None]
"""Where a kind tells what was left out or lost, beside the file."""


class ExportedFile(NamedTuple):
    """A file that can be delivered.

    Attributes:
        suffix: The file's ending, without the dot.
        is_text: Whether it can go to a terminal.
        name: What it is called in a folder, where OUT may be one; else empty.
    """

    content: bytes
    suffix: str
    is_text: bool
    name: str = ""


Write = Callable[[Chosen, Say], ExportedFile]


def add_kind(kinds: Any, name: str, write: Write, *, of: str, help: str) -> ArgumentParser:
    """A kind with its first argument.

    Args:
        kinds: Argparse's subparsers.
        name: What is typed for it.
        write: Writes it.
        of: What it is an export of: study or job.
        help: One line.
    """
    kind: ArgumentParser = kinds.add_parser(name, help=help)
    kind.add_argument(of, help="its name or its code")
    kind.set_defaults(write=write)
    return kind


def add_table(
    kinds: Any,
    name: str,
    known: Mapping[str, Format[Table]],
    table_of: Callable[[GenerationJob], Table],
    *,
    help: str,
) -> ArgumentParser:
    """A kind that is one table of a job, in any of these formats."""

    def write(options: Chosen, say: Say) -> ExportedFile:
        chosen = format_named(known, options["format"])
        return fill(chosen, table_of(find_job(options["job"])))

    kind = add_kind(kinds, name, write, of="job", help=help)
    add_format(kind, known)
    return kind


def add_format(kind: ArgumentParser, known: Mapping[str, Format[Table]]) -> None:
    """--format, csv unless given."""
    kind.add_argument("--format", default="csv", help=f"one of {', '.join(known)}")


def fill(form: Format[Table], table: Table) -> ExportedFile:
    """The table as a file of that format."""
    return ExportedFile(form.write(table), form.suffix, form.is_text)
