"""What nuPlan's simulation wrote of a run: the score of each scenario, and what failed.

    <experiment>/aggregator_metric/*.parquet    a row a scenario, then rows of types and of all
    <experiment>/runner_report.parquet          whether each simulation went through

Each folder is read in a process of its own (`sandbox`). `metrics/` is in the aggregator's rows.
"""

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from augment.errors import InvalidDocument
from augment.formats import sandbox

WHAT = "nuPlan experiment"
MOST_ROWS = 100_000
MOST_COLUMNS = 200
MOST_BYTES = 64_000_000
LONGEST_REASON = 300
LONGEST_NAME = 120
_OF_AGGREGATOR = frozenset(
    ("scenario", "log_name", "scenario_type", "num_scenarios", "planner_name", "aggregator_type")
)
_OF_REPORT = ("scenario_name", "planner_name", "succeeded", "error_message")
_OF_INTERPLAN = "lane_changes_to_goal"
"""interPlan's aggregator weighs it; nuPlan has no such metric."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NuplanDrive:
    """One scenario as a planner drove it in nuPlan.

    Attributes:
        scenario: As nuPlan calls it.
        planner: As it calls itself.
        is_interplan: Whether interPlan's aggregator made the score.
        score: 0 to 1; None where the simulation failed.
        reason: Why it failed, else empty.
        parts: The score of each metric, None where it does not apply.
    """

    scenario: str
    planner: str
    is_interplan: bool
    score: float | None
    reason: str
    parts: dict[str, float | None]


_DRIVES = TypeAdapter(list[NuplanDrive])


def read_results(folder: Path) -> list[NuplanDrive]:
    """Return the drives of an experiment, in the order of its files.

    Raises:
        InvalidDocument: The folder has no aggregated scores, a file breaks the form in which
            nuPlan writes it, or reading takes more than its process may.
    """
    path = folder.resolve()
    return _DRIVES.validate_python(sandbox.run(__name__, {"path": str(path)}, name=path.name))


# --- What runs in the process ------------------------------------------------------------------


def _answer(request: dict[str, Any]) -> list[dict[str, Any]]:
    folder = Path(request["path"])
    files = sorted(folder.glob("aggregator_metric/*.parquet"))
    if not files:
        raise InvalidDocument(WHAT, [("aggregator_metric", "holds no *.parquet")])
    drives = [drive for file in files for drive in _aggregated(file)]
    report = folder / "runner_report.parquet"
    if report.exists():
        is_interplan = all(drive.is_interplan for drive in drives)
        drives += _failed(report, is_interplan)
    seen: set[tuple[str, str]] = set()
    for drive in drives:
        key = drive.scenario, drive.planner
        if key in seen:
            problem = f"is there twice for the planner {drive.planner}"
            raise InvalidDocument(WHAT, [(drive.scenario, problem)])
        seen.add(key)
    return [asdict(drive) for drive in drives]


def _aggregated(file: Path) -> list[NuplanDrive]:
    rows = _read(file, ("scenario", "log_name", "planner_name", "score"), all_columns=True)
    drives = []
    for number, row in enumerate(rows):
        if row["log_name"] is None:  # a scenario type, or the final score
            continue
        place = f"{file.name}: row {number}"
        parts = {
            name: _number(value, f"{place}: {name}")
            for name, value in row.items()
            if name not in _OF_AGGREGATOR
        }
        score = parts.pop("score")
        if score is None or not 0.0 <= score <= 1.0:
            problem = f"{score} must be a number from 0 to 1"
            raise InvalidDocument(WHAT, [(f"{place}: score", problem)])
        drives.append(
            NuplanDrive(
                scenario=_text(row["scenario"], f"{place}: scenario"),
                planner=_text(row["planner_name"], f"{place}: planner_name"),
                is_interplan=_OF_INTERPLAN in parts,
                score=score,
                reason="",
                parts=parts,
            )
        )
    return drives


def _failed(file: Path, is_interplan: bool) -> list[NuplanDrive]:
    drives = []
    for number, row in enumerate(_read(file, _OF_REPORT)):
        if not isinstance(row["succeeded"], bool):
            problem = "must be true or false"
            raise InvalidDocument(WHAT, [(f"{file.name}: row {number}: succeeded", problem)])
        if row["succeeded"]:
            continue
        lines = str(row["error_message"] or "").strip().splitlines()
        reason = lines[-1].strip()[:LONGEST_REASON] if lines else "nuPlan gave no reason"
        drives.append(
            NuplanDrive(
                scenario=_text(row["scenario_name"], f"{file.name}: row {number}: scenario_name"),
                planner=_text(row["planner_name"], f"{file.name}: row {number}: planner_name"),
                is_interplan=is_interplan,
                score=None,
                reason=reason,
                parts={},
            )
        )
    return drives


def _read(
    file: Path, needed: tuple[str, ...], *, all_columns: bool = False
) -> list[dict[str, Any]]:
    """Return the rows of a file of bounded size."""
    import pyarrow as pa
    from pyarrow import parquet

    try:
        if file.stat().st_size > MOST_BYTES:
            raise InvalidDocument(WHAT, [(file.name, f"has more than {MOST_BYTES:,} bytes")])
        opened = parquet.ParquetFile(pa.BufferReader(file.read_bytes()))
        names = opened.schema_arrow.names
        lacking = sorted(set(needed) - set(names))
        if lacking or len(names) != len(set(names)) or len(names) > MOST_COLUMNS:
            problem = (
                f"needs the columns {', '.join(needed)}, each once, of at most {MOST_COLUMNS}"
            )
            raise InvalidDocument(WHAT, [(file.name, problem)])
        if opened.metadata.num_rows > MOST_ROWS:
            raise InvalidDocument(WHAT, [(file.name, f"has more than {MOST_ROWS:,} rows")])
        table = opened.read(columns=None if all_columns else list(needed))
        table.validate(full=True)
        rows: list[dict[str, Any]] = table.to_pylist()
    except (pa.ArrowException, ValueError, TypeError, KeyError, OSError, OverflowError) as fault:
        problem = f"is no Parquet file that can be read: {str(fault)[:LONGEST_REASON]}"
        raise InvalidDocument(WHAT, [(file.name, problem)]) from None
    return rows


def _number(value: object, place: str) -> float | None:
    """Return a finite number; None where it is missing, which pandas writes as NaN too."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return None
    if not isinstance(value, (int, float)) or not math.isfinite(value):
        raise InvalidDocument(WHAT, [(place, f"{str(value)[:40]!r} must be a finite number")])
    return float(value)


def _text(value: object, place: str) -> str:
    if (
        not isinstance(value, str)
        or not 1 <= len(value) <= LONGEST_NAME
        or not value.isprintable()
    ):
        problem = f"must be a line of 1 to {LONGEST_NAME} characters"
        raise InvalidDocument(WHAT, [(place, problem)])
    return value


if __name__ == "__main__":
    sandbox.serve(_answer)
