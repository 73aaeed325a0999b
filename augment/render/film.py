"""The moving picture of a scene, as data: marks as the still draws them, and where they are when.

In: what `bev.draw` takes. Out: the bytes of a JSON document that a browser plays over the picture
without anybody (`bev.draw_empty`). No id and no text is in it; its bytes depend on the scene, the
change, the camera and the recording alone.

A document: `window`, which films over one ground share; `step_s`, `steps`; `width`, `height` in
picture pixels; `ego`, its place in `movers`; `marks`, each a list of shapes {fill or stroke,
points or disc, width} in tenths of a pixel about the middle of who faces right (x right, y down);
`movers` in the order of painting, each [mark, first step, last step, values]: x and y in tenths of
a pixel and the turn in degrees, clockwise, at the first step, then, of who moves, what is added at
each. The last `changed` movers are what the change adds or moves; `ticks` are the steps at which
one of them sets out.
"""

import io
import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from augment.geometry.polyline import FloatArray
from augment.render import palette
from augment.render.camera import Camera
from augment.render.canvas import Canvas, Spot
from augment.render.marks import SMALL, draw_mark
from augment.render.shapes import runs
from augment.scene.entities import UPRIGHT, AgentType, Modification, Scene, TrafficAgent, apply
from augment.scene.motion import HORIZON_S, STEP_S, Movement, find_motion
from augment.scene.recording import Recording

STEPS = round(HORIZON_S / STEP_S) + 1
_FINE = 10.0
"""Parts of a pixel."""
_MARGIN_M = 3.0
_FRAME_COLOURS = 64

FRAMES_S = (1.5, 3.0, 4.5, 6.0)
"""Moments after t0 of `draw_frames`."""
_TEXT_PX = 28

Entry = list[Any]


def make_film(
    scene: Scene, modification: Modification, camera: Camera, recording: Recording | None = None
) -> bytes:
    """Return the film of a scene after a change, from t0 on.

    Args:
        scene: The scene before the change.
        modification: What changes.
        camera: The window.
        recording: What is expected after t0; the ego drives as it did, and reacts to nobody.

    Raises:
        InvalidModification: The change does not fit the scene.
    """
    after = apply(scene, modification)
    motion = find_motion(after, recording=recording, with_later=True)
    changed = {agent.id for agent in modification.changed}
    styled = [(motion.ego, palette.EGO_MARK)]
    styled += [
        (movement, palette.CHANGED_MARK if movement.agent.id in changed else palette.OTHER_MARK)
        for movement in motion.others
    ]
    movers: list[tuple[tuple[Any, ...], Entry]] = []
    for movement, style in styled:
        for first, last, values in _stretches(movement, camera):
            sketch = _Sketch(camera.px_per_m)
            upright = replace(movement.agent, x_m=0.0, y_m=0.0, heading_rad=0.0)
            draw_mark(sketch, upright, style)
            mark = json.dumps(sketch.shapes)
            movers.append((_order(movement.agent, style), [mark, first, last, values]))
    # By what they look like and where they are: their order tells nothing of their ids.
    movers.sort(key=lambda entry: (*entry[0], entry[1]))
    marks = sorted({entry[0] for _, entry in movers})
    starts_s = [one.started_s for one in motion.others if one.agent.id in changed]
    steps = {round(start_s / STEP_S) for start_s in starts_s if start_s is not None}
    document = {
        "window": camera.key,
        "step_s": STEP_S,
        "steps": STEPS,
        "width": camera.width_px,
        "height": camera.height_px,
        "ego": next((n for n, (order, _) in enumerate(movers) if order[2]), None),
        "marks": [json.loads(mark) for mark in marks],
        "movers": [[marks.index(entry[0]), *entry[1:]] for _, entry in movers],
        "changed": sum(is_changed for (is_changed, *_), _ in movers),
        "ticks": sorted(step for step in steps if 0 < step < STEPS),
    }
    return json.dumps(document, separators=(",", ":")).encode()


