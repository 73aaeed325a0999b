"""Run by the receivers' own Python: `python script.py FILE...` prints one JSON object a file.

The packages are there alone, so they are imported where they are used.
"""

import json
import logging
import sys
from pathlib import Path
from typing import Any


def check_asam(file: str) -> dict[str, Any]:
    """ASAM's checks of OpenDRIVE (.xodr) and OpenSCENARIO (.xosc): the status of each, issues."""
    from qc_baselib import Configuration, Result
    from qc_opendrive import constants as drive_constants
    from qc_opendrive import main as drive
    from qc_openscenario import constants as scenario_constants
    from qc_openscenario import main as scenario

    program, constants = (
        (drive, drive_constants) if file.endswith(".xodr") else (scenario, scenario_constants)
    )
    config, result = Configuration(), Result()
    config.set_config_param("InputFile", file)
    bundle = constants.BUNDLE_NAME
    result.register_checker_bundle(
        name=bundle, description="", version=constants.BUNDLE_VERSION, summary=""
    )
    result.set_result_version(version=constants.BUNDLE_VERSION)
    program.run_checks(config, result)
    checkers = result.get_checker_ids(bundle)
    return {
        "status": {name: result.get_checker_status(name).value for name in checkers},
        "issues": [
            f"{name}: {issue.description} {[place.description for place in issue.locations]}"
            for name in checkers
            for issue in result.get_issues(bundle, name)
        ],
    }


def read_commonroad(file: str) -> dict[str, Any]:
    """What stands in a file that keeps to the schema; else the schema's faults."""
    import commonroad
    from commonroad.common.file_reader import CommonRoadFileReader
    from lxml import etree

    folder = Path(commonroad.__file__).parent / "common" / "xml_definition_files"
    schema = etree.XMLSchema(etree.parse(folder / "XML_commonRoad_XSD.xsd"))
    document = etree.parse(file)
    schema.validate(document)
    faults = [str(fault) for fault in schema.error_log]
    if faults:
        return {"faults": faults}
    scenario, problems = CommonRoadFileReader(file).open()
    network = scenario.lanelet_network
    return {
        "faults": [],
        "lanelets": {
            one.lanelet_id: {
                "center": one.center_vertices.tolist(),
                "successor": one.successor,
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
            | {"states": [_row(state) for state in one.prediction.trajectory.state_list]}
            for one in scenario.dynamic_obstacles
        ],
        "starts": [
            [*one.initial_state.position.tolist(), one.initial_state.velocity]
            for one in problems.planning_problem_dict.values()
        ],
    }


def _obstacle(one: Any) -> dict[str, Any]:
    return {
        "type": one.obstacle_type.value,
        "position": one.initial_state.position.tolist(),
        "orientation": one.initial_state.orientation,
        "size": [one.obstacle_shape.length, one.obstacle_shape.width],
    }


def _row(state: Any) -> list[float]:
    return [state.time_step, *state.position.tolist(), state.orientation, state.velocity]


if __name__ == "__main__":
    logging.disable()
    for name in sys.argv[1:]:
        read = read_commonroad if name.endswith(".xml") else check_asam
        sys.stdout.write(json.dumps(read(name)) + "\n")
