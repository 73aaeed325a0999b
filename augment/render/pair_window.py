"""Window of a pair: a pure function of the scene, both changes and what the instruction names.

It holds the ego, what either side changes within 60 m with its path, whom it removes, what the
intent names and 10 m around, and no more; in films whoever is changed and the ego at every moment.

Frames: those of `camera`.
"""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from augment.checks import Ground
from augment.checks.lanes_across import LanesAcross, find_mark, find_picked
from augment.checks.wish_places import list_named
from augment.geometry.polyline import FloatArray
from augment.render.camera import FOLLOWED_M, MAX_WIDTH_M, Camera, changed_places
from augment.render.canvas import Box, Canvas, overlap
from augment.render.labels import mark_box, place_badges
from augment.render.palette import PAPER
from augment.render.road import scale_box, scale_corner, tick_bars
from augment.scene.entities import Modification, Scene, TrafficAgent
from augment.scene.intent import Intent, MapPlace, Setting
from augment.scene.motion import HORIZON_S, STEP_S, Movement, find_trails

AROUND_M = 10.0
# Both pictures of a pair have so many pixels in a window of 1280 x 720.
_PANEL_PX = (1212.0, 586.0)
MOST_PX_PER_M = 40.0
"""Of a picture, and of an inset: there 0.1 m, which nobody need see, are 4 pixels."""

INSET_BELOW_PX = 12.0
"""Changes that come no farther from each other are shown enlarged."""
_INSET_SHARE, _INSET_AROUND_M, _INSET_GAIN, _INSET_LEAST_PX = 0.4, 0.75, 1.5, 4.0
_EDGE_PX, _INSET_GAP_PX, _INSET_PLACES = 8.0, 6.0, 16

_JUNCTION = {MapPlace.JUNCTION_START, MapPlace.JUNCTION_END}
_BY_JUNCTION = {setting for setting in Setting if setting.name.endswith("_INTERSECTION")}


def pair_camera(
    ground: Ground,
    sides: tuple[Modification, Modification],
    *,
    intent: Intent | None = None,
    is_filmed: bool = False,
    differing: tuple[tuple[TrafficAgent, TrafficAgent, float], ...] = (),
    ticks_m: tuple[float, ...] = (),
) -> Camera:
    """Return the window of a pair, the same whichever side is which.

    Its scale is what an ordinary screen shows of it, side by side or one above the other.

    Args:
        ground: Of the scene before the change; its recording counts for films.
        sides: Both changes.
        intent: Of the instruction, None without one.
        is_filmed: Whether the pictures have films.
        differing: Objects that stand for each other, and how many metres apart, more than 0; those
            of changes that nobody confuses are not needed.
        ticks_m: Distances ahead of the ego that are marked on its lane.

    Raises:
        InvalidModification: A change does not fit the scene.
    """
    scene = ground.scene
    need = _around([scene.ego.box.corners_m])
    changed = [place for side in sides for place in changed_places(scene, side)]
    near = [place for place in changed if np.hypot(*place.T).min() <= FOLLOWED_M]
    places = [place[4:] for place in near if len(place) > 4]  # where walks end
    places += [*_named(ground, intent), *(bar for _, bar in tick_bars(scene, ticks_m))]
    places = [place for place in places if _middle_m(place) <= FOLLOWED_M]
    places += [place[:4] for place in near]
    # No arrow at the edge points to who is gone.
    gone = {name for side in sides for name in side.removed}
    places += [agent.box.corners_m for agent in scene.agents if agent.id in gone]
    if is_filmed:
        places += [place for side in sides for place in _passed(ground, side)]
    for place in sorted(places, key=_middle_m):
        more = _around([need + np.array([[AROUND_M], [-AROUND_M]]), place])
        if (more[1] - more[0]).max() <= MAX_WIDTH_M:
            need = more
    plain = Camera.over(need[0], need[1], find_scale(*(need[1] - need[0]).tolist()))
    camera = replace(plain, is_filmed=is_filmed, ticks_m=ticks_m)
    return _with_inset(camera, scene, sides, differing)


