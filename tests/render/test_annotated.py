"""Marks stand where the findings are, and nothing of them is in a picture for a vote."""

from __future__ import annotations

import numpy as np

from augment.render import palette
from augment.render.bev import FaultMark, draw, draw_annotated
from augment.scene.entities import Modification
from tests.render.pictures import WIDE, opened
from tests.scenes import scene, vehicle

CAR = vehicle("Agent2", 25.0, 0.0)
CHANGE = Modification(added=(CAR,))
CAMERA = WIDE
WRONG = FaultMark(number=1, agents=("Agent2",), is_wrong=True)


def places(png: bytes, colour: tuple[int, ...]) -> np.ndarray:
    """Where pixels (N, 2) of that colour are, in metres of the ego frame."""
    pixels = np.asarray(opened(png)).astype(int)
    rows, columns = np.nonzero((np.abs(pixels - np.array(colour[:3])) < 6).all(axis=2))
    origin = CAMERA.to_pixels(np.array([[0.0, 0.0]]))[0]
    x_m = (columns - origin[0]) / CAMERA.px_per_m
    return np.column_stack([x_m, (origin[1] - rows) / CAMERA.px_per_m])


def test_a_mark_is_round_its_agent_and_nowhere_else() -> None:
    found = places(draw_annotated(scene(), CHANGE, CAMERA, [WRONG]), palette.WRONG)
    assert len(found) > 400
    assert np.abs(found - [25.0, 0.0]).max() < 4.0


def test_what_is_missing_is_marked_where_it_belongs() -> None:
    mark = FaultMark(number=1, agents=(), is_wrong=True, belongs_m=(20.0, 3.5))
    found = places(draw_annotated(scene(), Modification(), CAMERA, [mark]), palette.WRONG)
    assert np.abs(found - [20.0, 3.5]).max() < 4.0


def test_several_marks_of_one_agent_do_not_cover_each_other() -> None:
    marks = [FaultMark(number=n, agents=("Agent2",), is_wrong=True) for n in range(1, 7)]
    one = places(draw_annotated(scene(), CHANGE, CAMERA, marks[:1]), palette.WRONG)
    six = places(draw_annotated(scene(), CHANGE, CAMERA, marks), palette.WRONG)
    ring = 2.0 * (CAR.length_m + CAR.width_m) * CAMERA.px_per_m * 2.0
    assert len(six) - len(one) > 4.5 * (len(one) - ring)


def test_who_is_out_of_the_picture_or_gone_breaks_nothing() -> None:
    far = Modification(added=(vehicle("Agent2", 300.0, 0.0),))
    marks = [WRONG, FaultMark(number=2, agents=("Agent77",), is_wrong=True)]
    found = places(draw_annotated(scene(), far, CAMERA, marks), palette.WRONG)
    assert len(found) > 800


def test_a_picture_for_a_vote_has_none_of_it() -> None:
    png = draw(scene(), CHANGE, CAMERA)
    for colour in (palette.WRONG, palette.DOUBTFUL, palette.STAMP):
        assert len(places(png, colour)) == 0


def test_the_same_marks_give_the_same_bytes() -> None:
    first, again = (draw_annotated(scene(), CHANGE, CAMERA, [WRONG]) for _ in range(2))
    assert first == again
