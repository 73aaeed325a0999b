"""The contestants that ask nobody and place what an intent asks for, by their slugs.

In: a scene, its intent, a seed. Out: a modification with notes, or why it refuses. A new one is an
entry of PLACERS; slugs are kept in databases, so they stay.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from augment.baselines import coarse_grid, rule_placer
from augment.baselines.rule_placer import Placement
from augment.scene.entities import Modification

RULE_PLACER = "rule-placer"
SPACING_M = 0.6
"""Between the centres of the objects, so that a pile of several is seen as a pile."""


PlaceIntent = Callable[..., Placement]
"""Takes a scene and an intent, and `seed` by its name; raises CannotPlace where it refuses."""


@dataclass(frozen=True, slots=True)
class Placer:
    """One of them.

    Attributes:
        name: For people.
        is_rule: Whether it is a contestant of kind "rule"; the others are of kind "baseline".
    """

    name: str
    place: PlaceIntent
    is_rule: bool = False


PLACERS: dict[str, Placer] = {
    RULE_PLACER: Placer("Rule placer", rule_placer.place, is_rule=True),
    "quantised-5m": Placer("Coarse grid baseline, 5 m", coarse_grid.place),
}


def break_reference(reference: Modification) -> Modification | None:
    """Return a change that is obviously wrong, to see whether somebody looks at the pictures.

    It is the reference with everything that it places heaped across the ego. No instruction asks
    for a collision with a standing ego, and no road user looks like that.

    Args:
        reference: A right change, in the ego frame.

    Returns:
        The wrong one, None where the reference places nothing.
    """
    if not reference.changed:
        return None
    across: dict[str, Any] = {"y_m": 0.0, "heading_rad": math.pi / 2, "lane_id": None}
    return reference.with_changed(
        replace(agent, x_m=SPACING_M * index, walk_to_m=None, **across)
        for index, agent in enumerate(reference.changed)
    )