def find_scale(width_m: float, height_m: float) -> float:
    """Return the pixels a metre at which a screen shows two such windows, the better way round."""
    across, up = _PANEL_PX
    beside = min(across / 2.0 / width_m, up / height_m)
    stacked = min(across / width_m, up / 2.0 / height_m)
    return min(max(beside, stacked), MOST_PX_PER_M)


def covered_boxes(scene: Scene, camera: Camera, sides: tuple[Modification, ...]) -> list[Box]:
    """Return what lies over the ground of any side, in pixels: the scale, an inset, arrows."""
    scale = scale_box(camera, scale_corner(scene, camera))
    boxes = [scale, *([camera.inset.box_px] if camera.inset else [])]
    drawn = [(Canvas(camera, PAPER), scene.ego, side.changed, tuple(boxes)) for side in sides]
    return boxes + sorted({badge.box_px for side in drawn for badge in place_badges(*side)})


def film_states(movement: Movement) -> FloatArray:
    """Return where somebody is while a film goes on, (T, 4)."""
    states = movement.states[: round(HORIZON_S / STEP_S) + 1]
    return np.asarray(states[~np.isnan(states).any(axis=1)])


# Private


def _around(places: list[FloatArray]) -> FloatArray:
    """Return the window (2, 2) in whole metres that holds points (N, 2) with room around them."""
    low, high = _frame(np.vstack(places), AROUND_M)
    return np.array([np.floor(low), np.ceil(high)])


def _middle_m(place: FloatArray) -> float:
    return float(np.hypot(*((place.min(axis=0) + place.max(axis=0)) / 2.0)))


def _passed(ground: Ground, side: Modification) -> Iterator[FloatArray]:
    """Yield the ways of the ego and of who is changed in a film, and trails as drawn."""
    expected = ground.expect(ground.scene, side)
    motion = ground.motion_after(side, of_all=False)
    changed = {agent.id for agent in side.changed}
    for movement in (motion.ego, *motion.others):
        agent, at = movement.agent, film_states(movement)[:, :2]
        if len(at) and (movement is motion.ego or agent.id in changed):
            reach_m = np.hypot(agent.length_m, agent.width_m) / 2.0
            yield np.vstack([at.min(axis=0) - reach_m, at.max(axis=0) + reach_m])
    for trail in find_trails(ground.scene, side, expected, with_held=True):
        drawn = trail.way_m[np.hypot(*trail.way_m.T) <= FOLLOWED_M]
        if len(drawn):
            yield drawn


def _named(ground: Ground, intent: Intent | None) -> Iterator[FloatArray]:
    """Yield road users and places of the map that an intent names, as far as they are there."""
    lanes = LanesAcross.of(ground, intent.route) if intent else None
    if intent is None or lanes is None:
        return
    asks = (*intent.requests, *intent.moves)
    picks = [ask.spot.landmark for ask in asks if ask.spot.landmark is not None]
    for pick in (*picks, *(move.who for move in intent.moves), *intent.removals):
        yield from (agent.box.corners_m for agent in find_picked(lanes, pick))
    motions = [motion for ask in asks if (motion := getattr(ask, "motion", None))]
    marks = {ask.spot.mark for ask in asks}
    marks |= {motion.start.mark for motion in motions if motion.start}
    settings = {setting for ask in asks for setting in ask.spot.settings}
    if marks & _JUNCTION or settings & _BY_JUNCTION:
        marks |= _JUNCTION
    found = (find_mark(lanes, mark) for mark in marks if mark is not None)
    stations = [at_m for at_m in found if at_m is not None]
    for setting in settings - _BY_JUNCTION - {Setting.OFF_CROSSWALK}:
        stations += [end for span in list_named(setting, lanes) for end in span]
    poses = [lanes.route.line.pose_at(lanes.route.ego_s_m + at_m) for at_m in stations]
    yield from (np.array([[pose.x_m, pose.y_m]]) for pose in poses)


