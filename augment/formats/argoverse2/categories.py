"""What the 30 annotation categories of Argoverse 2 Sensor are in a scene.

The classes follow nuPlan's: what rolls on two wheels is a bicycle, strollers and wheelchairs go
with pedestrians, poles and animals are generic objects.
"""

from __future__ import annotations

from augment.scene.entities import AgentType

EGO = "EGO_VEHICLE"
"""Some releases annotate the ego itself, as a box at its frame's origin; it is no other agent."""

TYPE_OF: dict[str, AgentType] = {
    "REGULAR_VEHICLE": AgentType.VEHICLE,
    "LARGE_VEHICLE": AgentType.VEHICLE,
    "BOX_TRUCK": AgentType.VEHICLE,
    "TRUCK": AgentType.VEHICLE,
    "TRUCK_CAB": AgentType.VEHICLE,
    "VEHICULAR_TRAILER": AgentType.VEHICLE,
    "RAILED_VEHICLE": AgentType.VEHICLE,
    "BUS": AgentType.BUS,
    "SCHOOL_BUS": AgentType.BUS,
    "ARTICULATED_BUS": AgentType.BUS,
    "BICYCLE": AgentType.BICYCLE,
    "BICYCLIST": AgentType.BICYCLE,
    "MOTORCYCLE": AgentType.BICYCLE,
    "MOTORCYCLIST": AgentType.BICYCLE,
    "WHEELED_DEVICE": AgentType.BICYCLE,
    "WHEELED_RIDER": AgentType.BICYCLE,
    "PEDESTRIAN": AgentType.PEDESTRIAN,
    "OFFICIAL_SIGNALER": AgentType.PEDESTRIAN,
    "STROLLER": AgentType.PEDESTRIAN,
    "WHEELCHAIR": AgentType.PEDESTRIAN,
    "CONSTRUCTION_CONE": AgentType.TRAFFIC_CONE,
    "CONSTRUCTION_BARREL": AgentType.BARRIER,
    "SIGN": AgentType.CONSTRUCTION_SIGN,
    "STOP_SIGN": AgentType.CONSTRUCTION_SIGN,
    "MOBILE_PEDESTRIAN_CROSSING_SIGN": AgentType.CONSTRUCTION_SIGN,
    "MESSAGE_BOARD_TRAILER": AgentType.CONSTRUCTION_SIGN,
    "TRAFFIC_LIGHT_TRAILER": AgentType.GENERIC_OBJECT,
    "BOLLARD": AgentType.GENERIC_OBJECT,
    "ANIMAL": AgentType.GENERIC_OBJECT,
    "DOG": AgentType.GENERIC_OBJECT,
}
"""A table without a rest: a category that is not in it is refused by name."""
