"""The colours and line widths of the pictures: data alone.

The paper's conventions: ego red, changed agents blue, drivable area grey, walkways olive. Marks
never differ by colour alone; red and blue differ in lightness too. Widths are in picture pixels.
Nothing is see-through: a picture has few colours, so it is small and quickly drawn.
"""

from dataclasses import dataclass

Colour = tuple[int, int, int]

PAPER: Colour = (255, 255, 255)
BEYOND: Colour = (239, 241, 233)
ROAD: Colour = (222, 224, 227)
ROAD_EDGE: Colour = (138, 142, 148)
INTERSECTION: Colour = (213, 215, 219)
CARPARK: Colour = (233, 234, 236)
WALKWAY: Colour = (225, 225, 190)
WALKWAY_EDGE: Colour = (178, 178, 118)
LANE_LINE: Colour = (255, 255, 255)
LANE_SOLID: Colour = (138, 142, 148)
ZEBRA: Colour = (255, 255, 255)
ZEBRA_GROUND: Colour = (205, 208, 212)

OWN_LANE: Colour = (70, 71, 73)
OTHER_LANE: Colour = (134, 135, 190)
CONNECTOR: Colour = (205, 190, 150)

GRID: Colour = (207, 209, 213)
GRID_AXIS: Colour = (172, 175, 181)

INK: Colour = (33, 37, 41)
LANE_TEXT: Colour = (0, 0, 128)
HALO: Colour = (255, 255, 255)
GHOST: Colour = (142, 146, 153)

# Nothing has these colours any more; they keep the numbers of those below as they were.
WRONG: Colour = (170, 0, 110)
DOUBTFUL: Colour = (150, 92, 0)
STAMP: Colour = (120, 80, 165)

LIGHT_RED: Colour = (192, 28, 40)
LIGHT_YELLOW: Colour = (226, 165, 0)
LIGHT_GREEN: Colour = (30, 138, 74)


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkStyle:
    """Style of the mark of one class of agents.

    Attributes:
        detail: For what lies on the body: nose, wedge, cross.
        hatch: Lines across the body, None without them.
        outline_px: Drawn inside the true box, so that a thick outline adds no size.
    """

    fill: Colour
    outline: Colour
    detail: Colour = PAPER
    hatch: Colour | None = None
    outline_px: float


EGO_MARK = MarkStyle(fill=(218, 30, 40), outline=(122, 8, 16), outline_px=2.0)
CHANGED_MARK = MarkStyle(
    fill=(20, 62, 192), outline=(6, 22, 92), hatch=(122, 160, 245), outline_px=3.5
)
OTHER_MARK = MarkStyle(fill=(164, 168, 174), outline=(84, 88, 94), outline_px=1.5)


def inks() -> dict[Colour, int]:
    """Every colour of the pictures with its number in their palettes; smooth text comes late.

    Last are those of trails, which only pictures with a trail have in theirs.

    The numbers go by the order of this file, so the same drawing gives the same bytes.
    """
    colours: list[Colour] = []
    for value in globals().values():
        if isinstance(value, MarkStyle):
            colours += filter(None, (value.fill, value.outline, value.detail, value.hatch))
        elif isinstance(value, tuple) and len(value) == 3 and all(type(v) is int for v in value):
            colours.append(value)
    every = dict.fromkeys([*colours, *TEXT_RAMP, *TRAIL])
    return {colour: number for number, colour in enumerate(every)}


TEXT_RAMP: tuple[Colour, ...] = tuple(
    (
        255 - round((255 - INK[0]) * step / 7.0),
        255 - round((255 - INK[1]) * step / 7.0),
        255 - round((255 - INK[2]) * step / 7.0),
    )
    for step in range(1, 8)
)
"""From almost paper to ink."""

TRAIL: tuple[Colour, ...] = (
    *((40, 76, 200), (62, 94, 204), (84, 112, 208)),
    *((106, 130, 213), (128, 148, 217), (150, 166, 222)),
)
"""Where somebody is after each second: from almost the blue of a change to almost the road."""
