"""Files of a nuPlan experiment, with the columns that its devkit writes (commit e924167)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
from pyarrow import parquet

METRICS = ("drivable_area_compliance", "lane_changes_to_goal", "no_ego_at_fault_collisions")
WHO = {"planner_name": "PDMClosedPlanner", "log_name": "2021.06.03.12.02.06_veh-35_04692_04763"}


def scored(scenario: str, score: float, **more: Any) -> dict[str, Any]:
    """A row of the aggregator for one scenario."""
    made: dict[str, Any] = WHO | dict.fromkeys(METRICS, 1.0) | {
        "scenario": scenario, "score": score, "num_scenarios": None, "lane_changes_to_goal": None,
        "scenario_type": "jaywalking_pedestrian", "aggregator_type": "weighted_average",
    }  # fmt: skip
    return made | more


def summed(scenario_type: str, number: int, score: float) -> dict[str, Any]:
    """A row for a type of scenarios, or for all as `final_score`: metrics are sums there."""
    more = dict.fromkeys(METRICS, 7.0)
    head = {"log_name": None, "scenario_type": scenario_type, "num_scenarios": float(number)}
    return scored(scenario_type, score, **head, **more)


def ran(scenario: str, error: str | None = None) -> dict[str, Any]:
    """A row of the runner's report."""
    made = {"succeeded": error is None, "error_message": error, "scenario_name": scenario} | WHO
    times = {"start_time": 1.0, "end_time": 61.0, "duration": 60.0}
    return made | times | {"compute_trajectory_runtimes_mean": 0.1}


def write_experiment(
    folder: Path, rows: Sequence[dict[str, Any]], report: Sequence[dict[str, Any]] = ()
) -> Path:
    """A folder as nuPlan leaves it, the summaries behind the scenarios."""
    (folder / "aggregator_metric").mkdir(parents=True)
    total = summed("final_score", len(rows), 0.5)
    by_type = summed("jaywalking_pedestrian", len(rows), 0.5)
    table = pa.Table.from_pylist([*rows, by_type, total])
    name = "closed_loop_reactive_agents_weighted_average_metrics_2026.11.26.12.00.00.parquet"
    parquet.write_table(table, folder / "aggregator_metric" / name)
    if report:
        parquet.write_table(pa.Table.from_pylist(list(report)), folder / "runner_report.parquet")
    return folder
