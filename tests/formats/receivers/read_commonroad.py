"""Run by the receivers' own Python: hold files against the schema, load them, print what is there.

`python read_commonroad.py FILE...` prints one JSON object a line.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import commonroad
from commonroad.common.file_reader import CommonRoadFileReader
from lxml import etree

FOLDER = Path(commonroad.__file__).parent / "common" / "xml_definition_files"
SCHEMA = etree.XMLSchema(etree.parse(FOLDER / "XML_commonRoad_XSD.xsd"))


def described(file: str) -> dict[str, Any]:
    document = etree.parse(file)
    SCHEMA.validate(document)
    faults = [str(fault) for fault in SCHEMA.error_log]
    if faults:
        return {"faults": faults}
    scenario, problems = CommonRoadFileReader(file).open()
    network = scenario.lanelet_network
    return {
        "faults": [],
        "dt": scenario.dt,
        "lanelets": {
            one.lanelet_id: {
                "center": one.center_vertices.tolist(),
                "successor": one.successor,
                "adj_right": one.adj_right,
                "type": sorted(kind.value for kind in one.lanelet_type),
            }
            for one in network.lanelets
        },
        "limits": [
            float(element.additional_values[0])
            for sign in network.traffic_signs
            for element in sign.traffic_sign_elements
        ],
        "lights": [light.get_state_at_time_step(0).value for light in network.traffic_lights],
        "turns": [
            [sorted(one.outgoing_left), sorted(one.outgoing_straight)]
            for crossing in network.intersections
            for one in crossing.incomings
        ],
        "static": [_obstacle(one) for one in scenario.static_obstacles],
        "dynamic": [
            _obstacle(one)
            | {"last": one.prediction.final_time_step, "velocity": one.initial_state.velocity}
            for one in scenario.dynamic_obstacles
        ],
        "starts": [
            [*one.initial_state.position.tolist(), one.initial_state.velocity]
            for one in problems.planning_problem_dict.values()
        ],
        "goals": [
            [goal.position.center.x, goal.position.center.y, goal.time_step.end]
            for one in problems.planning_problem_dict.values()
            for goal in one.goal.state_list
        ],
    }


def _obstacle(one: Any) -> dict[str, Any]:
    return {
        "type": one.obstacle_type.value,
        "position": one.initial_state.position.tolist(),
        "orientation": one.initial_state.orientation,
        "size": [one.obstacle_shape.length, one.obstacle_shape.width],
    }


if __name__ == "__main__":
    for name in sys.argv[1:]:
        sys.stdout.write(json.dumps(described(name)) + "\n")