def _frame(points_m: FloatArray, around_m: float = _INSET_AROUND_M) -> FloatArray:
    """Return the corners (2, 2) of the window round points (N, 2)."""
    return np.array([points_m.min(axis=0) - around_m, points_m.max(axis=0) + around_m])


def _outline(agent: TrafficAgent) -> FloatArray:
    """Return what is drawn of somebody, (5 or 6, 2): corners, a second's way, a walk's end."""
    ahead_m = math.copysign(agent.length_m / 2.0, agent.speed_mps) + agent.speed_mps
    tip = agent.pose.to_parent(np.array([[ahead_m, 0.0]]))
    return np.vstack([agent.box.corners_m, tip, *([agent.walk_to_m] if agent.walk_to_m else [])])


def _with_inset(
    camera: Camera,
    scene: Scene,
    sides: tuple[Modification, Modification],
    differing: tuple[tuple[TrafficAgent, TrafficAgent, float], ...],
) -> Camera:
    """Return the camera with an inset of what differs, where that is hard to see and it helps."""
    # Of equal ones the rearmost first, whichever side is which.
    apart = sorted(differing, key=lambda pair: (-round(pair[2], 6), pair[0].x_m + pair[1].x_m))
    seen_m = [m for *both, m in apart if any(camera.shows(one.box.corners_m) for one in both)]
    if not apart or max(seen_m, default=0.0) * camera.px_per_m >= INSET_BELOW_PX:
        return camera
    boxes = [np.vstack([agent.box.corners_m for agent in both]) for *both, _ in apart]
    most_px = _INSET_SHARE * np.array([camera.width_px, camera.height_px])
    # All that differs, what differs most, or its part that does.
    first, other = _outline(apart[0][0]), _outline(apart[0][1])
    ends = np.stack([first, other], axis=1)[np.hypot(*(first - other).T).round(6).argmax()]
    whole = _frame(np.vstack([boxes[0], ends]))
    room_m = np.outer([-0.5, 0.5], most_px / MOST_PX_PER_M)
    part = _frame(np.vstack([ends, np.clip(ends.mean(axis=0) + room_m, *whole)]), 0.0)
    frames = [_frame(np.vstack([*boxes, ends])), whole, part]
    scales = [min(*(most_px / (high - low)).tolist(), MOST_PX_PER_M) for low, high in frames]
    gain = _INSET_GAIN * camera.px_per_m if seen_m else 0.0
    least = max(_INSET_LEAST_PX / apart[0][2], gain)
    chosen = next((n for n, scale in enumerate(scales) if scale >= least), -1)
    (low, high), scale = frames[chosen], scales[chosen]
    if scale < gain:
        return camera
    marks = [*scene.agents, scene.ego, *(agent for side in sides for agent in side.changed)]
    spots = [mark_box(camera, agent) for agent in marks]
    # What is changed and the ego weigh more than all the traffic.
    weights = [1 if n < len(scene.agents) else len(marks) for n in range(len(marks))]
    width, height = (scale * (high - low)).tolist()
    # Along the upper and the lower edge, from the right.
    lefts = np.linspace(camera.width_px - width - _EDGE_PX, _EDGE_PX, _INSET_PLACES).tolist()
    tops = (_EDGE_PX, camera.height_px - height - _EDGE_PX)
    boxes_px = [(left, top, left + width, top + height) for top in tops for left in lefts]
    hides = [[overlap(box, spot, _INSET_GAP_PX) for spot in spots] for box in boxes_px]
    left, top, *_ = boxes_px[int(np.dot(hides, weights).argmin())]
    return replace(camera, inset=Camera.over(low, high, scale).at(left, top))
