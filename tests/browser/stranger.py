"""A stranger's system, run by itself: `python stranger.py BENCHMARK.zip SUBMISSION.zip`.

It shares no code with the product: it knows the folder of a benchmark, and how others write
CommonRoad. Even tasks are answered by the changed scene as CommonRoad, odd ones by our JSON.
"""

import copy
import json
import sys
import xml.etree.ElementTree as ET
import zipfile
from typing import Any

CARD = {
    "name": "Parked by a stranger",
    "authors": ["S. Stranger"],
    "method": "A parked car beside the lane, wherever and whatever is asked.",
    "models": [],
    "is_open": True,
    "samples": 1,
    "cost_usd": 0.0,
    "made_on": "2026-11-20",
}
PARKED = """
<staticObstacle id="{id}"><type>parkedVehicle</type>
<shape><rectangle><length>4.8</length><width>2.0</width></rectangle></shape>
<initialState><position><point><x>{x}</x><y>{y}</y></point></position>
<orientation><exact>0.0</exact></orientation><time><exact>0</exact></time></initialState>
</staticObstacle>
"""


def change_scene(text: bytes, number: int) -> bytes:
    """Return a CommonRoad scenario with one obstacle more."""
    root = ET.fromstring(text)
    free = 1 + max(int(one.get("id", 0)) for one in root.iter() if one.get("id", "0").isdigit())
    problem = [one.tag for one in root].index("planningProblem")
    root.insert(problem, ET.fromstring(PARKED.format(id=free, x=15.0 + number, y=0.5)))
    return bytes(ET.tostring(root, encoding="utf-8", xml_declaration=True))


def write_change(example: dict[str, Any], number: int) -> str:
    """Return the example of a change with a parked car as all that it adds."""
    change = copy.deepcopy(example)
    for name, value in change.items():
        if isinstance(value, list):
            change[name] = []
    change["add"] = [example["add"][0] | {"id": "mine", "x_m": 15.0 + number, "y_m": 0.5}]
    return json.dumps(change)


def main(handed_out: str, answers: str) -> None:
    """Read the one, write the other."""
    with zipfile.ZipFile(handed_out) as given, zipfile.ZipFile(answers, "w") as made:
        manifest = next(name for name in given.namelist() if name.endswith("benchmark.json"))
        root = manifest.removesuffix("benchmark.json")
        tasks = json.loads(given.read(manifest))["tasks"]
        examples = [
            task["files"]["reference"][0] for task in tasks if "reference" in task["files"]
        ]
        example = json.loads(given.read(root + examples[0]))
        made.writestr("card.json", json.dumps(CARD))
        for number, task in enumerate(tasks):
            name = task["name"]
            if number % 2:
                made.writestr(f"{name}.json", write_change(example, number))
            else:
                scene = given.read(root + task["files"]["commonroad"][0])
                made.writestr(f"{name}.xml", change_scene(scene, number))


if __name__ == "__main__":
    main(*sys.argv[1:])
