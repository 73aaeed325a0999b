"""Results of nuPlan's own simulation, attributed to augmentations and kept beside our drives."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from django.db import transaction

from augment.errors import InvalidDocument
from augment.formats.interplan.runs import TOKENS, read_tokens
from augment.formats.nuplan_results import NuplanDrive, read_results
from augment.models import Augmentation, GenerationJob, NuplanResult
from augment.services.events import log_change
from augment.services.texts import read_code
from augment.simulation.score import ScoreKind


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportedResults:
    """Result of an import.

    Attributes:
        kept: How many results were written; those of the same planner and rules were replaced.
        failed: How many of them say that the simulation failed.
        strangers: A line for each row that belongs to no augmentation of this installation.
    """

    kept: int
    failed: int
    strangers: tuple[str, ...]


def import_results(*, tokens: Path, folders: Sequence[Path]) -> ImportedResults:
    """Keep what nuPlan wrote about scenarios that were exported for interPlan; all or nothing.

    Args:
        tokens: `nuplan_tokens.csv` of that export.
        folders: Of experiments; each has `aggregator_metric/`.

    Raises:
        InvalidDocument: A file can't be read, or two folders have the same drive.
    """
    if not tokens.is_file():
        raise InvalidDocument(TOKENS, [(str(tokens), "is not there")])
    scenarios = read_tokens(tokens.read_bytes())
    drives = [drive for folder in folders for drive in read_results(folder)]
    _check_once(drives)
    codes = {name: read_code(text) for name, text in scenarios.items()}
    rows = Augmentation.objects.filter(code__in=set(codes.values())).defer("modification")
    by_code = {row.code: row for row in rows}
    by_scenario = {name: by_code[code] for name, code in codes.items() if code in by_code}
    imported, strangers = [], []
    for drive in drives:
        row = by_scenario.get(drive.scenario)
        if row is None:
            is_known = drive.scenario in scenarios
            reason = "its augmentation is not here" if is_known else f"not in {TOKENS}"
            strangers.append(f"{drive.scenario} by {drive.planner}: {reason}")
        else:
            imported.append((row, drive))
    with transaction.atomic():
        for row, drive in imported:
            rules = ScoreKind.INTERPLAN if drive.is_interplan else ScoreKind.NUPLAN
            NuplanResult.objects.update_or_create(
                augmentation=row,
                planner=drive.planner,
                rules=rules.value,
                defaults={"score": drive.score, "reason": drive.reason, "parts": drive.parts},
            )
        for pk, number in sorted(Counter(row.job_id for row, _ in imported).items()):
            job = GenerationJob.objects.get(pk=pk)
            log_change(job, "import nuPlan results", None, after={"results": number})
    failed = sum(drive.score is None for _, drive in imported)
    return ImportedResults(kept=len(imported), failed=failed, strangers=tuple(strangers))


# --- Private -----------------------------------------------------------------------------------


def _check_once(drives: Sequence[NuplanDrive]) -> None:
    counts = Counter((drive.scenario, drive.planner, drive.is_interplan) for drive in drives)
    for (scenario, planner, _), number in counts.items():
        if number > 1:
            problem = f"is there {number} times for the planner {planner}; give one run of each"
            raise InvalidDocument("nuPlan results", [(scenario, problem)])
