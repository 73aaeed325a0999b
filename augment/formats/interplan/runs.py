"""Files for a run in nuPlan beside interPlan's: filters, commands, owners of scenarios.

Names of configurations are those of interPlan's and nuPlan's own scripts.
"""

import csv
import io
from collections import defaultdict
from collections.abc import Iterable
from typing import NamedTuple

import yaml

from augment.errors import InvalidDocument

MODIFICATIONS = "interplan.yaml"
TOKENS, SCRIPT = "nuplan_tokens.csv", "run_nuplan.sh"
MOST_TOKENS = 20_000


class NuplanScenario(NamedTuple):
    """One changed scenario as nuPlan's results call it.

    Attributes:
        scenario: Base token and index, as `2d62c3139aa95007-s3`.
        augmentation: The code of its row.
        contestant: The slug of who made it.
        name: What a person calls it.
    """

    scenario: str
    augmentation: str
    contestant: str
    name: str


_COLUMNS = NuplanScenario._fields


def run_files(scenarios: Iterable[NuplanScenario]) -> dict[str, bytes]:
    """Return a filter for each contestant, a script with a command for each, and the tokens.

    Args:
        scenarios: Those whose base token is nuPlan's; without any there are no files.
    """
    by_contestant: defaultdict[str, list[NuplanScenario]] = defaultdict(list)
    for run in scenarios:
        by_contestant[run.contestant].append(run)
    if not by_contestant:
        return {}
    files, commands, table = {}, "", io.StringIO()
    rows = csv.writer(table, lineterminator="\n")
    rows.writerow(_COLUMNS)
    for slug, runs in sorted(by_contestant.items()):
        files[f"scenario_filter/arena-{slug}.yaml"] = _filter(runs)
        commands += f'run arena-{slug} "$@"   # {len(runs)} scenarios\n'
        rows.writerows(runs)
    return files | {SCRIPT: (_SCRIPT + commands).encode(), TOKENS: table.getvalue().encode()}


def read_tokens(content: bytes) -> dict[str, str]:
    """Return the codes of augmentations by nuPlan's names of their scenarios.

    Raises:
        InvalidDocument: The table is none of ours, names a scenario twice, or is too long.
    """
    try:
        rows = list(csv.reader(io.StringIO(content.decode()), strict=True))
    except (UnicodeDecodeError, csv.Error) as fault:
        raise InvalidDocument(TOKENS, [("", f"is no CSV file: {fault}")]) from None
    if not rows or tuple(rows[0]) != _COLUMNS or len(rows) > MOST_TOKENS + 1:
        problem = f"needs the columns {', '.join(_COLUMNS)} and at most {MOST_TOKENS:,} lines"
        raise InvalidDocument(TOKENS, [("line 1", problem)])
    scenarios: dict[str, str] = {}
    for number, row in enumerate(rows[1:], start=2):
        if len(row) != len(_COLUMNS) or row[0] in scenarios:
            problem = f"needs {len(_COLUMNS)} values and a scenario that no other line has"
            raise InvalidDocument(TOKENS, [(f"line {number}", problem)])
        scenarios[row[0]] = row[1]
    return scenarios


# --- Private -----------------------------------------------------------------------------------


def _filter(scenarios: list[NuplanScenario]) -> bytes:
    open_limits = (
        *("log_names", "map_names", "num_scenarios_per_type", "limit_total_scenarios"),
        *("timestamp_threshold_s", "ego_displacement_minimum_m", "ego_start_speed_threshold"),
        *("ego_stop_speed_threshold", "speed_noise_tolerance"),
    )
    document = {
        "_target_": (
            "interplan.planning.scenario_builder.benchmark_scenario_filter.BenchmarkScenarioFilter"
        ),
        "_convert_": "all",
        "defaults": [f"/{MODIFICATIONS.removesuffix('.yaml')}@modifications"],
        "scenario_types": None,
        "scenario_tokens": [run.scenario for run in scenarios],
        **dict.fromkeys(open_limits),
        **dict.fromkeys(("expand_scenarios", "remove_invalid_goals", "shuffle"), False),
    }
    return yaml.safe_dump(document, sort_keys=False).encode()


_SCRIPT = """\
#!/bin/sh
# Drives what the contestants made in nuPlan, with interPlan's benchmark; a command a contestant.
#   INTERPLAN_PLUGIN_ROOT=... PLANNER=pdm_closed_planner sh run_nuplan.sh [OVERRIDE ...]
# Afterwards: manage.py import nuplan_results EXPERIMENT_FOLDER ... --tokens nuplan_tokens.csv
set -eu
here=$(cd "$(dirname "$0")" && pwd)
configs=$(for of in interplan tuplan_garage nuplan; do
  for part in config.common config.simulation experiments; do
    printf 'pkg://%s.planning.script.%s,' $of $part; done; done)

run() {
  filter=$1
  shift
  python "$INTERPLAN_PLUGIN_ROOT/interplan/planning/script/run_simulation.py" \\
    +simulation=default_interplan_benchmark \\
    planner="${PLANNER:-pdm_closed_planner}" \\
    scenario_filter="$filter" \\
    experiment_name="$filter" \\
    hydra.searchpath="[file://$here,${configs%,}]" "$@"
}

"""
