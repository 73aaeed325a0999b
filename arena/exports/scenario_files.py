"""A worker's part in a zip of scenarios: made, stored, or why not."""

from __future__ import annotations

import logging

from django.utils.text import slugify

from arena.exports.scenarios import scenario_zip, zip_name
from arena.services.scenario_files import begin_file, keep_file, note_failure
from augment.errors import AugmentError
from augment.sentences import sentence_of
from augment.services.judging.scenario_export import export_job

logger = logging.getLogger(__name__)


def write_file(*, file_pk: int) -> None:
    """Write the zip of a row, unless it is ready; what is wrong is kept on the row."""
    row = begin_file(file_pk=file_pk)
    if row is None:
        return
    try:
        exported = export_job(row.job, file_format=row.format)
        content = scenario_zip(exported)
    except AugmentError as fault:
        note_failure(row, sentence_of(fault))
        return
    except Exception as fault:
        logger.exception("Zip %s of job %s failed.", row.code, row.job.code)
        note_failure(row, f"{type(fault).__name__}: {fault}")
        raise
    keep_file(
        row,
        name=zip_name(exported, slugify(row.job.name) or str(row.job.code)),
        content=content,
        warnings=exported.warnings,
        marked=any(source.is_non_commercial for source in exported.sources),
    )
