"""A change that is obviously wrong, to see whether somebody looks at the pictures at all."""

from __future__ import annotations

import math
from dataclasses import replace

from augment.scene.entities import Modification

SPACING_M = 0.6
"""Between the centres of the objects, so that a pile of several is seen as a pile."""


def break_reference(reference: Modification) -> Modification | None:
    """The reference with everything that it places heaped across the ego.

    No instruction asks for a collision with a standing ego, and no road user looks like that.

    Args:
        reference: A right change, in the ego frame.

    Returns:
        The wrong one, None where the reference places nothing.
    """
    if not reference.changed:
        return None
    heaped = [
        replace(
            agent,
            x_m=SPACING_M * index,
            y_m=0.0,
            heading_rad=math.pi / 2,
            lane_id=None,
            walk_to_m=None,
        )
        for index, agent in enumerate(reference.changed)
    ]
    added = len(reference.added)
    return replace(reference, added=tuple(heaped[:added]), moved=tuple(heaped[added:]))
