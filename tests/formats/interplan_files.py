"""A folder as somebody has it who holds interPlan and nuPlan: made, in the published shapes."""

from __future__ import annotations

from pathlib import Path

from tests.formats.nuplan_files import CITIES, token, write_log, write_map

CITY = "sg-one-north"
HERE = token(100).hex()
ELSEWHERE = "71f182558ee95100"


def modification_file(city: str = CITY) -> str:
    """Four special scenarios of a frame that is in the log, one of a frame that is not."""
    _, east, north, _ = CITIES[city]

    def at(ahead: float, left: float) -> str:
        """Beside the ego's centre, which drives east."""
        return f"{east + 1.461 + ahead}, {north + left}"

    return f"""
accel_max: ${{oc.select:observation.accel_max, 1}}
decel_max: ${{oc.select:observation.decel_max, 2}}
scenario_specifics: null
modification_details_dictionary:
  "{HERE}":
    extra_agents_to_spawn:
      - [{at(5, 4)}, 3.0]
      - [{at(9, 4)}, 3.0, {{behavior: default, snap: true}}]
    roadblock_locations_to_spawn_agents: [[{at(60, 0)}]]
    goal: {{left: "{at(60, 0)}", right: null, straight: null}}
    spawn_in_intersection: False
    special_scenario:
      "0":
        type: nudge_around_parked_vehicle
        stopped_vehicle: [[{at(17.5, -0.8)}, 0.05]]
      "1":
        type: approaching_construction_zone
        config: dlgl
        cones: [[{at(20, 1)}], [{at(24, 0)}], [{at(28, -1)}]]
        pedestrian: [[{at(22, -3)}, {at(23, -3)}, null]]
        roadblock_locations_to_spawn_agents: []
      "2":
        type: jaywalking_pedestrian
        stopped_bus: [[{at(12, 4)}, 0.0]]
        pedestrian: [[{at(25, -6)}, {at(25, 6)}, 12]]
      "3":
        type: avoid_crashed_cars
        stopped_vehicle: [[{at(17, 0)}, 0.0], [{at(5000, 1)}, 0.5]]
  {ELSEWHERE}:
    extra_agents_spawn_locations: []
    goal:
      left: null
      right: null
      straight: null
    special_scenario:
      '0':
        type: overtake_parked_vehicle
        stopped_vehicle:
        - - 365100.0
          - 143000
          - 0
"""


def write_folder(root: Path, city: str = CITY) -> Path:
    filters = root / "interplan" / "scenario_filter"
    (filters / "modifications").mkdir(parents=True)
    (filters / "modifications" / "interPlan_modifications.yaml").write_text(
        modification_file(city), encoding="utf-8"
    )
    (filters / "interplan10.yaml").write_text(f"scenario_tokens: ['{HERE}-s0']\n")
    data = root / "nuplan" / "dataset"
    logs = data / "nuplan-v1.1" / "splits" / "mini"
    logs.mkdir(parents=True)
    write_map(data, city)
    write_log(logs, city)
    return root
