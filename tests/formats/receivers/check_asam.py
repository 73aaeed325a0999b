"""Run by the receivers' own Python: ASAM's checks of OpenDRIVE (.xodr) and OpenSCENARIO (.xosc).

`python check_asam.py FILE...` prints one JSON object a line: the status of each check, and issues.
"""

from __future__ import annotations

import json
import logging
import sys
from typing import Any

from qc_baselib import Configuration, Result
from qc_opendrive import constants as drive_constants
from qc_opendrive import main as drive
from qc_openscenario import constants as scenario_constants
from qc_openscenario import main as scenario


def checked(file: str) -> dict[str, Any]:
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


if __name__ == "__main__":
    logging.disable()
    for path in sys.argv[1:]:
        sys.stdout.write(json.dumps(checked(path)) + "\n")
