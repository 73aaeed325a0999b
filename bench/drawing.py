"""What a picture costs, how much of it is blank and how large people are in it.

`REALDATA_DIR=... python -m bench.drawing`: the catalogue's references and, where there
are recorded scenes, these, in one process; matplotlib draws the same boxes and lanes beside it.
"""

from __future__ import annotations

import io
import os
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import django
import numpy as np

from augment.geometry.boxes import corners
from augment.render import bev
from augment.render.camera import Camera, camera_for
from augment.render.marks import PERSON_PX
from augment.render.shapes import ribbon
from augment.scene.entities import AgentType, Scene, TrafficAgent
from augment.scene.lane_graph import AnyLane
from augment.scene.modification import Modification, without_traffic
from tests.recorded import recorded_moments
from tests.render.pictures import blank_share

ROUNDS = 5
PANEL_PX = 618.0
"""How wide a picture is on the voting page in a window of 1280 x 720."""
PERSON_M = 0.8


def main() -> None:
    """Print the tables."""
    print(f"load average {os.getloadavg()[0]:.1f}\n")
    print("| pictures | n | blank, median | person on the page (px) | kB, median |")
    print("|---|---|---|---|---|")
    recorded = _recorded()
    _print_pictures("catalogue", list(_catalogue()))
    for name, scenes in recorded.items():
        _print_pictures(name, [(scene, None) for scene in scenes])
    if recorded:
        firsts = [(scenes[0], None) for scenes in recorded.values()]
        _print_pictures("recorded, the first moment of each", firsts)
    print(
        "\n| recorded scene | boxes | cold (ms) | warm, one moved (ms) | warm, one added (ms) |",
        end="",
    )
    print(" matplotlib (ms) |\n|---|---|---|---|---|---|")
    for name, (scene, *_) in recorded.items():
        camera = camera_for(scene, None)
        near = scene.agents[0]
        added = Modification(added=(_standing(near),))
        draw = partial(bev.draw, scene, added, camera)
        print(
            f"| {name} | {len(scene.agents) + 1} "
            f"| {_ms(draw, before=_forget):.0f} "
            f"| {_ms(draw, before=bev._unchanged.cache_clear):.0f} "
            f"| {_ms(draw):.0f} "
            f"| {_ms(partial(_by_matplotlib, scene, camera)):.0f} |"
        )


def _catalogue() -> Iterator[tuple[Scene, Modification | None]]:
    os.environ.setdefault("DJANGO_SETTINGS_MODULE", "arena.config.settings")
    django.setup()
    from augment.services.scenarios.catalogue_files import read_catalogue

    scenes, entries = read_catalogue(Path(__file__).parents[1] / "fixtures")
    for entry in entries:
        whole = scenes[entry.scene]
        yield whole if entry.keep_traffic else without_traffic(whole), entry.reference


def _recorded() -> dict[str, list[Scene]]:
    """Scenes by the format that they were recorded in, one every five seconds."""
    found: dict[str, list[Scene]] = {}
    folder = os.environ.get("REALDATA_DIR", "")
    if folder:
        for title, scene in recorded_moments(Path(folder), every_s=5.0):
            found.setdefault(title, []).append(scene)
    return found


def _print_pictures(name: str, shown: Sequence[tuple[Scene, Modification | None]]) -> None:
    drawn = [(camera_for(scene, change), scene, change) for scene, change in shown]
    pngs = [bev.draw(scene, change or Modification(), camera) for camera, scene, change in drawn]
    blank = statistics.median(map(blank_share, pngs))
    size = statistics.median(len(png) / 1000.0 for png in pngs)
    people = min(_person_px(camera) for camera, _, _ in drawn)
    print(f"| {name} | {len(pngs)} | {blank:.0%} | {people:.1f} | {size:.0f} |")


def _person_px(camera: Camera) -> float:
    return max(PERSON_PX, PERSON_M * camera.px_per_m) * PANEL_PX / camera.width_px


def _standing(near: TrafficAgent) -> TrafficAgent:
    return replace(near, id="New1", speed_mps=0.0)


def _forget() -> None:
    bev._flat.cache_clear()
    bev._unchanged.cache_clear()


def _ms(draw: Callable[[], object], *, before: Callable[[], None] = lambda: None) -> float:
    """The median of the processor time."""
    spent = []
    for _ in range(ROUNDS + 1):
        before()
        start = time.process_time()
        draw()
        spent.append(time.process_time() - start)
    return 1000.0 * statistics.median(spent[1:])


def _by_matplotlib(scene: Scene, camera: Camera) -> bytes:
    """Lanes, areas, boxes and the picture's size: less than ours draws."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure

    figure = Figure(figsize=(camera.width_px / 100.0, camera.height_px / 100.0), dpi=200)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(camera.x_min_m, camera.x_max_m)
    axes.set_ylim(camera.y_min_m, camera.y_max_m)
    lanes: list[AnyLane] = [*scene.lanes, *scene.connectors]
    axes.add_collection(
        PolyCollection([np.array(one.boundary_m) for one in scene.areas], facecolor="0.9")
    )
    axes.add_collection(PolyCollection([ribbon(lane) for lane in lanes], facecolor="0.85"))
    for lane in lanes:
        axes.plot(*lane.centerline.points_m.T, "--", color="0.5", linewidth=0.7)
    boxes = [corners(one.pose, one.length_m, one.width_m) for one in scene.everyone]
    colours = ["r" if one.type is AgentType.EGO_VEHICLE else "0.6" for one in scene.everyone]
    axes.add_collection(PolyCollection(boxes, facecolor=colours, edgecolor="k"))
    stream = io.BytesIO()
    figure.savefig(stream, format="png")
    return stream.getvalue()


if __name__ == "__main__":
    main()
