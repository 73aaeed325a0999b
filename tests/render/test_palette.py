"""Colours that can be told apart: by lightness, and by eyes that see no red or no green."""

import math

import numpy as np
import pytest

from augment.render import palette
from augment.render.palette import Colour

# Machado, Oliveira and Fernandes (2009), full severity, for linear RGB.
PROTANOPIA, DEUTERANOPIA = np.array([
    [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
     [-0.003882, -0.048116, 1.051998]],
    [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
     [-0.011820, 0.042940, 0.968881]],
])  # fmt: skip


def linear(colour: Colour) -> np.ndarray:
    share = np.array(colour[:3]) / 255.0
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def luminance(colour: Colour) -> float:
    return float(linear(colour) @ np.array([0.2126, 0.7152, 0.0722]))


def contrast(one: Colour, other: Colour) -> float:
    high, low = sorted((luminance(one), luminance(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def test_marks_stand_out_by_lightness_alone() -> None:
    for one, other, least in (
        (palette.EGO_MARK.fill, palette.ROAD, 3.0),
        (palette.CHANGED_MARK.fill, palette.ROAD, 4.5),
        (palette.CHANGED_MARK.outline, palette.ROAD, 7.0),
        (palette.CHANGED_MARK.outline, palette.WALKWAY, 7.0),
        (palette.OTHER_MARK.outline, palette.ROAD, 4.5),
        (palette.EGO_MARK.fill, palette.CHANGED_MARK.fill, 1.5),
        (palette.CHANGED_MARK.fill, palette.OTHER_MARK.fill, 3.0),
        (palette.EGO_MARK.fill, palette.EGO_MARK.detail, 4.5),
        (palette.INK, palette.PAPER, 7.0),
    ):
        assert contrast(one, other) >= least


@pytest.mark.parametrize("sight", [PROTANOPIA, DEUTERANOPIA], ids=["no red", "no green"])
def test_ego_changed_and_others_differ_for_colour_blind_eyes(sight: np.ndarray) -> None:
    fills = [style.fill for style in (palette.EGO_MARK, palette.CHANGED_MARK, palette.OTHER_MARK)]
    seen = [np.clip(sight @ linear(fill), 0.0, 1.0) ** (1.0 / 2.2) for fill in fills]
    for index, one in enumerate(seen):
        for other in seen[index + 1 :]:
            assert math.dist(one, other) > 0.3