def draw_frames(film: Mapping[str, Any], ground: bytes) -> bytes:
    """Return a PNG with four moments of a film, two by two, each with its time.

    Args:
        film: What `make_film` wrote.
        ground: The picture (PNG) that it plays over.
    """
    empty = Image.open(io.BytesIO(ground)).convert("RGB")
    width, height = film["width"], film["height"]
    scale = empty.width / width
    sheet = Image.new("RGB", (2 * width, 2 * height))
    for number, time_s in enumerate(FRAMES_S):
        frame, step = empty.copy(), round(time_s / film["step_s"])
        pen = ImageDraw.Draw(frame)
        for mark, first, last, values in film["movers"]:
            if first <= step <= last:
                # Values (T, 3): the pose at the first step, then what is added at each.
                poses = np.cumsum(np.reshape(values, (-1, 3)), axis=0)
                pose = poses[min(step - first, len(poses) - 1)]
                _paint_mark(pen, film["marks"][mark], pose, scale)
        pen.text((20, 20), f"after {time_s:g} s", fill=0, font_size=_TEXT_PX * scale)
        corner = (number % 2 * width, number // 2 * height)
        sheet.paste(frame.resize((width, height)), corner)
    png = io.BytesIO()
    sheet.quantize(_FRAME_COLOURS).save(png, "PNG")
    return png.getvalue()


# Private


def _paint_mark(
    pen: ImageDraw.ImageDraw, shapes: list[dict[str, Any]], pose: FloatArray, scale: float
) -> None:
    """Paint a mark at a pose: x and y in tenths of a pixel, the turn in degrees, clockwise."""
    turn_rad, size = np.radians(pose[2]), scale / _FINE
    # y runs down, so this matrix turns clockwise.
    turn = np.array([[np.cos(turn_rad), -np.sin(turn_rad)], [np.sin(turn_rad), np.cos(turn_rad)]])
    for shape in shapes:
        if "disc" in shape:
            x, y, radius = shape["disc"]
            middle = (turn @ (x, y) + pose[:2]) * size
            pen.circle(tuple(middle.tolist()), radius * size, fill=shape["fill"])
            continue
        points = (np.reshape(shape["points"], (-1, 2)) @ turn.T + pose[:2]) * size
        corners = [tuple(point) for point in points.tolist()]
        if "fill" in shape:
            pen.polygon(corners, fill=shape["fill"])
        else:
            pen.line(corners, fill=shape["stroke"], width=max(1, round(shape["width"] * scale)))


class _Sketch(Canvas):
    """Notes the shapes of a mark instead of drawing them."""

    def __init__(self, px_per_m: float) -> None:
        self.camera = Camera.over((0.0, 0.0), (0.0, 0.0), px_per_m)
        self.shapes: list[dict[str, Any]] = []

    def fill(self, points: FloatArray, colour: palette.Colour) -> None:
        self.shapes.append({"fill": _hex(colour), "points": _flat(points)})

    def disc(self, centre: Spot, radius: float, colour: palette.Colour) -> None:
        self.shapes.append({"fill": _hex(colour), "disc": _flat([[*centre, radius]])})

    def stroke(
        self, points: FloatArray, colour: palette.Colour, width: float, *, closed: bool = False
    ) -> None:
        self.shapes.append({"stroke": _hex(colour), "points": _flat(points), "width": width})


def _flat(values: Any) -> list[int]:
    return [int(value) for value in np.round(np.asarray(values) * _FINE).ravel().tolist()]


def _hex(colour: palette.Colour) -> str:
    return "#{:02x}{:02x}{:02x}".format(*colour)


def _stretches(movement: Movement, camera: Camera) -> Iterator[tuple[int, int, list[int]]]:
    """First and last step and values of each stretch in which one is there; seen ones alone."""
    agent, states = movement.agent, movement.states[:STEPS]
    reach_m = agent.length_m / 2.0 + _MARGIN_M
    for first, last in runs(movement.is_present[:STEPS]):
        part = states[first : last + 1]
        if not camera.shows(part[:, :2], margin_m=reach_m):
            continue
        # A film that goes on after a recording ends keeps its last moment.
        end = STEPS - 1 if last == len(states) - 1 else last
        pixels = camera.to_pixels(part[:, :2]) * _FINE
        # Clockwise in a picture whose y runs down; unwrapped, so that nobody spins round at pi.
        turns = (
            np.zeros(len(part)) if agent.type in UPRIGHT else -np.degrees(np.unwrap(part[:, 2]))
        )
        rows = np.round(np.column_stack([pixels, turns])).astype(int)
        # (T - 1, 3) differences of rounded rows: added up they give these again, without drift.
        steps = np.diff(rows, axis=0)
        moves = rows[:1] if not steps.any() else np.vstack([rows[:1], steps])
        yield first, end, moves.ravel().tolist()


def _order(agent: TrafficAgent, style: palette.MarkStyle) -> tuple[Any, ...]:
    """As the still paints: what is changed above, people above vehicles, the small over large."""
    is_ego = agent.type is AgentType.EGO_VEHICLE
    is_changed = style is palette.CHANGED_MARK
    return is_changed, agent.type in SMALL, is_ego, -agent.length_m * agent.width_m
