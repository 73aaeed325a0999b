"""Results of nuPlan's simulation: the score of each scenario, and failures.

    <experiment>/aggregator_metric/*.parquet    a row a scenario, then rows of types and of all
    <experiment>/runner_report.parquet          whether each simulation went through

Each folder is read in a process of its own (`sandbox`). `metrics/` is in the aggregator's rows.
"""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, FiniteFloat, TypeAdapter, ValidationError

from augment.errors import InvalidDocument
from augment.formats import sandbox
from augment.scene.schema import list_problems

WHAT = "nuPlan experiment"
MOST_ROWS, MOST_COLUMNS, MOST_BYTES = 100_000, 200, 64_000_000
LONGEST_REASON = 300
_OF_AGGREGATOR = frozenset(
    ("scenario", "log_name", "scenario_type", "num_scenarios", "planner_name", "aggregator_type")
)
_NEEDED = ("scenario", "log_name", "planner_name", "score")
_OF_REPORT = ("scenario_name", "planner_name", "succeeded", "error_message")
_OF_INTERPLAN = "lane_changes_to_goal"
"""interPlan's aggregator weighs it; nuPlan has no such metric."""
_Name = Annotated[str, Field(pattern=r"^[ -~]{1,120}$")]


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

    scenario: _Name
    planner: _Name
    is_interplan: bool
    score: Annotated[float, Field(ge=0.0, le=1.0)] | None
    reason: str
    parts: dict[str, FiniteFloat | None]


_DRIVE, _DRIVES = TypeAdapter(NuplanDrive), TypeAdapter(list[NuplanDrive])


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
    drives = [drive for file in files for drive in _read_aggregate(file)]
    report = folder / "runner_report.parquet"
    if report.exists():
        drives += _read_failures(report, is_interplan=all(drive.is_interplan for drive in drives))
    return [asdict(drive) for drive in drives]


def _read_aggregate(file: Path) -> list[NuplanDrive]:
    drives = []
    for number, row in enumerate(_read(file, _NEEDED, None)):
        if row["log_name"] is None:  # a scenario type, or the final score
            continue
        parts = {
            name: None if value != value else value  # pandas writes NaN for what is missing
            for name, value in row.items()
            if name not in _OF_AGGREGATOR and not name.startswith("__")  # an index of pandas
        }
        row_values = {"is_interplan": _OF_INTERPLAN in parts, "score": parts.pop("score")}
        place = f"{file.name}: row {number}"
        reason = "nuPlan gave no score" if row_values["score"] is None else ""
        row_values |= {"parts": parts if not reason else {}, "reason": reason}
        drives.append(_drive(place, row["scenario"], row, **row_values))
    return drives


def _read_failures(file: Path, *, is_interplan: bool) -> list[NuplanDrive]:
    more: dict[str, Any] = {"is_interplan": is_interplan, "score": None, "parts": {}}
    drives = []
    for number, row in enumerate(_read(file, _OF_REPORT, list(_OF_REPORT))):
        if row["succeeded"] is not True:
            lines = str(row["error_message"] or "nuPlan gave no reason").strip().splitlines()
            reason = lines[-1].strip()[:LONGEST_REASON]
            place = f"{file.name}: row {number}"
            drives.append(_drive(place, row["scenario_name"], row, reason=reason, **more))
    return drives


def _drive(place: str, scenario: object, row: dict[str, Any], **more: Any) -> NuplanDrive:
    values = {"scenario": scenario, "planner": row["planner_name"], **more}
    try:
        return _DRIVE.validate_json(json.dumps(values, default=str), strict=True)
    except ValidationError as fault:
        problems = [(f"{place}: {path}", text) for path, text in list_problems(fault)]
        raise InvalidDocument(WHAT, problems) from None


def _read(file: Path, needed: tuple[str, ...], read: list[str] | None) -> list[dict[str, Any]]:
    """Return the rows of a file of bounded size; of all columns where none are named."""
    import pyarrow as pa
    from pyarrow import parquet

    try:
        if file.stat().st_size > MOST_BYTES:
            raise InvalidDocument(WHAT, [(file.name, f"has more than {MOST_BYTES:,} bytes")])
        opened = parquet.ParquetFile(pa.BufferReader(file.read_bytes()))
        names = opened.schema_arrow.names
        if set(needed) - set(names) or len(set(names)) < len(names) or len(names) > MOST_COLUMNS:
            text = f"needs the columns {', '.join(needed)}, each once, of at most {MOST_COLUMNS}"
            raise InvalidDocument(WHAT, [(file.name, text)])
        if opened.metadata.num_rows > MOST_ROWS:
            raise InvalidDocument(WHAT, [(file.name, f"has more than {MOST_ROWS:,} rows")])
        table = opened.read(columns=read)
        table.validate(full=True)
        rows: list[dict[str, Any]] = table.to_pylist()
    except (pa.ArrowException, ValueError, TypeError, KeyError, OSError, OverflowError) as fault:
        problem = f"is no Parquet file that can be read: {str(fault)[:LONGEST_REASON]}"
        raise InvalidDocument(WHAT, [(file.name, problem)]) from None
    return rows


if __name__ == "__main__":
    sandbox.serve(_answer)
