"""What helps to measure the pictures of a scenario: lines, rings, and the edges of a lane."""

from __future__ import annotations

from augment.checks.measures import LaneEdges as LaneEdges
from augment.checks.measures import MeasureLine as MeasureLine
from augment.checks.measures import Measures, find_measures, lane_edges_at
from augment.models import Scenario
from augment.services.judging.findings import ground_of
from augment.services.scenarios.scenes import intent_of


def measures_of(scenario: Scenario, *, reach_m: float) -> Measures:
    """The lines and rings of a scenario, in the frame of its pictures.

    Args:
        scenario: With its scene; no augmentation of it is looked at.
        reach_m: The radius up to which rings are drawn.

    Raises:
        InvalidDocument: The stored scene or intent can't be read.
    """
    return find_measures(ground_of(scenario), intent_of(scenario), reach_m=reach_m)


def lane_edges_of(scenario: Scenario, x_m: float, y_m: float) -> LaneEdges | None:
    """How far a point is from the edges of its lane, None off every lane.

    Raises:
        InvalidDocument: The stored scene can't be read.
    """
    return lane_edges_at(ground_of(scenario), x_m, y_m)
