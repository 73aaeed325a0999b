"""Programs of entrants, which know nothing of ours: `python entrants.py FORMAT TASK.FILE OUT`.

Run by the receivers' own Python. Each adds a parked car 30 m ahead, lets the car that drives 20 m
ahead drive 5 m further on, and takes the pedestrian away.
"""

import pickle
import sys
from pathlib import Path

import numpy as np

NEW = (30.0, 0.5)


def change_commonroad(given: str, out: str) -> None:
    """By commonroad-io."""
    from commonroad.common.file_reader import CommonRoadFileReader
    from commonroad.common.file_writer import CommonRoadFileWriter, OverwriteExistingFile
    from commonroad.common.util import FileFormat
    from commonroad.geometry.obstacle_shapes.rect_obstacle_shape import RectObstacleShape
    from commonroad.scenario.obstacle import ObstacleType, StaticObstacle
    from commonroad.scenario.state import InitialState

    scenario, problems = CommonRoadFileReader(given).open()
    for one in scenario.obstacles:
        if one.obstacle_type is ObstacleType.PEDESTRIAN:
            scenario.remove_obstacle(one)
    for one in scenario.dynamic_obstacles:
        if np.allclose(one.initial_state.position, (20.0, 0.0)):
            one.translate_rotate(np.array([5.0, 0.0]), 0.0)
    parked = InitialState(
        position=np.array(NEW),
        orientation=0.1,
        time_step=0,
        velocity=0.0,
        acceleration=0.0,
        yaw_rate=0.0,
        slip_angle=0.0,
    )
    number = scenario.generate_object_id()
    box = RectObstacleShape(width=2.0, length=4.8)
    scenario.add_objects(StaticObstacle(number, ObstacleType.PARKED_VEHICLE, box, parked))
    writer = CommonRoadFileWriter(
        scenario, problems, "A. Author", "", "", set(), file_format=FileFormat.XML
    )
    writer.write_to_file(out, OverwriteExistingFile.ALWAYS)


def change_scenarionet(given: str, out: str) -> None:
    """By numpy and pickle alone, as MetaDrive's description of the format says."""
    scenario = pickle.loads(Path(given).read_bytes())
    tracks, steps = scenario["tracks"], scenario["length"]
    for name, track in list(tracks.items()):
        if track["type"] == "PEDESTRIAN":
            del tracks[name]
        elif np.allclose(track["state"]["position"][0, :2], (20.0, 0.0)):
            track["state"]["position"][:, 0] += 5.0
    tracks["parked car"] = {
        "type": "VEHICLE",
        "state": {
            "position": np.tile(np.array([*NEW, 0.0], dtype=np.float32), (steps, 1)),
            "heading": np.full(steps, 0.1, dtype=np.float32),
            "velocity": np.zeros((steps, 2), dtype=np.float32),
            "valid": np.ones(steps, dtype=bool),
            "length": np.full(steps, 4.8, dtype=np.float32),
            "width": np.full(steps, 2.0, dtype=np.float32),
            "height": np.full(steps, 1.6, dtype=np.float32),
        },
        "metadata": {"type": "VEHICLE", "object_id": "parked car", "track_length": steps},
    }
    Path(out).write_bytes(pickle.dumps(scenario))


if __name__ == "__main__":
    {"commonroad": change_commonroad, "scenarionet": change_scenarionet}[sys.argv[1]](
        *sys.argv[2:]
    )
