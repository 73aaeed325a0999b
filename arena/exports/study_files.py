"""Files of a study, as a worker writes them."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from django.core.files import File
from django.core.files.base import ContentFile
from django.utils.text import slugify

from arena.exports.contact_sheet import contact_sheet, sheet_pdf
from arena.exports.study_folder.writing import write_study
from arena.exports.tables import leaderboard_table
from arena.exports.written_files import FileWork, MadeFile
from arena.exports.zips import zip_folder
from arena.jobs.exports.files import made_of
from arena.models import Study, StudyFile
from arena.queries.studies.results import snapshot_to_export
from arena.services.study_files import why_not
from arena.studies.services.planning import shown_augmentations
from augment.errors import Conflict
from augment.services.judging.scenario_export import ExportOrigin, export_rows

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
