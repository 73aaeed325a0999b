"""A worker's part in a file that a page offers: made, stored, or why not."""

from __future__ import annotations

import logging
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TypeVar

from django.core.files import File

from arena.errors import ArenaError
from arena.models.written_files import WrittenFile
from arena.services.written_files import begin_file, keep_file, note_failure
from augment.errors import AugmentError
from augment.sentences import sentence_of

logger = logging.getLogger(__name__)

Row = TypeVar("Row", bound=WrittenFile)


@dataclass(frozen=True, slots=True, kw_only=True)
class MadeFile:
    """What is to be stored; see `keep_file`."""

    name: str
    content: File[bytes]
    warnings: tuple[str, ...] = ()
    marked: bool = False


def write_row(
    model: type[Row], file_pk: int, make: Callable[[Row], AbstractContextManager[MadeFile]]
) -> None:
    """Write the file of a row, unless it is ready; what is wrong is kept on the row.

    Args:
        model: Of the row.
        file_pk: Its key.
        make: The file of the row, while it is open.
    """
    row = begin_file(model, file_pk)
    if row is None:
        return
    try:
        with make(row) as made:
            keep_file(
                row,
                name=made.name,
                content=made.content,
                warnings=made.warnings,
                marked=made.marked,
            )
    except (ArenaError, AugmentError) as fault:
        note_failure(row, sentence_of(fault))
    except Exception as fault:
        logger.exception("File %s (%s) failed.", row.code, row)
        note_failure(row, f"{type(fault).__name__}: {fault}")
        raise
