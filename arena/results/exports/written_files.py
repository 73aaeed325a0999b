"""A worker's part in a file that a page offers: made, stored, or why not."""

from __future__ import annotations

import tempfile
from abc import abstractmethod
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from django.core.files import File
from django.core.files.base import ContentFile
from django.utils.text import slugify

from arena.exports.files import zip_folder
from arena.exports.jobs.scenario_files import made_of
from arena.models import Study, StudyFile
from arena.models.written_files import WrittenFile
from arena.results.exports.sheets import contact_sheet, sheet_pdf
from arena.results.exports.study_folder import write_study
from arena.results.exports.tables import leaderboard_table
from arena.results.queries.access import snapshot_to_export
from arena.results.services.written_files import keep_file, why_not
from arena.services.plans import shown_augmentations
from augment.errors import Conflict
from augment.services.judging.scenario_export import ExportOrigin, export_rows
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


Kind = StudyFile.Kind


class StudyFiles(FileWork[StudyFile]):
    """Files of studies."""

    model = StudyFile
    related = ("study",)

    @contextmanager
    def made(self, row: StudyFile) -> Iterator[MadeFile]:
        """What the row's kind says, unless the study has changed since somebody asked."""
        if reason := why_not(row.study, row.kind):
            raise Conflict(reason)
        slug = slugify(row.study.name) or "study"
        with tempfile.TemporaryDirectory() as beside:
            made = _MAKERS[Kind(row.kind)](row.study, slug, Path(beside))
            with made.content:
                yield made


STUDY_FILES = StudyFiles()


def _whole(study: Study, slug: str, beside: Path) -> MadeFile:
    folder = beside / "study"
    write_study(study, folder, say=lambda said: None)
    packed = tempfile.TemporaryFile()  # noqa: SIM115 - it is closed when it is stored
    zip_folder(folder, packed)
    return MadeFile(name=f"{slug}-study.zip", content=File(packed))


def _sheet(study: Study, slug: str, beside: Path) -> MadeFile:
    snapshot = snapshot_to_export(study)
    places = list(study.scenarios.defer("reference").order_by("type", "slug"))
    sheet = contact_sheet(snapshot, leaderboard_table(snapshot), places)
    return MadeFile(name=f"{slug}-contact-sheet.pdf", content=ContentFile(sheet_pdf(sheet)))


def _interplan(study: Study, slug: str, beside: Path) -> MadeFile:
    origin = ExportOrigin(kind="study", name=study.name, code=str(study.code))
    rows = shown_augmentations(study)
    many = study.shows_all_samples
    return made_of(export_rows(rows, origin, "interplan", many=many), slug)


_MAKERS: dict[Kind, Callable[[Study, str, Path], MadeFile]] = {
    Kind.STUDY: _whole,
    Kind.CONTACT_SHEET: _sheet,
    Kind.INTERPLAN: _interplan,
}
