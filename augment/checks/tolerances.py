"""How far off what was asked for something may be before it is a fault.

One set for every scenario and contestant; docs/checks.md says where each number comes from.
"""

from __future__ import annotations

DISTANCE_M = 2.5
"""Along the ego's lane. In the paper's figures GPT-4o's plain variant has a third quartile of
2.1 m and a whisker of 2.9 m, and its table counts 3 position errors in 50: people accept that."""

DISTANCE_SHARE = 0.05
"""Of the distance asked for, where that is more: 3 m at 60 m."""

ACROSS_M = 0.75
"""Across the lane, where an offset is asked for: half the width of the paper's "slight random
offset of 0 to 1.5 m"."""

MIDDLE_M = 1.0
"""From the lane centre, where no offset is asked for: a car there still blocks its lane."""

EDGE_M = 0.25
"""Beyond the edge of the lane that was asked for."""

HEADING_DEG = 15.0
"""Half of what the check without an intent takes for a vehicle that follows its lane."""

SPACING_M, SPACING_SHARE = 0.75, 0.3
"""Between neighbours, whichever is more; interPlan's cones stand 1.6 to 3.9 m apart."""

CRASH_M = 6.0
"""From one crashed vehicle to the next at most: the widest of interPlan's."""

WORKER_M = 6.0
"""From a worker to the nearest cone; interPlan's stand 0.8 to 4.0 m off."""

SPEED_MPS, SPEED_SHARE = 1.0, 0.2
"""Of what moves, whichever is more."""

LONG_VEHICLE_M = 7.0
"""A vehicle of this length passes for a bus, as interPlan's file has it."""
