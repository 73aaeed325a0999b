"""A folder as somebody has it who holds interPlan and nuPlan: made, in the published shapes."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from augment.formats.documents import read_yaml
from augment.formats.interplan.file import WHAT, parse_file, read_entry
from augment.scene.entities import Modification, Scene
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


CONSTRUCTION, ACCIDENT, JAYWALK, NUDGE, OVERTAKE = (
    *("approaching_construction_zone", "avoid_crashed_cars", "jaywalking_pedestrian"),
    *("nudge_around_parked_vehicle", "overtake_parked_vehicle"),
)
_KINDS = {"C": CONSTRUCTION, "A": ACCIDENT, "J": JAYWALK, "N": NUDGE, "O": OVERTAKE}
FIFTY = [
    [(_KINDS[entry[0]], entry[1:]) for entry in entries.split()]
    for entries in (
        "Odh O A N N N Cdl Cgl J J J J Odh Odm Oa0",
        "J N N N Cdl Cgl Ca0 J J J",
        "Agr A A J J",
        "Cdl Cdl Cdl C",
        "C Agr A",
        *("A A A", "N A N", "Odh Odm Oa0", "N N", "Odh Oa0"),
    )
]
"""The structure of interPlan's 50 special scenarios by base scene: first letters and configs."""


def fifty_entries(city: str = CITY) -> dict[str, Any]:
    """A modification file with the structure of interPlan's 50 special scenarios."""
    _, east, north, _ = CITIES[city]

    def entry(scene: int, index: int, kind: str, config: str) -> dict[str, Any]:
        ahead = round(15.1 + scene + 0.37 * index, 6)

        def at(more: float, left: float) -> list[float]:
            """Beside the ego of that frame, which drives east."""
            return [round(east + 1.461 + ahead + more, 7), round(north + left, 7)]

        made: dict[str, Any] = {"type": kind} | ({"config": config} if config else {})
        if kind == CONSTRUCTION:
            made["cones"] = [at(2.5 * one, 1.5 - 0.6 * one) for one in range(3 + scene)]
            made["pedestrian"] = [[*at(3.0, -2.5), *at(4.0, -2.5), None]]
            if config == "dl":
                made["roadblock_locations_to_spawn_agents"] = []
        elif kind == ACCIDENT:
            made["stopped_vehicle"] = [[*at(0.0, 0.3), 0.1], [*at(4.6, -0.5), -2.27]]
        elif kind == JAYWALK:
            made["pedestrian"] = [[*at(0.0, -6.0), *at(1.0, 6.0), None]]
            if (scene, index) == (1, 0):
                made["stopped_bus"] = [[*at(-6.0, -1.0), 0.0]]
        else:
            made["stopped_vehicle"] = [[*at(0.0, -0.8), 0.05]]
        return made

    return {
        "accel_max": "${oc.select:observation.accel_max, 1}",
        "decel_max": "${oc.select:observation.decel_max, 2}",
        "scenario_specifics": None,
        "modification_details_dictionary": {
            token(100 + scene).hex(): {
                "extra_agents_to_spawn": [[east + 40.25, north + 4.0, 3.0]] if scene < 2 else [],
                "roadblock_locations_to_spawn_agents": [[east + 30.0, north + 4.0]],
                "goal": {"left": f"{east + 60}, {north + 4}", "right": None, "straight": None},
                "spawn_in_intersection": False,
                "special_scenario": {
                    str(index): entry(scene, index, kind, config)
                    for index, (kind, config) in enumerate(entries)
                },
            }
            for scene, entries in enumerate(FIFTY)
        },
    }


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


def entries_of(text: str, scenes: Mapping[str, Scene]) -> list[tuple[Modification, list[str]]]:
    """The special scenarios of the tokens that have a scene, as changes with what they lose."""
    by_token = parse_file(read_yaml(text, what=WHAT))[0].modification_details_dictionary
    return [
        read_entry(token, index, entry, scenes[token])
        for token, one in by_token.items()
        if token in scenes
        for index, entry in (one.special_scenario or {}).items()
    ]
