"""How far off what was asked for something may be before it is a fault.

One set for every scenario and contestant; docs/method.md says where each number comes from. The
references of the catalogue are held by a narrower one: their authors measured them.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerances:
    """Of each kind of statement, in its unit.

    Attributes:
        distance_m, distance_share: Along the lane, whichever is more; 3 m at 60 m.
        across_m: Across the lane, where an offset is asked for.
        middle_m: From the lane centre, where that is asked for.
        edge_m: Beyond the edge of the lane that was asked for.
        heading_deg: Of what is turned against its lane or a neighbour.
        spacing_m, spacing_share: Between neighbours, whichever is more.
        drift_m: How much further along the lane a walk ends.
    """

    distance_m: float
    distance_share: float
    across_m: float
    middle_m: float
    edge_m: float
    heading_deg: float
    spacing_m: float
    spacing_share: float
    drift_m: float


USUAL = Tolerances(
    # In the paper's figures GPT-4o's plain variant has a third quartile of 2.1 m and a whisker of
    # 2.9 m, and its table counts 3 position errors in 50: people accept that.
    distance_m=2.5,
    distance_share=0.05,
    # Half the width of the paper's "slight random offset of 0 to 1.5 m".
    across_m=0.75,
    # A car there still blocks its lane.
    middle_m=1.0,
    edge_m=0.25,
    # Half of what the check without an intent takes for a vehicle that follows its lane.
    heading_deg=15.0,
    # interPlan's cones stand 1.6 to 3.9 m apart.
    spacing_m=0.75,
    spacing_share=0.3,
    drift_m=5.0,
)
"""Of what contestants hand in."""

AUTHORED = Tolerances(
    distance_m=0.5,
    distance_share=0.0,
    across_m=0.1,
    middle_m=0.1,
    edge_m=0.25,
    heading_deg=3.0,
    spacing_m=0.15,
    spacing_share=0.0,
    drift_m=0.5,
)
"""Of the catalogue's references."""

CRASH_M = 6.0
"""From one crashed vehicle to the next at most: the widest of interPlan's."""

WORKER_M = 6.0
"""From a worker to the nearest cone; interPlan's stand 0.8 to 4.0 m off."""

SPEED_MPS, SPEED_SHARE = 1.0, 0.2
"""Of what moves, whichever is more."""

LONG_VEHICLE_M = 7.0
"""A vehicle of this length passes for a bus, as interPlan's file has it."""
