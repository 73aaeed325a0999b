"""The boxes of things whose size nobody gave: interPlan's own, in metres (domain facts 1.3)."""

from __future__ import annotations

from augment.scene.entities import AgentType

EGO_LENGTH_M = 5.176
EGO_WIDTH_M = 2.297

LENGTH_WIDTH_M: dict[AgentType, tuple[float, float]] = {
    AgentType.EGO_VEHICLE: (EGO_LENGTH_M, EGO_WIDTH_M),
    AgentType.VEHICLE: (4.8, 2.0),
    AgentType.BUS: (7.456, 2.079),
    AgentType.BICYCLE: (1.8, 0.6),
    AgentType.PEDESTRIAN: (0.900, 0.791),
    AgentType.TRAFFIC_CONE: (0.5, 0.5),
    AgentType.BARRIER: (2.0, 0.6),
    AgentType.CONSTRUCTION_SIGN: (0.8, 0.8),
    AgentType.GENERIC_OBJECT: (1.0, 1.0),
}
"""Length, width for each type; a plain vehicle is a mid-size car, not the ego's large one."""
