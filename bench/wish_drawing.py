"""Draw what the distance to the wish is, for docs/method.md: `python -m bench.wish_drawing`."""

from dataclasses import replace

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from augment.checks import Ground
from augment.checks.wish import measure_wish
from augment.metrics.displacement import displacement
from augment.scene.codec import INTENT, intent_from_document
from augment.scene.entities import Modification, TrafficAgent
from augment.scene.planned_motion import AtTime, PlannedMotion
from bench.report import ROOT
from tests.fixtures.shelf import whole_scene
from tests.scenes import vehicle

PAGE = ROOT / "docs" / "images" / "wish.svg"
CURVE, STRAIGHT = "reservoir-road", "boulevard-north"
MARK, OTHER = "#1f6f8b", "#b5532d"


def measure(ground: Ground, request: dict[str, object], agent: TrafficAgent) -> float:
    """Return how far one vehicle is from a wish, in m."""
    intent = intent_from_document(INTENT.frame | {"requests": [{"kind": "vehicles"} | request]})
    found = measure_wish(ground, Modification(added=(agent,)), intent)
    assert found is not None
    return found.distances_m[0]


def draw_places(figure: Figure) -> None:
    """Draw lines of equal distance around the places that a sentence admits."""
    axes, scene = figure.add_subplot(1, 2, 1), replace(whole_scene(CURVE), agents=())
    ground = Ground.of(scene)
    spot = {"distance": {"low_m": 20, "high_m": 30}, "relation": "ahead", "lane": "own"}
    request = {"spot": spot, "count": 1, "speed_mps": 0}
    across, up = np.arange(8.0, 43.0, 0.8), np.arange(-12.0, 20.0, 0.8)
    far_m = [[measure(ground, request, vehicle("New1", x, y)) for x in across] for y in up]
    for lane in scene.lanes:
        axes.plot(*lane.centerline.points_m.T, color="0.75", linewidth=0.8, linestyle="--")
    axes.contourf(across, up, far_m, levels=[-1.0, 0.05], colors=[f"{MARK}55"])
    lines = axes.contour(across, up, far_m, levels=[1.0, 3.0, 6.0], colors=MARK, linewidths=0.9)
    axes.clabel(lines, fmt="%g m", fontsize=7, inline=False)
    axes.set(xlim=(8.0, 42.0), ylim=(-12.0, 19.0), aspect="equal", xticks=[], yticks=[])
    axes.set_title("A car, 20 to 30 m ahead in our lane")


def draw_starts(figure: Figure) -> None:
    """Draw both distances of a car that brakes sooner or later."""
    axes = figure.add_subplot(1, 2, 2)
    spot = {"distance": {"low_m": 16}, "relation": "ahead", "lane": "own"}
    start = {"after_s": {"low": 1, "high": 2}}
    wish = {"preset": "hard_braking", "start": start, "braking_mps2": {"low": 6}}
    request = {"spot": spot, "count": 1, "speed_mps": 9, "motion": wish}
    ground = Ground.of(replace(whole_scene(STRAIGHT), agents=()))
    starts_s = np.linspace(0.0, 4.0, 17)
    to_wish, to_reference = list[float](), list[float]()
    for start_s in (1.5, *starts_s.tolist()):
        motion = PlannedMotion(speeds=((1.5, 0.0),), start=AtTime(after_s=start_s))
        car = replace(vehicle("New1", 16.0, 0.0), speed_mps=9.0, lane_id="Lane1", motion=motion)
        if not to_reference:
            reference = Modification(added=(car,))
        found = displacement(Modification(added=(car,)), reference, ground)
        to_reference.append(found.error_m)
        to_wish.append(measure(ground, request, car))
    axes.plot(starts_s, to_reference[1:], color=OTHER, label="displacement from a reference")
    axes.plot(starts_s, to_wish[1:], color=MARK, label="distance to the wish")
    axes.set(xlabel="it begins to brake after, s", ylabel="mean over 6 s, m")
    axes.set_title("It brakes at 6 m/s², in 1 to 2 s from now")
    axes.legend(frameon=False)
    axes.grid(color="0.9")


def main() -> None:
    """Write the drawing."""
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "wish", "font.size": 8}):
        figure = Figure(figsize=(8.0, 3.0), layout="constrained")
        draw_places(figure)
        draw_starts(figure)
        figure.savefig(PAGE, metadata={"Date": None}, facecolor="white")


if __name__ == "__main__":
    main()
