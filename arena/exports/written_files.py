"""A worker's part in a file that a page offers: made, stored, or why not."""

from __future__ import annotations

from abc import abstractmethod
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TypeVar

from django.core.files import File

from arena.models.files import WrittenFile
from arena.services.written_files import keep_file
from augment.services.work import Lease, WorkKind

Row = TypeVar("Row", bound=WrittenFile)


@dataclass(frozen=True, slots=True, kw_only=True)
class MadeFile:
    """What is to be stored; see `keep_file`."""

    name: str
    content: File[bytes]
    warnings: tuple[str, ...] = ()
    marked: bool = False


class FileWork(WorkKind[Row]):
    """Files of one kind of row."""

    @abstractmethod
    def made(self, row: Row) -> AbstractContextManager[MadeFile]:
        """The file of a row, while it is open."""

    def run(self, row: Row, held: Lease[Row]) -> None:
        """Make it and keep it."""
        with self.made(row) as made:
            keep_file(
                row,
                held,
                name=made.name,
                content=made.content,
                warnings=made.warnings,
                marked=made.marked,
            )
