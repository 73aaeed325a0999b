"""Files of a study, as a worker writes them."""

from pathlib import Path

from django.core.files import File
from django.core.files.base import ContentFile
from django.utils.text import slugify

from arena.exports.files import zip_bytes, zip_folder
from arena.exports.written_files import FileWork, MadeFile
from arena.jobs.exports.files import pack_scenarios
from arena.models import StudyFile
from arena.results.exports.study_folder import write_study
from arena.results.exports.writers import bundle_files
from arena.results.queries.access import snapshot_to_export
from arena.studies.services.files import why_not
from arena.studies.services.planning import list_shown
from augment.errors import Conflict
from augment.services.judging import ExportOrigin, export_rows


class StudyFiles(FileWork[StudyFile]):
    """Files of studies."""

    model = StudyFile
    related = ("study",)

    def make(self, row: StudyFile, folder: Path) -> MadeFile:
        """Make what the row's kind says, unless the study has changed since somebody asked."""
        if reason := why_not(row.study, row.kind):
            raise Conflict(reason)
        study, slug = row.study, slugify(row.study.name) or "study"
        if row.kind == StudyFile.Kind.INTERPLAN:
            origin = ExportOrigin(kind="study", name=study.name, code=str(study.code))
            rows, many = list_shown(study), study.shows_all_samples
            return pack_scenarios(export_rows(rows, origin, "interplan", many=many), slug)
        if row.kind == StudyFile.Kind.RATING:
            content = zip_bytes(bundle_files(snapshot_to_export(study)))
            return MadeFile(name=f"{slug}-rating.zip", content=ContentFile(content))
        write_study(study, folder / "study", say=lambda line: None)
        packed = folder / "study.zip"
        with packed.open("wb") as file:
            zip_folder(folder / "study", file)
        return MadeFile(name=f"{slug}-study.zip", content=File(packed.open("rb")))


STUDY_FILES = StudyFiles()
